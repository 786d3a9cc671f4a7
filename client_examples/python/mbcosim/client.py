"""Connections to a server."""
import os
import uuid

import grpc

from mbcosim.v1 import coupling_pb2_grpc, reduction_pb2, reduction_pb2_grpc, simulations_pb2, simulations_pb2_grpc, telemetry_pb2_grpc

from . import bundle
from .errors import translated
from .simulation import Simulation


def default_address():
    """The socket that `mbcosimd` listens on by default, or $MBCOSIM_ADDRESS."""
    if os.environ.get("MBCOSIM_ADDRESS"):
        return os.environ["MBCOSIM_ADDRESS"]
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"unix:{runtime}/mbcosim.sock" if runtime else f"unix:/tmp/mbcosim-{os.getuid()}/mbcosim.sock"


def connect(address=None, *, token=None, credentials=None, timeout=10.0):
    """A connection to the server at `address` ("unix:PATH" or "HOST:PORT"); waits until it answers.

    token        bearer token
    credentials  grpc.ChannelCredentials for TLS
    timeout      seconds until Unavailable is raised
    """
    server = Server(address or default_address(), token, credentials)
    try:
        server.info(timeout)
    except Exception:
        server.close()
        raise
    return server


class Server:
    """A connection. Use it as a context manager, or call close()."""

    def __init__(self, address, token=None, credentials=None):
        options = [("grpc.max_receive_message_length", -1)]
        if credentials:
            self._channel = grpc.secure_channel(address, credentials, options)
        else:
            self._channel = grpc.insecure_channel(address, options)
        self.address = address
        self.metadata = [("authorization", f"Bearer {token}")] if token else []
        self.simulations = simulations_pb2_grpc.SimulationsStub(self._channel)
        self.reduction = reduction_pb2_grpc.ReductionStub(self._channel)
        self.coupling = coupling_pb2_grpc.CouplingStub(self._channel)
        self.telemetry = telemetry_pb2_grpc.TelemetryStub(self._channel)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Closes the connection. Simulations on the server live on for their lease."""
        self._channel.close()

    def info(self, timeout=10.0):
        """`mbcosim.v1.ServerInfo`: version, limits, identity, role."""
        with translated():
            return self.simulations.GetServerInfo(simulations_pb2.GetServerInfoRequest(), metadata=self.metadata,
                                                  timeout=timeout, wait_for_ready=True)

    def load(self, deck, **options):
        """Creates a simulation from a deck on this machine and the files that it names. For options see load_bundle."""
        main, files = bundle.collect(deck)
        return self.load_bundle(main, files, **options)

    def load_text(self, text, **options):
        """Creates a simulation from a deck given as text."""
        return self.load_bundle("deck", {"deck": text.encode()}, **options)

    def load_bundle(self, main, files, **options):
        """Creates a simulation from files (bytes by name) whose main one is `main`.

        name          for people
        lease         seconds that the simulation lives without calls; None: the server's default
        ports         places where peers can couple: structural_port, signal_port, motion_port, modal_port
        policy        what to do when a step does not converge: "fail", "cut_step" or "accept_flagged"
        minimum_step  shortest piece of "cut_step" [s]; 0: 1/1024 of the step
        record        keeps what crosses the ports; see Simulation.record
        summed_time   time is summed from step to step as MBDyn does, instead of t0 + n h
        """
        return self._create(simulations_pb2.UploadHeader(bundle_main_file=main), files, **options)

    def load_from_root(self, deck, **options):
        """Creates a simulation from a deck under the server's model root. For options see load_bundle."""
        return self._create(simulations_pb2.UploadHeader(model_root_file=deck), {}, **options)

    def _create(self, header, files, *, name="", lease=None, ports=(), policy="fail", minimum_step=0.0, record=False,
                summed_time=False):
        header.options.request_id = uuid.uuid4().hex
        header.options.display_name = name
        header.options.ports.extend(ports)
        header.options.non_convergence_policy = simulations_pb2.NonConvergencePolicy.Value(
            "NON_CONVERGENCE_POLICY_" + policy.upper())
        header.options.minimum_step_s = minimum_step
        header.options.record_ports = record
        header.options.summed_time = summed_time
        if lease is not None:
            header.options.lease.FromMilliseconds(int(lease * 1000))
        with translated():
            reply = self.simulations.CreateSimulation(bundle.requests(header, files), metadata=self.metadata)
        return Simulation(self, reply.simulation, list(reply.diagnostics), reply.printed)

    def validate(self, deck):
        """`mbcosim.v1.ValidateModelReply` about a deck on this machine."""
        main, files = bundle.collect(deck)
        header = simulations_pb2.UploadHeader(bundle_main_file=main)
        with translated():
            return self.simulations.ValidateModel(bundle.requests(header, files), metadata=self.metadata)

    def reduce(self, job, *, progress=None, **options):
        """Reduces a finite element model: `job` is a job file on this machine, beside the files that it names.

        Options of the job can be given here: basis="complement", max_frequency=100. `progress(phase, fraction)` is called on the
        way. Returns (`mbcosim.v1.ReduceReport`, bytes of the FEM data file).
        """
        main, files = bundle.collect_job(job)
        header = reduction_pb2.ReduceHeader(main_file=main)
        header.options.update({name.replace("_", "-"): str(value) for name, value in options.items()})
        report, data = None, bytearray()
        with translated():
            for reply in self.reduction.Reduce(bundle.reduce_requests(header, files), metadata=self.metadata):
                if reply.HasField("chunk"):
                    data += reply.chunk.data
                elif reply.HasField("report"):
                    report = reply.report
                elif progress is not None:
                    progress(reply.progress.phase, reply.progress.fraction)
        return report, bytes(data)

    def list(self):
        """`mbcosim.v1.SimulationInfo` of every simulation of this identity."""
        request, found = simulations_pb2.ListSimulationsRequest(), []
        while True:
            with translated():
                reply = self.simulations.ListSimulations(request, metadata=self.metadata)
            found += reply.simulations
            if not reply.next_page_token:
                return found
            request.page_token = reply.next_page_token

    def attach(self, name):
        """A simulation that exists on the server, by its name."""
        with translated():
            info = self.simulations.GetSimulation(simulations_pb2.GetSimulationRequest(name=name), metadata=self.metadata)
        return Simulation(self, info, [], "", owned=False)
