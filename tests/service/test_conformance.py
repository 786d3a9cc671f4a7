"""The conformance kit: the daemon passes it over both transports, the clients pass it, and it finds every seeded error."""
import os
import subprocess
import sys
import threading

import grpc
import pytest

import mbcosim
from conftest import BIN, Daemon
from mbcosim.v1 import simulations_pb2 as pb

KIT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance")
sys.path.insert(0, KIT)
import check_calls  # noqa: E402
import check_peer  # noqa: E402
import check_server  # noqa: E402
import check_services  # noqa: E402
import scripted_server  # noqa: E402
import wrong_peers  # noqa: E402


@pytest.mark.parametrize("transport", ["stream", "shared_memory"])
def test_the_daemon_conforms(daemon, transport):
    assert check_server.check_server(daemon.address, transport) == {}


def test_the_scripted_server_conforms(tmp_path):
    with scripted_server.ScriptedServer(f"unix:{tmp_path}/s"):
        assert check_server.check_server(f"unix:{tmp_path}/s") == {}


@pytest.mark.parametrize("fault", scripted_server.FAULTS)
def test_errors_of_servers_are_found(tmp_path, monkeypatch, fault):
    monkeypatch.setattr(check_server, "WAIT", 1.0)
    with scripted_server.ScriptedServer(f"unix:{tmp_path}/s", fault):
        found = check_server.check_server(f"unix:{tmp_path}/s", first_only=True)
    assert found, f"the kit does not notice: {fault}"


# ---------------------------------------------------------------- calls

def test_the_daemons_calls_conform(daemon):
    assert check_calls.check_calls(daemon.address) == {}


class Tampering(grpc.UnaryUnaryClientInterceptor):
    """Stands between the kit and a good server, which so looks like a wrong one."""

    def __init__(self, request=None, reply=None, instead=()):
        self._request, self._reply, self._instead = request, reply, dict(instead)

    def intercept_unary_unary(self, continuation, details, request):
        service, _, method = details.method.rpartition("/")
        if method in self._instead:
            details = details._replace(method=f"{service}/{self._instead[method]}")
        sent = type(request).FromString(request.SerializeToString())
        if self._request:
            self._request(method, sent)
        answer = continuation(details, sent)
        if self._reply and answer.code() == grpc.StatusCode.OK:
            self._reply(answer.result())
        return answer


def without(method, field):
    """Forgets a field of a request: of a creation, of its options."""
    def tamper(called, request):
        if called == method:
            (request.header.options if method == "CreateSimulationInline" else request).ClearField(field)
    return Tampering(request=tamper)


def in_options(called, request):
    if called == "ForkSimulation":
        request.options.ClearField("request_id")


FAULTS = {
    **{f"repeated {method}": without(method, "request_id") for method in check_calls.REPEATED},
    "repeated creation": without("CreateSimulationInline", "request_id"), "repeated fork": Tampering(request=in_options),
    "repeated end": without("DeleteSimulation", "request_id"), "repeated steps are done once": without("Step", "request_id"),
    **{f"wrong {field}": without(method, field.partition(".")[0]) for field, (method, _) in check_calls.WRONG.items()},
    **{f"wrong option {field}": without("CreateSimulationInline", {"offsets": "ports"}.get(field, field.partition(".")[0]))
       for field in check_calls.WRONG_OPTIONS},
    **{f"pages of {what}": without(method, "page_size") for what, method in (
        ("a description", "DescribeSimulation"), ("a linearization", "Linearize"), ("eigenvectors", "ComputeEigenvalues"), ("the list", "ListSimulations"))},
    "units": without("CreateSimulationInline", "units"), "reset": Tampering(instead={"ResetSimulation": "GetSimulation"}),
}


@pytest.mark.parametrize("check", FAULTS)
def test_a_server_that_forgets_a_field_is_found(daemon, check):
    assert check in check_calls.check_calls(daemon.address, [FAULTS[check]], [check])


@pytest.mark.parametrize("check", ["pages of a description", "pages of a linearization", "pages of eigenvectors", "pages of the list"])
def test_a_server_that_ends_its_pages_too_early_is_found(daemon, check):
    def cut(reply):
        if "next_page_token" in reply.DESCRIPTOR.fields_by_name:
            reply.next_page_token = ""

    assert check in check_calls.check_calls(daemon.address, [Tampering(reply=cut)], [check])


# ---------------------------------------------------------------- services

@pytest.fixture(scope="module")
def offering(tmp_path_factory):
    """A daemon that offers all there is, with two tokens."""
    folder = tmp_path_factory.mktemp("offering")
    for name in ("results", "states"):
        (folder / name).mkdir()
    tokens = folder / "tokens"
    tokens.write_text("ann-t control ann\nbob-t control bob\n")
    tokens.chmod(0o600)
    running = Daemon(str(folder), "--results-root", str(folder / "results"), "--state-dir", str(folder / "states"), "--tokens", str(tokens))
    yield running
    running.stop()


TOKENS = ("ann-t", "bob-t")


def test_the_daemons_services_conform(offering):
    assert check_services.check_services(offering.address, tokens=TOKENS) == ({}, [])


def test_what_a_server_does_not_offer_is_told(daemon):
    assert check_services.check_services(daemon.address) == ({}, ["results", "checkpoints", "grants"])


class Changed:
    """A stream of replies, changed on the way."""

    def __init__(self, call, change):
        self._replies, self.cancel, self.code = change(iter(call)), call.cancel, call.code

    def __iter__(self):
        return self

    def __next__(self):
        return next(self._replies)


class TamperingStreams(grpc.UnaryStreamClientInterceptor, grpc.StreamUnaryClientInterceptor):
    """The same as Tampering for a method that streams; `replies` and `requests` get an iterator and give one."""

    def __init__(self, method, replies=iter, requests=iter):
        self._method, self._replies, self._requests = method, replies, requests

    def intercept_unary_stream(self, continuation, details, request):
        if not details.method.endswith(f"/{self._method}"):
            return continuation(details, request)
        return Changed(continuation(details, next(self._requests(iter([request])))), self._replies)

    def intercept_stream_unary(self, continuation, details, request_iterator):
        return continuation(details, self._requests(request_iterator) if details.method.endswith(f"/{self._method}") else request_iterator)


def each(change):
    """`change(message)` done to every message on its way."""
    def changed(messages):
        for message in messages:
            other = type(message).FromString(message.SerializeToString())
            change(other)
            yield other
    return changed


def twice(messages):
    for message in messages:
        yield from (message, message)


class AnyName(Tampering):
    """Takes an unknown simulation for the last one that was created."""

    def __init__(self):
        super().__init__(request=self._rename, reply=self._remember)
        self._name = ""

    def _remember(self, reply):
        if isinstance(reply, pb.CreateSimulationInlineReply):
            self._name = reply.simulation.name

    def _rename(self, _, request):
        if getattr(request, "simulation", "") == "simulations/none":
            request.simulation = self._name


def unlocated(_, request):
    if isinstance(request, pb.StepRequest):
        request.until.ClearField("locate_within")


def nothing_interrupted(reply):
    if isinstance(reply, pb.InterruptReply):
        reply.was_stepping = False


SERVICE_FAULTS = {
    "lengths": without("Step", "step_size"), "exact end": without("Step", "exact"), "located": Tampering(request=unlocated),
    "inputs of a step": without("Step", "inputs"), "busy": Tampering(reply=nothing_interrupted),
    "tables": TamperingStreams("Run", each(lambda reply: reply.rows.values.__delitem__(slice(0, 1)))),
    "symbols": without("CreateSimulationInline", "symbols"),
    "geometry": TamperingStreams("DescribeGeometry", each(lambda reply: reply.nodes.nodes.__delitem__(slice(0, 1)))),
    "samples": TamperingStreams("Subscribe", each(lambda reply: reply.samples.__delitem__(slice(0, 1)))),
    "events": TamperingStreams("WatchEvents", twice),
    "results": TamperingStreams("GetResults", requests=each(lambda request: request.ClearField("offset_bytes"))),
    "checkpoints": TamperingStreams("ImportCheckpoint", requests=each(lambda request: request.header.ClearField("request_id"))),
    "grants": without("UpdateSimulation", "grants"), "unknown names": AnyName(), "versions": without("CreateSimulationInline", "protocol"),
    "forks": Tampering(instead={"ForkSimulation": "GetSimulation"}),
}


def test_every_check_of_services_has_a_fault_to_find():
    assert SERVICE_FAULTS.keys() == check_services.CHECKS.keys()


@pytest.mark.parametrize("check", SERVICE_FAULTS)
def test_services_with_a_fault_are_found(offering, check):
    found, _ = check_services.check_services(offering.address, [SERVICE_FAULTS[check]], TOKENS, [check])
    assert check in found


# ---------------------------------------------------------------- peers

def python_peer(address, simulation, port):
    """The library's peer, with a spring and a damper."""
    def loads(motion):
        return -100.0 * motion.x - 2.0 * motion.v

    with mbcosim.connect(address) as server, server.attach(simulation).couple(port, loads, mode="tight") as peer:
        peer._thread.join(20)


def test_the_python_peer_conforms():
    assert check_peer.check_peer(python_peer) == {}


def test_the_cpp_peer_conforms():
    def start(address, simulation, port):
        subprocess.run([os.path.join(BIN, "spring_peer"), address, "--join", simulation, port], timeout=30, check=True,
                       stdout=subprocess.DEVNULL)

    assert check_peer.check_peer(start) == {}


def test_a_conforming_peer_of_raw_messages(tmp_path):
    assert check_peer.check_peer(wrong_peers.peer(None)) == {}


@pytest.mark.parametrize("fault", wrong_peers.FAULTS)
def test_errors_of_peers_are_found(monkeypatch, fault):
    monkeypatch.setattr(check_peer, "WAIT", 1.0)
    assert check_peer.check_peer(wrong_peers.peer(fault)), f"the kit does not notice: {fault}"


def test_the_kit_is_a_program(daemon):
    command = [sys.executable, os.path.join(KIT, "check_server.py"), daemon.address, "--transport", "shared_memory"]
    run = subprocess.run(command, timeout=60, text=True, stdout=subprocess.PIPE)
    assert run.returncode == 0 and run.stdout.count("ok") == len(check_server.CHECKS)
    run = subprocess.run([sys.executable, os.path.join(KIT, "check_services.py"), daemon.address], timeout=120, text=True, stdout=subprocess.PIPE)
    assert run.returncode == 0 and run.stdout.count("absent") == 3
    peer = [sys.executable, os.path.join(KIT, "wrong_peers.py"), "answers twice"]
    run = subprocess.run([sys.executable, os.path.join(KIT, "check_peer.py"), *peer], timeout=60, text=True, stdout=subprocess.PIPE)
    assert run.returncode == 1 and "FAILED" in run.stdout
    assert threading.active_count() < 100
