"""The C++ client can do what those of Python can: their public names are compared. test_bounded_waits.py compares the two of Python."""
import inspect
import os
import re

from mbcosim.calls import ServerCalls, SimulationCalls, SnapshotCalls

HEADER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "server", "client", "mbcosim_client.h")

# Names of Python -> what C++ has in their place.
SERVER = {"attach": "find", "info": "version", "reduce": None, "close": None}
SIMULATION = {"describe": "variables", "handles": None, "split": None, "pack": None, "result": None, "delete": None}
SNAPSHOT = {"restore": "restore", "export": "export_state", "delete": "delete_snapshot"}


def calls(kind):
    """What can be asked of the server."""
    return {name for name, function in inspect.getmembers(kind) if getattr(function, "is_call", False)}


def methods(cls):
    """Public methods of a class of the C++ client."""
    with open(HEADER, encoding="utf-8") as file:
        text = file.read()
    body = re.search(rf"^class {cls} {{\n(.*?)^}};", text, re.S | re.M).group(1)
    public = re.sub(r"//[^\n]*", "", body.split(" private:")[0])
    return set(re.findall(r"\b([a-z_]+)\(", public))


def test_the_cpp_client_can_do_what_python_can():
    server, simulation = methods("Server"), methods("Simulation")
    for name in calls(ServerCalls) | {"events"}:
        assert SERVER.get(name, name) in server | {None}, name
    for name in calls(SimulationCalls) | {"stepper", "couple", "subscribe"}:
        assert SIMULATION.get(name, name) in simulation | {None}, name
    for name in calls(SnapshotCalls):
        assert SNAPSHOT[name] in simulation, name


def test_every_call_of_cpp_is_tried_with_a_silent_server():
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "client_test.cpp"), encoding="utf-8") as file:
        tried = set(re.findall(r'\{"([a-z_]+)[^"]*",\s*\[&\]', file.read()))
    assert methods("Server") - {"connect"} <= tried
    assert methods("Simulation") - {"name", "diagnostics"} <= tried
