"""Calls that are broken off at every point: uploads, steps, runs, analyses, reductions, exports and imports."""
import os
import pathlib
import sys
import tempfile
import threading
import time

import grpc

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "benchmarks"))
import reduce_scaling
from google.protobuf.duration_pb2 import Duration
from mbcosim import bundle
from mbcosim.v1 import (coupling_pb2, coupling_pb2_grpc, reduction_pb2, reduction_pb2_grpc, results_pb2, results_pb2_grpc,
                        simulations_pb2 as pb)


def reduction():
    """Messages of a reduction of 1029 unknowns."""
    shape = (6, 6, 6)
    with tempfile.TemporaryDirectory() as folder:
        reduce_scaling.write_model(pathlib.Path(folder), shape)
        job = pathlib.Path(folder, "cube.job")
        job.write_text("mass = M.mtx\nstiffness = K.mtx\nnodes = nodes.csv\ndofs = dofs.csv\n")
        main, files = bundle.collect_job(job)
    header = reduction_pb2.ReduceHeader(main_file=main, interface_nodes=reduce_scaling.corner_labels(shape), fixed_interface_modes=100)
    header.options.update({"basis": "craig-bampton", "inertia": "rigid", "expose": "interface"})
    return list(bundle.reduce_requests(header, files))


class BrokenOff:
    """Calls of one attacker, on a simulation that lives, with a port and result files."""

    def __init__(self, attacker, deck, port):
        self.attacker, self.random, self.stub = attacker, attacker.random, attacker.stub
        self.deck, self.port = deck, port
        self.results = results_pb2_grpc.ResultsStub(attacker.channel)
        self.coupling = coupling_pb2_grpc.CouplingStub(attacker.channel)
        self.reduce = reduction_pb2_grpc.ReductionStub(attacker.channel).Reduce
        self.reduction, self.checkpoint, self.name = reduction(), b"", None

    def once(self):
        self.name = self.name or self.create()
        if not self.name:
            time.sleep(0.05)
            return
        self.checkpoint = self.checkpoint or self.export()
        stop = threading.Event()
        call = self.random.choice([self.upload, self.step, self.analyse, self.carry])(stop)
        time.sleep(self.random.choice([0, 0.0005, 0.002, 0.01, 0.05]))
        call.cancel()
        if call.done() and not call.cancelled():
            self.forget(call)
        stop.set()
        self.attacker.codes["CANCELLED"] += 1
        if self.random.random() < 0.02:
            self.attacker.call(self.stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=self.name))
            self.name = None

    def create(self):
        results = results_pb2.ResultOptions(formats=[results_pb2.RESULT_FORMAT_TEXT], quota_bytes=1 << 20)
        return self.attacker.create(durability=self.random.choice([pb.DURABILITY_CHECKPOINT, pb.DURABILITY_JOURNAL]), results=results,
                                    ports=[self.port] if self.random.random() < 0.3 else [])

    def export(self):
        """The simulation as bytes, for imports."""
        try:
            request = pb.ExportCheckpointRequest(simulation=self.name)
            return b"".join(reply.data for reply in self.stub.ExportCheckpoint(request, **self.options()))
        except grpc.RpcError as error:
            self.attacker.count(error, "ExportCheckpoint")
            return b""

    def forget(self, call):
        """Deletes what was made before the call could be cancelled."""
        made = call.result() if call.code() == grpc.StatusCode.OK else None
        if hasattr(made, "simulation"):
            self.attacker.call(self.stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=made.simulation.name))

    def options(self):
        return {"metadata": self.attacker.metadata, "timeout": 5}

    def cut(self, messages, stop):
        """All of the messages, or some of them and silence."""
        count = self.random.choice([len(messages), self.random.randrange(len(messages) + 1)])

        def send():
            yield from messages[:count]
            if count < len(messages):
                stop.wait(5)

        return send()

    def upload(self, stop):
        deck = [pb.UploadRequest(header=pb.UploadHeader(bundle_main_file="deck")),
                pb.UploadRequest(chunk={"path": "deck", "data": self.deck.encode()})]
        checkpoint = [pb.ImportCheckpointRequest(header=pb.ImportCheckpointHeader()),
                      *(pb.ImportCheckpointRequest(data=self.checkpoint[at:at + 4096]) for at in range(0, len(self.checkpoint), 4096))]
        messages, function = self.random.choice([
            (deck, self.stub.CreateSimulation.future), (deck, self.stub.ValidateModel.future),
            (checkpoint, self.stub.ImportCheckpoint.future), (self.reduction, self.reduce)])
        return function(self.cut(messages, stop), **self.options())

    def step(self, _):
        many = pb.StepRequest(simulation=self.name, steps=100000)
        hello = coupling_pb2.PeerMessage(hello=coupling_pb2.Hello(simulation=self.name, port=self.port["name"]))
        function, request = self.random.choice([
            (self.stub.Step.future, many), (self.stub.Run, pb.RunRequest(step=many)),
            (self.stub.StepStream, (pb.StepRequest(simulation=self.name, steps=50) for _ in range(20))),
            (self.coupling.Attach, iter([hello]))])
        return function(request, **self.options())

    def analyse(self, _):
        function, request = self.random.choice([
            (self.stub.ComputeEigenvalues.future, pb.ComputeEigenvaluesRequest(simulation=self.name)),
            (self.stub.Linearize.future, pb.LinearizeRequest(simulation=self.name))])
        return function(request, **self.options())

    def carry(self, _):
        lease = pb.CreateOptions(lease=Duration(seconds=1))
        function, request = self.random.choice([
            (self.stub.ExportSnapshot, pb.ExportSnapshotRequest(simulation=self.name)),
            (self.stub.ExportCheckpoint, pb.ExportCheckpointRequest(simulation=self.name)),
            (self.results.GetResults, results_pb2.GetResultsRequest(simulation=self.name, file="results.mov")),
            (self.stub.ForkSimulation.future, pb.ForkSimulationRequest(simulation=self.name, options=lease))])
        return function(request, **self.options())
