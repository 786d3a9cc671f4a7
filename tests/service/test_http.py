"""The HTTP door: calls by Connect and gRPC-Web as by gRPC, and nobody else comes in."""
import base64
import email.utils
import http.client
import json
import math
import os
import re
import signal
import socket
import struct
import subprocess
import time
import urllib.parse
from concurrent import futures

import pytest
import decks
from conftest import BIN, TIME_FACTOR, counts_memory, is_sanitized, wait_for
from google.protobuf import json_format

from mbcosim.v1 import common_pb2, coupling_pb2, reduction_pb2, simulations_pb2, telemetry_pb2

SERVICES = [file.DESCRIPTOR.services_by_name[name] for file, name in (
    (simulations_pb2, "Simulations"), (telemetry_pb2, "Telemetry"), (coupling_pb2, "Coupling"), (reduction_pb2, "Reduction"))]


class Door:
    """A client of the door that speaks plain HTTP."""

    def __init__(self, page):
        address = urllib.parse.urlsplit(page)
        self.host, self.port = address.hostname, address.port
        self.token = urllib.parse.parse_qs(address.query).get("token", [""])[0]

    def request(self, method, path, body=None, **headers):
        """Status, headers and body. Header names have `_` for `-`; a header of None is left out."""
        given = {"Authorization": f"Bearer {self.token}", **{name.replace("_", "-"): value for name, value in headers.items()}}
        connection = http.client.HTTPConnection(self.host, self.port, timeout=20 * TIME_FACTOR)
        try:
            connection.request(method, path, body, {name: value for name, value in given.items() if value is not None})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def call(self, method, request=None, **headers):
        """Status and JSON of a unary call."""
        given = {"Content_Type": "application/json", **headers}
        status, _, body = self.request("POST", f"/mbcosim.v1.{method}", json.dumps(request or {}), **given)
        return status, json.loads(body)

    def stream(self, method, request, content_type="application/connect+json"):
        """Envelopes (flags, payload) of a call."""
        body = request if isinstance(request, bytes) else json.dumps(request).encode()
        status, _, answer = self.request("POST", f"/mbcosim.v1.{method}", envelope(body), Content_Type=content_type)
        assert status == 200, answer
        return envelopes(answer)

    def raw(self):
        return socket.create_connection((self.host, self.port), timeout=20 * TIME_FACTOR)


def envelope(payload, flags=0):
    return struct.pack(">BI", flags, len(payload)) + payload


def envelopes(text):
    found = []
    while text:
        flags, length = struct.unpack(">BI", text[:5])
        found.append((flags, text[5:5 + length]))
        text = text[5 + length:]
    return found


@pytest.fixture(scope="module")
def http_daemon(tmp_path_factory):
    from conftest import MODELS, Daemon
    running = Daemon(str(tmp_path_factory.mktemp("h")), "--model-root", MODELS, "--http", "127.0.0.1:0", "--limit-http-streams", "3",
                     "--limit-message-bytes", "1000000")
    yield running
    running.stop()


@pytest.fixture
def endless(pendulum):
    """Text of a deck that runs for minutes."""
    with open(pendulum) as deck:
        return deck.read().replace("final time: 5.;", "final time: 1.e6;")


def state(door, simulation):
    return door.call("Simulations/GetSimulation", {"simulation": simulation.name})[1]["simulation"]["state"]


@pytest.fixture
def door(http_daemon):
    return Door(http_daemon.page())


@pytest.fixture
def server(http_daemon):
    with http_daemon.connect() as connection:
        yield connection


# ---- calls


def test_a_step_over_json_is_the_step_over_grpc(door, server, pendulum):
    with server.load(pendulum) as ours, server.load(pendulum) as theirs:
        handle = ours.handles(["node.structural.2.X"])[0]
        expected = ours.step(10, outputs=["node.structural.2.X"])
        status, reply = door.call("Simulations/Step", {"simulation": theirs.name, "steps": 10, "outputs": [handle]})
        assert status == 200
        assert reply["outcome"] == "STEP_OUTCOME_ACCEPTED" and reply["step"] == "10"
        assert reply["time"] == expected.time and reply["outputs"] == list(expected.values["node.structural.2.X"])


def test_binary_messages_are_those_of_grpc(door, server, pendulum):
    with server.load(pendulum) as simulation:
        request = simulations_pb2.GetSimulationRequest(simulation=simulation.name)
        status, headers, body = door.request("POST", "/mbcosim.v1.Simulations/GetSimulation", request.SerializeToString(),
                                             Content_Type="application/proto")
        assert status == 200 and headers["Content-Type"] == "application/proto"
        assert simulations_pb2.GetSimulationReply.FromString(body).simulation.name == simulation.name


def test_an_infinite_number_has_a_json_form(door, server, tumbling):
    with server.load(tumbling) as simulation:
        status, info = door.call("Simulations/GetSimulation", {"simulation": simulation.name})
        assert status == 200 and float(info["simulation"]["finalTime"]) > 0
        parsed = json_format.ParseDict(info, simulations_pb2.GetSimulationReply()).simulation
        assert parsed.step == 0 and math.isfinite(parsed.time)


def test_a_run_streams_progress_and_ends_with_done(door, server, pendulum):
    with server.load(pendulum) as simulation:
        pieces = door.stream("Simulations/Run", {"step": {"simulation": simulation.name, "steps": 50}})
        assert [flags for flags, _ in pieces[-2:]] == [0, 2]
        assert json.loads(pieces[-2][1])["done"]["step"] == "50" and json.loads(pieces[-1][1]) == {}


def test_a_state_crosses_as_one_message_each_way(door, server, pendulum):
    with server.load(pendulum) as ours, server.load(pendulum) as theirs:
        ours.step(10)
        pieces = door.stream("Simulations/ExportSnapshot", {"simulation": ours.name})
        state = b"".join(base64.b64decode(json.loads(piece)["data"]) for flags, piece in pieces if flags == 0)
        request = {"simulation": theirs.name, "restore": True, "requestId": "import", "data": base64.b64encode(state).decode()}
        for _ in range(2):  # the second time it is the reply of the first
            status, reply = door.call("Simulations/ImportSnapshotInline", request)
            assert status == 200 and reply["snapshot"]["step"] == "10"
        assert len(theirs.snapshots()) == 1
        assert list(theirs["node.structural.2.X"]) == list(ours["node.structural.2.X"])
        request.update(requestId="", data=base64.b64encode(state[:-1]).decode())
        status, error = door.call("Simulations/ImportSnapshotInline", request)
        assert error["details"][0]["debug"]["reason"] == "DAMAGED_STATE"


def test_the_error_of_a_stream_stands_in_its_last_envelope(door):
    pieces = door.stream("Telemetry/Subscribe", {"simulation": "simulations/none"})
    assert [flags for flags, _ in pieces] == [2]
    assert json.loads(pieces[0][1])["error"]["code"] == "not_found"


def test_grpc_web_carries_messages_and_trailers(door, server, pendulum):
    with server.load(pendulum) as simulation:
        request = simulations_pb2.StepRequest(simulation=simulation.name, steps=3).SerializeToString()
        (flags, reply), (last, trailers) = door.stream("Simulations/Step", request, "application/grpc-web+proto")
        assert flags == 0 and simulations_pb2.StepReply.FromString(reply).step == 3
        assert last == 0x80 and trailers == b"grpc-status: 0\r\n"


def test_grpc_web_as_text_is_base64(door, server, pendulum):
    with server.load(pendulum) as simulation:
        request = simulations_pb2.RunRequest(step=simulations_pb2.StepRequest(simulation=simulation.name, steps=3))
        status, _, answer = door.request("POST", "/mbcosim.v1.Simulations/Run", base64.b64encode(envelope(request.SerializeToString())),
                                         Content_Type="application/grpc-web-text")
        assert status == 200
        text = answer.decode()  # pieces, each padded for itself
        pieces = [base64.b64decode(part + "=" * (-len(part) % 4)) for part in text.replace("=", " ").split()]
        parts = envelopes(b"".join(pieces))
        assert simulations_pb2.RunReply.FromString(parts[-2][1]).done.step == 3 and parts[-1][0] == 0x80


def test_grpc_web_tells_failures_in_trailers_with_details(door):
    request = simulations_pb2.StepRequest(simulation="simulations/none").SerializeToString()
    ((flags, trailers),) = door.stream("Simulations/Step", request, "application/grpc-web+proto")
    fields = dict(line.split(": ", 1) for line in trailers.decode().strip().split("\r\n"))
    assert flags == 0x80 and fields["grpc-status"] == "5"
    details = common_pb2.ErrorStatus.FromString(base64.b64decode(fields["grpc-status-details-bin"]))
    assert common_pb2.ErrorInfo.FromString(details.details[0].value).reason == "NO_SUCH_SIMULATION"


def test_errors_tell_code_reason_and_particulars(door, server, pendulum):
    with server.load(pendulum) as simulation:
        status, error = door.call("Simulations/Step", {"simulation": simulation.name, "expectedStep": 7})
        assert status == 400 and error["code"] == "failed_precondition"
        assert error["details"][0]["type"] == "google.rpc.ErrorInfo"
        assert error["details"][0]["debug"] == {"reason": "WRONG_STEP", "domain": "mbcosim.dev", "metadata": {"step": "0"}}


@pytest.mark.parametrize("service", SERVICES, ids=lambda service: service.name)
def test_every_method_is_reached_or_says_that_it_takes_a_stream(door, service):
    from google.protobuf import descriptor_pb2
    kinds = descriptor_pb2.FileDescriptorProto.FromString(service.file.serialized_pb).service
    methods = next(found for found in kinds if found.name == service.name).method
    assert methods
    for method in methods:
        name = f"{service.name}/{method.name}"
        if method.client_streaming:
            status, error = door.call(name)
            assert (status, error["code"]) == (501, "unimplemented"), name
            assert "stream of requests" in error["message"]
        elif method.server_streaming:
            last = json.loads(door.stream(name, {})[-1][1])
            assert last.get("error", {}).get("code") in (None, "not_found", "invalid_argument"), (name, last)
        else:
            status, reply = door.call(name)
            assert status == 200 or reply["code"] in ("not_found", "invalid_argument"), (name, reply)


@pytest.mark.parametrize("header, content_type, wrong, right", [
    ("Connect_Timeout_Ms", "application/json", ["-1", "soon", "", "5m", "1.5", "1e3", "99999999999"], ["20000", "9999999999"]),
    ("Grpc_Timeout", "application/grpc-web+proto", ["-1S", "20", "S", "", "20s", "20SS", "999999999n"], ["20S", "20000m", "99999999H", "99999999M"])])
def test_times_of_calls_are_read_as_the_protocols_write_them(door, header, content_type, wrong, right):
    body = b"{}" if content_type.endswith("json") else envelope(b"")
    for value in wrong:
        _, headers, answer = door.request("POST", "/mbcosim.v1.Simulations/GetServerInfo", body, Content_Type=content_type, **{header: value})
        said = answer.decode("utf-8", "replace") + str(headers)
        assert f"{header.lower().replace('_', '-')} is no time" in said.lower(), (value, said)
    for value in right:
        status, headers, answer = door.request("POST", "/mbcosim.v1.Simulations/GetServerInfo", body, Content_Type=content_type, **{header: value})
        assert status == 200 and (b'"protocol"' in answer or b"grpc-status:0" in answer.replace(b" ", b"").lower()), (value, answer)


def test_a_deadline_of_the_client_holds(door, server, endless):
    with server.load_text(endless) as simulation:
        started = time.monotonic()
        status, reply = door.call("Simulations/Step", {"simulation": simulation.name, "steps": 100000000}, Connect_Timeout_Ms="200")
        assert time.monotonic() - started < 10 * TIME_FACTOR
        assert (status, reply.get("code")) == (504, "deadline_exceeded")
        wait_for(lambda: state(door, simulation) == "SIMULATION_STATE_READY")


# ---- what is refused


@pytest.mark.parametrize("body, complaint", [
    ("{", "the body is no mbcosim.v1.StepRequest"),
    ('{"simulatoin": "x"}', "simulatoin"),
    ('{"simulation": 7, "steps": "many"}', "many"),
    ("[]", "the body is no mbcosim.v1.StepRequest"),
])
def test_json_that_is_not_the_message_is_refused_by_name(door, body, complaint):
    status, _, answer = door.request("POST", "/mbcosim.v1.Simulations/Step", body, Content_Type="application/json")
    error = json.loads(answer)
    assert (status, error["code"]) == (400, "invalid_argument") and complaint in error["message"]


@pytest.mark.parametrize("body", [b"", b"\0\0\0", envelope(b"{}") * 2, struct.pack(">BI", 0, 1 << 31) + b"x"])
def test_envelopes_that_are_none_are_refused(door, body):
    status, _, answer = door.request("POST", "/mbcosim.v1.Simulations/Run", body, Content_Type="application/connect+json")
    ((flags, end),) = envelopes(answer)
    assert status == 200 and flags == 2 and json.loads(end)["error"]["code"] == "invalid_argument"


def test_compressed_messages_are_refused(door):
    status, error = door.call("Simulations/ListSimulations", Content_Encoding="gzip")
    assert (status, error["code"]) == (501, "unimplemented")


def test_other_content_types_are_told_which_there_are(door):
    for method, kind in (("ListSimulations", "text/plain"), ("ListSimulations", "application/connect+json"), ("Run", "application/json")):
        status, headers, _ = door.request("POST", f"/mbcosim.v1.Simulations/{method}", "{}", Content_Type=kind)
        assert status == 415 and "application/json" in headers["Accept-Post"]


def test_a_body_over_the_limit_is_refused_with_its_name(door):
    status, error = door.call("Simulations/ListSimulations", {"pageToken": "x" * 1_000_001})
    assert (status, error["code"]) == (429, "resource_exhausted")
    assert error["details"][0]["debug"]["metadata"] == {"limit": "message_bytes", "maximum": "1000000"}


@pytest.mark.parametrize("token, status", [(True, b"429"), (False, b"401")], ids=["too_long", "no_token"])
def test_who_still_sends_a_refused_body_gets_the_answer(door, token, status):
    body = b"x" * 5_000_000
    head = f"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nContent-Type: application/json\r\n"
    head += (f"Authorization: Bearer {door.token}\r\n" if token else "") + f"Content-Length: {len(body)}\r\n\r\n"
    with door.raw() as link:
        link.sendall(head.encode() + body[:1000])
        time.sleep(0.3)  # the answer is there, and the connection was closed if nobody reads on
        for start in range(1000, len(body), 1_000_000):
            link.sendall(body[start:start + 1_000_000])
            time.sleep(0.05)
        answer = link.makefile("rb").read()  # to the end of the connection, which is no reset
    assert answer.startswith(b"HTTP/1.1 " + status) and b"Connection: close" in answer


def field(number, content):
    """Of bytes, as protobuf writes it."""
    length, digits = len(content), b""
    while length > 127:
        digits, length = digits + bytes([length & 127 | 128]), length >> 7
    return bytes([number << 3 | 2]) + digits + bytes([length]) + content


@counts_memory
@pytest.mark.parametrize("kind, body", [
    ("application/proto", field(1, field(3, b"\x32\x00" * (15 << 19)))),
    ("application/json", b'{"header":{"options":{"ports":[' + b"{}," * (5 << 20) + b"{}]}}}")], ids=["binary", "json"])
def test_a_body_that_would_take_much_memory_is_refused_before_it_does(start_daemon, kind, body):
    """15 MB of empty ports, which would be gigabytes of messages."""
    daemon = start_daemon("--http", "127.0.0.1:0", "--limit-memory", "200M")
    door = Door(daemon.page())
    status, _, answer = door.request("POST", "/mbcosim.v1.Simulations/CreateSimulationInline", body, Content_Type=kind)
    error = json.loads(answer)
    assert (status, error["code"]) == (429, "resource_exhausted")
    assert error["details"][0]["debug"]["metadata"]["limit"].endswith("memory_bytes")
    with open(f"/proc/{daemon.process.pid}/status") as file:
        peak = int(next(line for line in file if line.startswith("VmHWM")).split()[1]) << 10
    assert peak < 500 << 20
    assert door.call("Simulations/ListSimulations")[0] == 200


@pytest.mark.parametrize("path", ["/mbcosim.v1.Simulations/Nothing", "/mbcosim.v1.Nothing/Step", "/grpc.health.v1.Health/Check", "/etc/passwd",
                                  "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/mbcosim.v1./", "/mbcosim.v1.Simulations/", "//etc"])
def test_other_paths_lead_nowhere(door, path):
    assert door.request("POST", path, "{}", Content_Type="application/json")[0] in (400, 404)
    assert door.request("GET", path)[0] in (400, 404, 405)


def test_calls_are_not_made_by_get(door):
    assert door.request("GET", "/mbcosim.v1.Simulations/ListSimulations")[0] == 405


# ---- who comes in


def test_no_token_and_a_wrong_one_are_refused(door):
    for authorization in (None, "Bearer wrong", "Basic abc", "Bearer " + door.token[:-1]):
        status, error = door.call("Simulations/ListSimulations", Authorization=authorization)
        assert (status, error["code"]) == (401, "unauthenticated")
        assert door.request("GET", "/metrics", Authorization=authorization)[0] == 401


def test_the_token_in_the_address_becomes_a_cookie_once(door):
    status, headers, _ = door.request("GET", f"/?token={door.token}", Authorization=None)
    assert status == 303 and headers["Location"] == "./"
    cookie, *attributes = headers["Set-Cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict"} <= set(attributes)
    assert door.call("Simulations/ListSimulations", Authorization=None, Cookie=f"a=b; {cookie}; c=d")[0] == 200
    assert door.request("GET", "/?token=wrong", Authorization=None)[0] == 401


@pytest.mark.parametrize("origin", ["https://evil.example", "http://127.0.0.1:1", "http://localhost", "null"])
def test_a_foreign_web_site_cannot_call(door, origin):
    status, error = door.call("Simulations/ListSimulations", Origin=origin)
    assert status == 403 and origin in error["message"]


def test_a_name_that_a_foreign_site_gave_this_host_is_refused(door):
    assert door.call("Simulations/ListSimulations", Host=f"evil.example:{door.port}")[0] == 403


def test_the_own_page_may_call_by_each_name_of_this_host(door):
    for name in ("127.0.0.1", "localhost", "[::1]"):
        status, _ = door.call("Simulations/ListSimulations", Host=f"{name}:{door.port}", Origin=f"http://{name}:{door.port}")
        assert status == 200


def test_tokens_and_roles_are_those_of_grpc(start_daemon, tmp_path):
    tokens = tmp_path / "tokens"
    tokens.write_text("eye observe watcher\nhand control driver\nold control late 1\n")
    door = Door(start_daemon("--tokens", str(tokens), "--http", "127.0.0.1:0").page())
    assert door.token == ""  # none is printed where there are others

    def call(method, token):
        status, reply = door.call(f"Simulations/{method}", Authorization=f"Bearer {token}")
        return status, reply.get("code")

    assert door.call("Simulations/GetServerInfo", Authorization="Bearer eye")[1]["identity"] == "token:watcher"
    assert call("Step", "eye") == (403, "permission_denied")
    assert call("Step", "hand") == (404, "not_found")
    assert call("ListSimulations", "old") == (401, "unauthenticated")
    assert call("ListSimulations", "") == (401, "unauthenticated")


def test_a_proxy_in_front_is_named_by_its_origin(start_daemon):
    door = Door(start_daemon("--http", "127.0.0.1:0", *[word for origin in ("https://sim.example", "https://Own.example:443", "http://own.example:80")
                                                                for word in ("--http-origin", origin)]).page())
    assert door.call("Simulations/ListSimulations", Host="sim.example", Origin="https://sim.example")[0] == 200
    assert door.call("Simulations/ListSimulations", Host="sim.example", Origin="http://sim.example")[0] == 403
    for origin in ("https://own.example", "http://own.example"):  # browsers name no port that goes without saying
        assert door.call("Simulations/ListSimulations", Host="own.example", Origin=origin)[0] == 200


@pytest.mark.parametrize("options, complaint", [
    (["--http", "0.0.0.0:0"], "an address other than loopback needs --insecure"),
    (["--http", "8080"], '--http: expected HOST:PORT with a port from 0 to 65535, got "8080"'),
    (["--metrics", "127.0.0.1:65536"], '--metrics: expected HOST:PORT with a port from 0 to 65535, got "127.0.0.1:65536"'),
    (["--listen", "127.0.0.1:999999"], '--listen: expected unix:PATH or HOST:PORT with a port from 0 to 65535, got "127.0.0.1:999999"'),
    (["--listen", "localhost:"], 'from 0 to 65535, got "localhost:"'),
    (["--listen", "unix:"], 'from 0 to 65535, got "unix:"'),
    *[(["--listen", f"unix:/tmp/s{between}127.0.0.1:0"], "several addresses in one") for between in (" ", ",", ", ")],
    (["--listen", "unix:/tmp/s unix:/tmp/t"], "several addresses in one"),
    (["--http-origin", "https://sim.example"], "--http-origin requires --http"),
    (["--http", "[::1]:0"], '--http: HTTP is served at addresses of IPv4 only, got "[::1]:0"'),
    (["--limit-http-connections", "100000"], "--limit-http-connections: expected a number from 1 to 10000"),
    *[(["--http", "127.0.0.1:0", "--http-origin", origin], f'--http-origin "{origin}" is not of the form https://HOST')
      for origin in ("sim.example", "https://", "https://:443", "ftp://sim.example", "https://sim.example/mb")],
])
def test_bad_options_are_refused_at_start(options, complaint, tmp_path):
    done = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{tmp_path}/s", *options], capture_output=True, text=True,
                          timeout=20 * TIME_FACTOR)
    assert done.returncode == 4 and complaint in done.stderr


# ---- metrics and health


def test_metrics_need_the_token_and_health_does_not(door):
    status, headers, body = door.request("GET", "/metrics")
    assert status == 200 and headers["Content-Type"].startswith("text/plain") and b"mbcosim_steps_total" in body
    assert door.request("GET", "/healthz", Authorization=None)[2] == b"ok\n"
    assert door.request("GET", "/readyz", Authorization=None)[2] == b"ready\n"


# ---- hostile clients


def open_stream(door, simulation, handles=()):
    """A socket on which telemetry of `simulation` comes, after its first message."""
    link = door.raw()
    body = envelope(json.dumps({"simulation": simulation, "handles": list(handles)}).encode())
    link.sendall(f"POST /mbcosim.v1.Telemetry/Subscribe HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
                 f"Content-Type: application/connect+json\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body)
    answer = b""
    while b'"every"' not in answer and b'"error"' not in answer:
        answer += link.recv(65536)
    return link, answer


def test_a_reader_that_stands_still_does_not_hold_up_the_end(start_daemon, pendulum):
    daemon = start_daemon("--http", "127.0.0.1:0")
    door = Door(daemon.page())
    with daemon.connect() as server:
        simulation = server.load(pendulum)
        handle = simulation.handles(["node.structural.2.X"])[0]
        link, answer = open_stream(door, simulation.name, [handle] * 5000)
        assert b" 200 " in answer
        simulation.step(300)
        daemon.process.send_signal(signal.SIGTERM)
        assert daemon.process.wait(20 * TIME_FACTOR) == 0
        link.close()


def test_streams_of_an_identity_are_capped_and_a_closed_one_makes_room(door, server, pendulum):
    with server.load(pendulum) as simulation:
        links = [open_stream(door, simulation.name) for _ in range(3)]
        assert all(b" 200 " in answer and b"\r\nX-Accel-Buffering: no\r\n" in answer for _, answer in links)
        end = json.loads(door.stream("Telemetry/Subscribe", {"simulation": simulation.name})[-1][1])
        assert end["error"]["code"] == "resource_exhausted"
        links[0][0].close()
        started = time.monotonic()

        def another():
            link, answer = open_stream(door, simulation.name)
            if b"resource_exhausted" in answer:
                link.close()
                return False
            links.append((link, answer))
            return True

        simulation.step(1)  # so that each open stream has something to say
        wait_for(lambda: simulation.step(1) and another())
        assert time.monotonic() - started < 10 * TIME_FACTOR
        for link, _ in links:
            link.close()


def test_a_reader_that_stops_reading_holds_neither_steps_nor_memory(http_daemon, door, server, endless):
    def resident():
        with open(f"/proc/{http_daemon.process.pid}/status") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmRSS:")) >> 10

    with server.load_text(endless) as simulation:
        before = resident()
        link, _ = open_stream(door, simulation.name, [variable.handle for variable in simulation.variables.values()])
        assert simulation.step(50_000).reply.step == 50_000  # some 25 MB of samples, which nobody takes
        assert simulation.step(50_000).reply.step == 100_000
        kept = 450 if is_sanitized() else 150  # a sanitizer keeps 256 MB of what was freed, and space around it
        assert resident() - before < kept
        link.close()


def test_slow_senders_disturb_nobody_and_are_cut_off(door, server, pendulum):
    head = f"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nHost: {door.host}:{door.port}\r\n".encode()
    slow = []
    for _ in range(40):
        link = door.raw()
        link.sendall(head)
        slow.append(link)
    started = time.monotonic()
    with server.load(pendulum) as simulation:
        assert simulation.step(100).reply.step == 100
        assert door.call("Simulations/GetSimulation", {"simulation": simulation.name})[0] == 200
    assert time.monotonic() - started < 5 * TIME_FACTOR

    def cut_off(link):
        try:
            link.sendall(b"X")
            link.setblocking(False)
            return link.recv(1000) is not None
        except BlockingIOError:
            return False
        except OSError:
            return True

    wait_for(lambda: all(cut_off(link) for link in slow), 20)
    for link in slow:
        link.close()


def test_more_slow_senders_than_connections_delay_http_by_tenths_of_a_second_and_grpc_not_at_all(door, server, pendulum):
    """64 are served at once. Those who send no head make room for who waits; a stream that says nothing for a while is none of them."""
    with server.load(pendulum) as simulation, server.load(pendulum) as other:
        quiet, _ = open_stream(door, simulation.name, simulation.handles(["node.structural.2.X"]))
        slow = [door.raw() for _ in range(150)]
        for link in slow:
            link.sendall(b"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\n")
        started = time.monotonic()
        for _ in range(20):
            other.step(10)
        assert time.monotonic() - started < 2 * TIME_FACTOR
        started = time.monotonic()
        for _ in range(20):
            assert door.call("Simulations/GetSimulation", {"simulation": simulation.name})[0] == 200
        assert time.monotonic() - started < 2 * TIME_FACTOR
        for link in slow:
            link.close()
        simulation.step(1)
        said = b""
        while b'"step":"1"' not in said:
            piece = quiet.recv(65536)
            assert piece, said
            said += piece
        quiet.close()


@pytest.mark.parametrize("token", [True, False])
def test_bodies_that_never_come_delay_others_by_tenths_of_a_second(start_daemon, token):
    """With a token, half of the connections; without, any number: their requests are refused, and what is left of them is not waited for."""
    door = Door(start_daemon("--http", "127.0.0.1:0", "--limit-http-connections", "8", "--limit-message-bytes", "2000000").page())
    head = (f"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nContent-Type: application/json\r\n"
            f"Content-Length: 1000000\r\n" + (f"Authorization: Bearer {door.token}\r\n" if token else "") + "\r\n{").encode()
    slow = [door.raw() for _ in range(24)]
    for link in slow:
        link.sendall(head)
    started = time.monotonic()
    for _ in range(3):
        assert door.request("GET", "/healthz")[0] == 200
    assert time.monotonic() - started < 3 * TIME_FACTOR
    for link in slow:
        link.close()


def test_a_body_that_comes_in_time_is_read_while_others_wait(start_daemon):
    door = Door(start_daemon("--http", "127.0.0.1:0", "--limit-http-connections", "4", "--limit-message-bytes", "8000000").page())
    body = json.dumps({"simulation": 6_000_000 * "x"}).encode()
    link = door.raw()
    link.sendall(f"POST /mbcosim.v1.Simulations/GetSimulation HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nContent-Type: application/json\r\n"
                 f"Content-Length: {len(body)}\r\nAuthorization: Bearer {door.token}\r\n\r\n".encode())
    idle = [door.raw() for _ in range(20)]
    for first in range(0, len(body), 200_000):
        link.sendall(body[first:first + 200_000])
        time.sleep(0.05)
    assert link.recv(65536).startswith(b"HTTP/1.1 404")
    for each in [link, *idle]:
        each.close()


@pytest.mark.parametrize("name", ["traceparent", "tracestate", "mbcosim-session"])
def test_headers_that_no_call_can_carry_are_refused(door, name):
    """gRPC aborts the process that gives it such metadata."""
    body = b"{}"
    for value in (b"\xff", "simulations/\u00e9".encode()):
        link = door.raw()
        link.sendall(f"POST /mbcosim.v1.Simulations/ListSimulations HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nConnection: close\r\n"
                     f"Content-Type: application/json\r\nAuthorization: Bearer {door.token}\r\nContent-Length: {len(body)}\r\n{name}: ".encode()
                     + value + b"\r\n\r\n" + body)
        answer = all_of(link)
        assert answer.startswith(b"HTTP/1.1 400") and f"the header {name} has bytes other than printable ASCII".encode() in answer, answer
        link.close()
    assert door.call("Simulations/ListSimulations")[0] == 200


def head_of(door, method, path, body=b""):
    return (f"{method} {path} HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n").encode()


def test_who_pauses_gets_whole_answers_and_is_heard_to_the_end(door):
    """The library under the door gives up after some seconds, and would then send the next answer as if the first were whole."""
    reader, writer = socket.socket(), door.raw()
    reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    reader.settimeout(20 * TIME_FACTOR)
    reader.connect((door.host, door.port))
    reader.sendall(3 * head_of(door, "GET", "/"))
    body = b'{"simulation": "simulations/none"}'
    writer.sendall(head_of(door, "POST", "/mbcosim.v1.Simulations/GetSimulation", body) + body[:5])
    time.sleep(8)
    writer.sendall(body[5:])
    assert writer.recv(65536).startswith(b"HTTP/1.1 404")
    page = door.request("GET", "/")[2]
    with reader.makefile("rb") as answers:
        for _ in range(3):
            assert answers.readline() == b"HTTP/1.1 200 OK\r\n"
            while answers.readline() != b"\r\n":
                pass
            assert answers.read(len(page)) == page
    for link in (reader, writer):
        link.close()


def test_readers_that_stand_still_delay_others_by_tenths_of_a_second(start_daemon):
    """Who asks for a page needs no token. Requests that wait behind the first one make nobody busy."""
    door = Door(start_daemon("--http", "127.0.0.1:0", "--limit-http-connections", "8").page())
    standing = []
    for _ in range(24):
        link = socket.socket()
        link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        link.connect((door.host, door.port))
        link.sendall(500 * head_of(door, "GET", "/"))
        standing.append(link)
    started = time.monotonic()
    for _ in range(3):
        assert door.request("GET", "/healthz")[0] == 200
    assert time.monotonic() - started < 3 * TIME_FACTOR
    for link in standing:
        link.close()


def test_as_many_slow_senders_as_connections_may_take_their_time_while_nobody_waits(start_daemon):
    door = Door(start_daemon("--http", "127.0.0.1:0", "--limit-http-connections", "8").page())
    slow = [door.raw() for _ in range(8)]
    for link in slow:
        link.sendall(b"GET /healthz HTTP/1.1\r\n")
    time.sleep(0.7)
    for link in slow:
        link.sendall(f"Host: {door.host}:{door.port}\r\n\r\n".encode())
        assert link.recv(65536).startswith(b"HTTP/1.1 200")
        link.close()


def test_calls_of_one_identity_leave_places_for_others(start_daemon):
    daemon = start_daemon("--http", "127.0.0.1:0", "--limit-http-connections", "8")
    door = Door(daemon.page())
    with daemon.connect() as server, futures.ThreadPoolExecutor() as pool:
        slow = [server.load_text(decks.body(), pace=1e-9) for _ in range(4)]
        calls = [pool.submit(door.call, "Simulations/Step", {"simulation": simulation.name, "steps": 2}) for simulation in slow]
        wait_for(lambda: all(simulation.refresh().state == simulations_pb2.SIMULATION_STATE_STEPPING for simulation in slow))
        status, answer = door.call("Simulations/GetServerInfo")
        assert (status, answer["code"]) == (429, "resource_exhausted") and "wait for some" in answer["message"]
        assert door.request("GET", "/healthz")[0] == 200
        for simulation in slow:
            simulation.interrupt()
        assert [call.result()[0] for call in calls] == 4 * [200]


def test_a_body_that_dribbles_without_a_token_is_cut_off(door):
    link = door.raw()
    link.sendall(f"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nContent-Type: application/json\r\n"
                 "Content-Length: 100000\r\n\r\n{".encode())
    assert b" 401 " in link.recv(65536)
    ended = time.monotonic() + 15 * TIME_FACTOR
    with pytest.raises(OSError):
        while time.monotonic() < ended:
            link.sendall(b" ")
            time.sleep(0.1)
    link.close()


@pytest.mark.parametrize("garbage", [b"\0" * 2000, b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"POST / HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
                                     b"A" * 100000, b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 5000 + b"\r\n",
                                     b"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n" * 3])
def test_garbage_is_answered_or_dropped_and_the_next_caller_served(door, garbage):
    link = door.raw()
    try:
        link.sendall(garbage)
        link.shutdown(socket.SHUT_WR)
        while link.recv(65536):
            pass
    except OSError:
        pass
    link.close()
    assert door.call("Simulations/ListSimulations")[0] == 200


def all_of(link):
    """What comes until the other side closes, or says nothing more."""
    link.settimeout(2 * TIME_FACTOR)
    data = b""
    try:
        while more := link.recv(65536):
            data += more
    except OSError:
        pass
    link.close()
    return data


def test_pipelined_requests_are_answered_in_their_order(door):
    link = door.raw()
    paths = ["healthz", "readyz", "nothing", "healthz"]
    requests = [f"GET /{path} HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n" for path in paths]
    link.sendall("\r\n".join([*requests[:-1], requests[-1] + "Connection: close\r\n", ""]).encode())
    answers = all_of(link).split(b"HTTP/1.1 ")[1:]
    assert [answer[:3] for answer in answers] == [b"200", b"200", b"404", b"200"]
    assert answers[0].endswith(b"ok\n") and answers[1].endswith(b"ready\n")


@pytest.mark.parametrize("version, wish, kept", [
    ("1.1", None, True), ("1.1", "close", False), ("1.1", "Keep-Alive", True), ("1.1", "TE, keep-alive", True), ("1.1", "upgrade, keep-alive", False),
    ("1.0", None, False), ("1.0", "keep-alive", True), ("1.0", "close", False)])
def test_a_connection_is_kept_as_the_answer_says(door, version, wish, kept):
    link = door.raw()
    request = f"GET /healthz HTTP/{version}\r\nHost: {door.host}:{door.port}\r\n" + (f"Connection: {wish}\r\n" if wish else "") + "\r\n"
    link.sendall(request.encode())
    head, body = link.recv(65536).split(b"\r\n\r\n")
    assert body == b"ok\n" and f"Connection: {'keep-alive' if kept else 'close'}".encode() in head.split(b"\r\n")
    if kept:
        link.sendall(request.encode())
        assert link.recv(65536).endswith(b"ok\n")
        link.close()
    else:
        assert all_of(link) == b""


def test_answers_come_in_one_piece(door, server, pendulum):
    """Who waits for one is woken once."""
    with server.load(pendulum) as simulation:
        body = json.dumps({"simulation": simulation.name, "steps": 1})
        request = (f"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
                   f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n{body}").encode()
        link = door.raw()
        for step in range(1, 21):
            link.sendall(request)
            head, answer = link.recv(65536).split(b"\r\n\r\n")
            assert f"Content-Length: {len(answer)}".encode() in head.split(b"\r\n")
            assert json.loads(answer)["step"] == str(step)
        link.close()


@pytest.mark.parametrize("request_line, status", [(b"GET /healthz HTTP/1.1", b"200"), (b"GET /healthz HTTP/9.9", b"505"), (b"GET nothing HTTP/1.1", b"400")])
def test_answers_are_dated_whether_ours_or_the_library_s(door, request_line, status):
    link = door.raw()
    link.sendall(request_line + f"\r\nHost: {door.host}:{door.port}\r\nConnection: close\r\n\r\n".encode())
    head, body = all_of(link).split(b"\r\n\r\n", 1)
    dates = [line[6:].decode() for line in head.split(b"\r\n") if line.startswith(b"Date: ")]
    assert head.split()[1] == status and body.endswith(b"\n") and len(dates) == 1
    assert abs(email.utils.parsedate_to_datetime(dates[0]).timestamp() - time.time()) < 2 + TIME_FACTOR


@pytest.mark.parametrize("behind", [b"\0\xff" * 500, b"{}{}{}\r\n\r\n", b"GET /healthz HTTP/1.1\r\n", b"\r\n" * 1000])
def test_garbage_behind_a_good_request_is_no_call(door, server, pendulum, behind):
    """A call of a body with more behind it than its length says: the rest is a request of its own, and a bad one."""
    with server.load(pendulum) as simulation:
        body = json.dumps({"simulation": simulation.name, "steps": 1}).encode()
        head = (f"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
                f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n").encode()
        link = door.raw()
        link.sendall(head + body + behind)
        link.shutdown(socket.SHUT_WR)
        assert all_of(link).startswith(b"HTTP/1.1 200")
        simulation.refresh()
        assert simulation.info.step == 1
    assert door.call("Simulations/ListSimulations")[0] == 200


@pytest.mark.parametrize("framing", ["Content-Length: 2\r\nTransfer-Encoding: chunked", "Content-Length: 2\r\nContent-Length: 400",
                                     "Transfer-Encoding: chunked, identity", "Content-Length: 2, 400"])
def test_a_request_with_two_lengths_smuggles_no_other(door, server, pendulum, framing):
    """The call that stands in the body of the first one is without a token, and is not made with the first one's."""
    with server.load(pendulum) as simulation:
        body = json.dumps({"simulation": simulation.name, "steps": 1})
        inner = (f"POST /mbcosim.v1.Simulations/Step HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nContent-Type: application/json\r\n"
                 f"Content-Length: {len(body)}\r\n\r\n{body}")
        link = door.raw()
        link.sendall((f"POST /mbcosim.v1.Simulations/GetServerInfo HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
                      f"Content-Type: application/json\r\n{framing}\r\n\r\n{{}}{inner}").encode())
        link.shutdown(socket.SHUT_WR)
        all_of(link)
        simulation.refresh()
        assert simulation.info.step == 0
    assert door.call("Simulations/ListSimulations")[0] == 200


@pytest.mark.parametrize("head, told", [
    ("Content-Length: 2\r\nTransfer-Encoding: chunked", "exclude each other"), ("Content-Length: 2\r\nContent-Length: 2", "told twice"),
    ("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked", "told twice"), ("Transfer-Encoding: gzip", "Bad request"), ("Transfer-Encoding: identity", "is chunked"),
    ("Content-Length: 2, 2", "no number"), ("Content-Length: +2", "no number"), ("Content-Length: 2x", "no number"),
    ("Content-Length: 2\r\nHost: another", "named twice")])
def test_what_a_proxy_may_read_otherwise_is_refused(door, head, told):
    link = door.raw()
    link.sendall((f"POST /mbcosim.v1.Simulations/GetServerInfo HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
                  f"Content-Type: application/json\r\n{head}\r\n\r\n{{}}").encode())
    link.shutdown(socket.SHUT_WR)
    answer = all_of(link)
    assert answer.startswith(b"HTTP/1.1 400 ") and b"\r\nConnection: close\r\n" in answer and told.encode() in answer, answer


def test_a_body_that_waits_for_leave_is_asked_for(door):
    """And not where the call is refused without it (RFC 9110, 10.1.1)."""
    link = door.raw()
    head = (f"POST /mbcosim.v1.Simulations/GetServerInfo HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nContent-Type: application/json\r\n"
            f"Content-Length: 2\r\nExpect: 100-continue\r\n")
    link.sendall((head + f"Authorization: Bearer {door.token}\r\n\r\n").encode())
    assert link.recv(65536) == b"HTTP/1.1 100 Continue\r\n\r\n"
    link.sendall(b"{}")
    assert link.recv(65536).startswith(b"HTTP/1.1 200 ")
    link.sendall((head + "\r\n").encode())
    assert all_of(link).startswith(b"HTTP/1.1 401 ")


def test_a_stream_over_http_1_0_ends_with_its_connection(door, server, pendulum):
    with server.load(pendulum) as simulation:
        body = envelope(json.dumps({"step": {"simulation": simulation.name, "steps": 3}}).encode())
        link = door.raw()
        link.sendall((f"POST /mbcosim.v1.Simulations/Run HTTP/1.0\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
                      f"Content-Type: application/connect+json\r\nConnection: keep-alive\r\nContent-Length: {len(body)}\r\n\r\n").encode() + body)
        head, answer = all_of(link).split(b"\r\n\r\n", 1)
        assert b"Transfer-Encoding" not in head and b"Connection: close" in head.split(b"\r\n")
        assert json.loads(envelopes(answer)[-2][1])["done"]["step"] == "3" and envelopes(answer)[-1] == (2, b"{}")


def test_refusals_say_what_would_be_taken(door):
    assert door.request("POST", "/mbcosim.v1.Simulations/GetServerInfo", "{}", Content_Type="application/json",
                        Authorization=f"bearer {door.token}")[0] == 200  # in whatever case (RFC 9110, 11.1)
    status, headers, _ = door.request("POST", "/mbcosim.v1.Simulations/GetServerInfo", "{}", Content_Type="application/json", Authorization=None)
    assert (status, headers["WWW-Authenticate"]) == (401, "Bearer")
    status, headers, _ = door.request("GET", "/mbcosim.v1.Simulations/GetServerInfo")
    assert (status, headers["Allow"]) == (405, "POST")
    status, headers, _ = door.request("POST", "/metrics", "")
    assert (status, headers["Allow"]) == (405, "GET, HEAD")


def test_who_is_cut_off_is_nobody_else_from_the_same_port(start_daemon, tmp_path):
    """Connections of one client's port to HTTP and to gRPC: what cuts off the first leaves the second."""
    tokens = tmp_path / "tokens"
    tokens.write_text("a-token control ann\n")
    tokens.chmod(0o600)
    daemon = start_daemon("--tokens", str(tokens), "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0")
    door, grpc_port = Door(daemon.page()), int(re.search(r"listening on 127\.0\.0\.1:(\d+)", daemon.log()).group(1))
    links = []
    for port in (grpc_port, door.port):
        link = socket.socket()
        for option in (socket.SO_REUSEADDR, socket.SO_REUSEPORT):
            link.setsockopt(socket.SOL_SOCKET, option, 1)
        link.bind(("127.0.0.1", links[0].getsockname()[1] if links else 0))
        link.settimeout(60 * TIME_FACTOR)
        link.connect(("127.0.0.1", port))
        links.append(link)
    other, slow = links
    other.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes.fromhex("000000040000000000"))
    slow.sendall(f"POST /x HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nContent-Length: 1000\r\n\r\n".encode())
    assert b" 404 " in slow.recv(65536)
    assert slow.recv(65536) == b""  # the body never comes
    other.sendall(bytes.fromhex("0000080600") + bytes(4) + b"a ping..")
    other.settimeout(20 * TIME_FACTOR)
    said = b""
    while b"a ping.." not in said:
        more = other.recv(65536)
        assert more, said
        said += more


def test_ten_thousand_requests_on_a_few_connections_are_all_answered(door):
    connections = [http.client.HTTPConnection(door.host, door.port, timeout=20 * TIME_FACTOR) for _ in range(4)]
    headers = {"Authorization": f"Bearer {door.token}", "Content-Type": "application/json"}
    for number in range(10_000):
        connection = connections[number % 4]
        connection.request("POST", "/mbcosim.v1.Simulations/GetServerInfo", "{}", headers)
        answer = connection.getresponse()
        assert answer.status == 200 and answer.read()
    for connection in connections:
        connection.close()


def test_a_client_that_hangs_up_interrupts_its_run(door, server, endless):
    with server.load_text(endless) as simulation:
        link = door.raw()
        body = envelope(json.dumps({"step": {"simulation": simulation.name, "steps": 100000000}}).encode())
        link.sendall(f"POST /mbcosim.v1.Simulations/Run HTTP/1.1\r\nHost: {door.host}:{door.port}\r\nAuthorization: Bearer {door.token}\r\n"
                     f"Content-Type: application/connect+json\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body)
        wait_for(lambda: state(door, simulation) == "SIMULATION_STATE_STEPPING")
        link.close()
        wait_for(lambda: state(door, simulation) == "SIMULATION_STATE_READY")


def test_a_port_that_is_taken_ends_the_daemon_in_order(tmp_path):
    """gRPC serves already by then."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        ended = subprocess.run([os.path.join(BIN, "mbcosimd"), "--listen", f"unix:{tmp_path}/s", "--http", address],
                               stderr=subprocess.PIPE, text=True, timeout=30 * TIME_FACTOR)
    assert ended.returncode == 4 and f"cannot serve HTTP on {address}; is it in use?" in ended.stderr, ended.stderr
    assert not os.path.exists(tmp_path / "s")
