"""A small server that speaks the coupling protocol by the letter, with masses instead of a solver; or, on purpose, with one error.

It serves what scripted peers and real clients need: create, describe, step, delete, attach. It is not fast and not complete.
"""
import concurrent.futures
import math
import queue
import threading
import time

import grpc
import numpy as np

from mbcosim.v1 import common_pb2, coupling_pb2 as pb, coupling_pb2_grpc, coupling_types_pb2 as types, simulations_pb2, simulations_pb2_grpc

VERSION = 2
PROTOCOL = common_pb2.VersionRange(lowest=VERSION, highest=VERSION)
STEP = 1e-3
ITERATIONS = 2
DIGEST = "0123456789abcdef"
SPIN = np.array([0.1, 0.2, 5.0])
IMPLICIT = (types.COUPLING_MODE_TIGHT, types.COUPLING_MODE_WINDOW)

# What a server can do wrong, one each.
FAULTS = [
    "index skips", "index from zero", "step of the future", "target time of the past", "an array too short", "matrices by columns",
    "notice in LOOSE", "no notice of acceptance", "iteration stands still", "forces are ignored", "wrong lengths are taken",
    "not a number is taken", "answers in advance are taken", "answers are taken twice", "waits for ever", "labels in another order",
    "negative quaternion", "refuses without a reason", "a second peer is let in", "first mismatch only", "heartbeats end the stream",
    "no notice of rejection", "any version is spoken", "accelerations unasked", "two exchanges at once", "rejections are ignored",
    "preference untold", "estimate untold", "lengths are ignored", "a peer ahead is let in", "a peer that goes back is refused",
    "motion of no reference node",
]


class Refused(Exception):
    def __init__(self, code, reason, text, metadata=None):
        super().__init__(text)
        self.code, self.reason, self.metadata = code, reason, metadata or {}


def turned(axis_angle):
    """Rotation matrix of a rotation vector."""
    angle = np.linalg.norm(axis_angle)
    if angle == 0:
        return np.eye(3)
    x, y, z = axis_angle / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


class Rejected(Exception):
    """By the peer: the length that it prefers, and its words."""


def time_out_of(hello):
    """Longest wait for an answer of this peer [s]."""
    presence = hello.presence
    return presence.peer_timeout.ToMilliseconds() / 1000 if presence.HasField("peer_timeout") else 10.0


class Attached:
    """The server's end of one peer."""

    def __init__(self, hello):
        self.hello = hello
        self.out, self.index, self.answered = queue.SimpleQueue(), 0, True
        self.answer, self.refusal, self.gone = None, None, False
        self.changed = threading.Condition()

    @property
    def mode(self):
        return self.hello.schedule.mode or types.COUPLING_MODE_LOOSE

    @property
    def timeout(self):
        return time_out_of(self.hello)

    def end(self, refusal=None):
        with self.changed:
            self.refusal, self.gone = refusal, True
            self.changed.notify_all()
        self.out.put(None)


class Session:
    """Two unit masses, the first of which spins, and one port on both."""

    def __init__(self, name, fault):
        self.name, self.fault = name, fault
        self.t, self.h = 0.0, STEP  # time of step k and length of the next one
        self.k, self.x, self.v, self.forces = 0, np.array([[0, 0, 0], [1, 2, 3.0]]), np.array([[0, 1, 0], [0, 0, 0.0]]), np.zeros((2, 3))
        self.peer, self.in_flight, self.lock = None, False, threading.Lock()

    def layout(self):
        labels = [2, 1] if self.fault == "labels in another order" else [1, 2]
        return types.PortLayout(name="p", kind=types.PORT_KIND_STRUCTURAL, node_labels=labels, point_labels=labels)

    # ------------------------------------------------------------ messages

    def motion(self, step, iteration=0):
        peer, fault = self.peer, self.fault
        peer.index += 2 if fault == "index skips" and peer.index else 1
        peer.answered, peer.answer = False, None
        out = pb.ServerExchange(index=peer.index - (fault == "index from zero"), step=step + (fault == "step of the future"),
                                time=self.t + (self.h if iteration else 0), target_time=self.t + self.h, iteration=iteration,
                                target_estimated=peer.mode == types.COUPLING_MODE_STAGGERED and fault != "estimate untold")
        if fault == "target time of the past":
            out.target_time = out.time
        if fault == "iteration stands still":
            out.iteration = min(iteration, 1)
        x, v = (self.x + self.h * self.v, self.v + self.h * self.forces) if iteration else (self.x, self.v)
        out.positions.extend(x.ravel()[:5 if fault == "an array too short" else 6])
        out.velocities.extend(v.ravel())
        out.angular_velocities.extend([*SPIN, 0, 0, 0])
        if fault == "accelerations unasked":
            out.accelerations.extend([0.0] * 6)
        if fault == "motion of no reference node":
            out.reference_velocity.extend([0.0] * 3)
        angle = SPIN * out.time
        if peer.hello.form.rotation_form == types.ROTATION_FORM_QUATERNION:
            half = np.linalg.norm(angle) / 2
            quaternion = np.array([math.cos(half), *(angle / 2 * np.sinc(half / math.pi))])
            out.rotations.extend([*(-quaternion if fault == "negative quaternion" else quaternion), 1, 0, 0, 0])
        else:
            R = turned(angle)
            out.rotations.extend([*(R.T if fault == "matrices by columns" else R).ravel(), *np.eye(3).ravel()])
        peer.out.put(pb.ServerMessage(exchange=out))
        if fault == "two exchanges at once":
            peer.out.put(pb.ServerMessage(exchange=out))

    def notice(self, kind):
        if self.fault != f"no notice of {'acceptance' if kind == 'accepted' else 'rejection'}":
            self.peer.out.put(pb.ServerMessage(**{kind: pb.StepNotice(step=self.k, time=self.t)}))

    def deliver(self, peer, message):
        """A message of the peer after `hello`. Raises Refused."""
        fault = self.fault
        if message.HasField("heartbeat"):
            if fault == "heartbeats end the stream":
                raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "OUT_OF_TURN", "a heartbeat")
            return
        if not message.HasField("exchange"):
            raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "OUT_OF_TURN", "only `exchange` and `heartbeat` after `hello`")
        answer, values = message.exchange, message.exchange.answer
        in_advance = (answer.index < 1 or answer.index > peer.index) and fault not in ("answers in advance are taken", "index from zero")
        twice = answer.index == peer.index and peer.answered and peer.answer is not None and fault != "answers are taken twice"
        if in_advance or twice:
            raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "OUT_OF_TURN", f"answer {answer.index} of {peer.index}")
        if answer.WhichOneof("content") is None:
            raise Refused(grpc.StatusCode.INVALID_ARGUMENT, "BAD_ARGUMENT", "`answer`, `failure` or `reject` is wanted")
        lengths = [not answer.HasField("answer") or len(values.forces) == 6, len(values.moments) in (0, 6), not values.signals]
        if not all(lengths) and fault != "wrong lengths are taken":
            raise Refused(grpc.StatusCode.INVALID_ARGUMENT, "BAD_ARGUMENT", "an array of the wrong length")
        if not all(map(math.isfinite, values.forces)) and fault != "not a number is taken":
            raise Refused(grpc.StatusCode.INVALID_ARGUMENT, "BAD_ARGUMENT", "a number that is not finite")
        with peer.changed:
            if answer.index < peer.index and fault != "answers in advance are taken":
                return  # too late
            peer.answer, peer.answered = answer, True
            peer.changed.notify_all()

    def wait(self):
        """The peer's answer; text: why there is none."""
        peer = self.peer
        with peer.changed:
            timeout = 3600 if self.fault == "waits for ever" else peer.timeout
            peer.changed.wait_for(lambda: peer.answered or peer.gone, timeout)
            if not peer.answered:
                return "the peer is gone" if peer.gone else "the peer did not answer in time"
            if peer.answer.HasField("reject") and self.fault != "rejections are ignored":
                raise Rejected(peer.answer.reject.preferred_step_size, peer.answer.reject.text)
            if peer.answer.HasField("failure"):
                return "the peer failed: " + peer.answer.failure
            forces = np.zeros(6)
            forces[:len(peer.answer.answer.forces)] = peer.answer.answer.forces[:6]
            if self.fault != "forces are ignored":
                self.forces = np.nan_to_num(forces).reshape(2, 3)
        return None

    # ------------------------------------------------------------ steps

    def step(self, length):
        """Text: why the step failed. Raises Rejected."""
        if self.peer is None or self.peer.gone:
            return "no peer"
        self.h = length
        try:
            return self._solve()
        except Rejected:
            if self.peer.mode in IMPLICIT:
                self.notice("rejected")
            raise

    def _solve(self):
        if self.peer.mode in IMPLICIT:
            for iteration in range(1, ITERATIONS + 1):
                self.motion(self.k + 1, iteration)
                why = self.wait()
                if why:
                    self.notice("rejected")
                    return why
        else:
            if not self.in_flight:
                self.motion(self.k)
            self.in_flight = False
            why = self.wait()
            if why:
                return why
        self.v = self.v + self.h * self.forces
        self.x = self.x + self.h * self.v
        self.k, self.t, self.h = self.k + 1, self.t + self.h, STEP
        if self.peer.mode in IMPLICIT or self.fault == "notice in LOOSE":
            self.notice("accepted")
        if self.peer.mode == types.COUPLING_MODE_STAGGERED:
            self.motion(self.k)
            self.in_flight = True
        return None


class ScriptedServer(simulations_pb2_grpc.SimulationsServicer, coupling_pb2_grpc.CouplingServicer):
    """Serves at `address` until closed."""

    def __init__(self, address, fault=None):
        assert fault is None or fault in FAULTS, fault
        self.fault, self.sessions, self._count = fault, {}, 0
        self._server = grpc.server(concurrent.futures.ThreadPoolExecutor(32))
        simulations_pb2_grpc.add_SimulationsServicer_to_server(self, self._server)
        coupling_pb2_grpc.add_CouplingServicer_to_server(self, self._server)
        self._server.add_insecure_port(address)
        self._server.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for session in self.sessions.values():
            if session.peer:
                session.peer.end()
        self._server.stop(0.2).wait()

    def _abort(self, context, refusal):
        status = common_pb2.ErrorStatus(code=refusal.code.value[0], message=str(refusal))
        if self.fault != "refuses without a reason":
            info = common_pb2.ErrorInfo(reason=refusal.reason, domain="mbcosim.dev", metadata=refusal.metadata)
            status.details.add(type_url="type.googleapis.com/google.rpc.ErrorInfo", value=info.SerializeToString())
        context.set_trailing_metadata((("grpc-status-details-bin", status.SerializeToString()),))
        context.abort(refusal.code, str(refusal))

    def new_session(self):
        self._count += 1
        session = Session(f"simulations/{self._count}", self.fault)
        self.sessions[session.name] = session
        return session

    # ------------------------------------------------------------ Simulations

    def _info(self, session):
        return simulations_pb2.SimulationInfo(name=session.name, model_digest=DIGEST, step=session.k, time=session.t)

    def GetServerInfo(self, request, context):
        return simulations_pb2.GetServerInfoReply(version="scripted", protocol=PROTOCOL)

    def CreateSimulation(self, requests, context):
        for _ in requests:
            pass
        return simulations_pb2.CreateSimulationReply(simulation=self._info(self.new_session()))

    def GetSimulation(self, request, context):
        return simulations_pb2.GetSimulationReply(simulation=self._info(self.sessions[request.simulation]))

    def DescribeSimulation(self, request, context):
        model = simulations_pb2.ModelDescription(ports=[self.sessions[request.simulation].layout()])
        return simulations_pb2.DescribeSimulationReply(model=model)

    def DeleteSimulation(self, request, context):
        session = self.sessions.pop(request.simulation)
        if session.peer:
            session.peer.end()
        return simulations_pb2.DeleteSimulationReply()

    def Step(self, request, context):
        session = self.sessions[request.simulation]
        reply = simulations_pb2.StepReply(outcome=simulations_pb2.STEP_OUTCOME_ACCEPTED)
        with session.lock:
            for _ in range(request.steps):
                own = request.HasField("step_size") and self.fault != "lengths are ignored"
                try:
                    why = session.step(request.step_size if own else STEP)
                except Rejected as rejected:
                    reply.outcome = simulations_pb2.STEP_OUTCOME_REJECTED_BY_PEER
                    if self.fault != "preference untold":
                        reply.preferred_step_size = rejected.args[0]
                    reply.failure.message, reply.failure.reason = rejected.args[1], common_pb2.REASON_REJECTED_BY_PEER
                    break
                if why:
                    reply.outcome = simulations_pb2.STEP_OUTCOME_PEER_LOST
                    reply.failure.message, reply.failure.reason = why, common_pb2.REASON_PEER_LOST
                    break
                reply.steps_done += 1
        reply.step, reply.time = session.k, session.t
        return reply

    # ------------------------------------------------------------ Coupling

    def _welcome(self, hello):
        lowest, highest = hello.protocol.lowest, hello.protocol.highest
        if (lowest, highest) != (0, 0) and not lowest <= VERSION <= highest and self.fault != "any version is spoken":
            raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "VERSION_MISMATCH", f"version {VERSION} is spoken")
        wrong = {}
        if hello.expected.model_digest not in ("", DIGEST):
            wrong["model_digest"] = "another model"
        if hello.expected.HasField("input_size") and hello.expected.input_size:
            wrong["input_size"] = "no signals"
        if list(hello.expected.node_labels) not in ([], [1, 2]):
            wrong["node_labels"] = "1, 2"
        if hello.form.frame == types.PORT_FRAME_REFERENCE:
            wrong["frame"] = "no reference node"
        if wrong:
            told = dict([wrong.popitem()]) if self.fault == "first mismatch only" else wrong
            raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "PORT_MISMATCH", "the handshake does not fit", told)

    def _check_step(self, expected, session):
        goes_back = expected.can_go_back and self.fault != "a peer that goes back is refused"
        if expected.step <= session.k or goes_back or self.fault == "a peer ahead is let in":
            return
        raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "PEER_AHEAD", f"the simulation stands at step {session.k}",
                      {"step": str(session.k), "peer_step": str(expected.step)})

    def _attach(self, hello):
        session = self.sessions.get(hello.simulation)
        if session is None:
            raise Refused(grpc.StatusCode.NOT_FOUND, "NO_SUCH_SIMULATION", "no such simulation")
        if hello.port != "p":
            raise Refused(grpc.StatusCode.NOT_FOUND, "NO_SUCH_PORT", "no such port")
        self._welcome(hello)
        self._check_step(hello.expected, session)
        if session.peer and not session.peer.gone and self.fault != "a second peer is let in":
            raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "PORT_TAKEN", "a peer is attached already")
        session.peer, session.in_flight = Attached(hello), False
        return session

    def Attach(self, requests, context):
        try:
            first = next(requests, pb.PeerMessage())
            if not first.HasField("hello"):
                raise Refused(grpc.StatusCode.FAILED_PRECONDITION, "OUT_OF_TURN", "the first message must be `hello`")
            session = self._attach(first.hello)
        except Refused as refusal:
            self._abort(context, refusal)
        peer = session.peer
        threading.Thread(target=self._read, args=(session, peer, requests), daemon=True).start()
        yield pb.ServerMessage(welcome=pb.Welcome(protocol=PROTOCOL, layout=session.layout(), model_digest=DIGEST, step_size=STEP,
                                                  step=session.k, time=session.t))
        while True:
            message = peer.out.get()
            if message is None:
                break
            yield message
        if peer.refusal:
            self._abort(context, peer.refusal)

    @staticmethod
    def _read(session, peer, requests):
        refusal = None
        try:
            for message in requests:
                session.deliver(peer, message)
        except Refused as raised:
            refusal = raised
        except Exception:  # the call was cancelled
            time.sleep(0)
        peer.end(refusal)
