"""States that nobody saved: a snapshot's bytes with arrays of other lengths and numbers from anywhere, and a checksum that fits."""
import math
import struct

from google.protobuf.duration_pb2 import Duration
from mbcosim.v1 import common_pb2, simulations_pb2 as pb

BASIS, PRIME = 14695981039346656037, 1099511628211
ARRAYS_AT = 8 + 4 + 8 + 4 * 8 + 5 + 6 * 8 + 5 * 8  # after magic, version, digest, times and step, flags, counts and lengths of steps
COUNTS_AT = [8 + 4 + 8 + 3 * 8, *range(57, 57 + 6 * 8, 8)]
TIMES_AT = [20, 28, 36, *range(105, ARRAYS_AT, 8)]
NUMBERS = [0.0, -0.0, 1.0, -1.0, 1e9, -1e9, 1e300, -1e300, 5e-324, 2.0**53, -(2.0**63), math.inf, -math.inf, math.nan]

# With memory of its own in drives, friction and a slider that looks for its span, and variables.
DECK = """
set: real seen = 0.;
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.e9; time step: 1.e-3; method: ms, 0.6; tolerance: 1.e-6; max iterations: 20;
  derivatives tolerance: 1.e3; nonlinear solver: newton raphson, modified, 5, keep jacobian matrix; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; joints: 1; forces: 3; end: control data;
begin: nodes;
  structural: 1, dynamic, null, eye, 0., 1., 0., 0.1, 5., 0.1;
  structural: 2, dynamic, 1., 0., 0., eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, diag, 1., 2., 3.;
  body: 2, 2, 1., null, diag, 1., 2., 3.;
  joint: 1, rod, 1, 2, 1., linear viscoelastic, 10., .1;
  force: 1, absolute, 1, position, null, 1., 0., 0., random, 1., 0., 0., forever, steps, 3;
  force: 2, absolute, 1, position, null, 0., 1., 0., sample and hold, time, closest next, 0., forever, .002;
  force: 3, absolute, 2, position, null, 0., 0., 1., string, "seen = seen + Time";
end: elements;
"""


def checksum(data):
    value = BASIS
    for byte in data:
        value = (value ^ byte) * PRIME & 0xFFFFFFFFFFFFFFFF
    return value


def arrays_of(data):
    """(offset of the count, count) of each array."""
    found, at = [], ARRAYS_AT
    while at < len(data):
        count, = struct.unpack_from("<Q", data, at)
        found.append((at, count))
        at += 8 + 8 * count
    return found


class ForgedStates:
    """Imports of one attacker into a simulation that lives; then it is stepped, read and analysed."""

    def __init__(self, attacker):
        self.attacker, self.random, self.stub = attacker, attacker.random, attacker.stub
        self.name, self.saved = None, b""

    def once(self):
        if not self.name or self.random.random() < 0.02:
            self.begin()
        if not self.saved:
            return
        call, name = self.attacker.call, self.name
        call(self.stub.ImportSnapshotInline, pb.ImportSnapshotInlineRequest(simulation=name, restore=True, data=self.forged()))
        call(self.stub.Step, pb.StepRequest(simulation=name, steps=self.random.choice([1, 3])))
        handle = self.random.choice([9, 19, self.random.randrange(30)])  # two of them: loads
        call(self.stub.ReadVariables, pb.ReadVariablesRequest(simulation=name, handles=[handle]))
        call(self.stub.WriteVariables, pb.WriteVariablesRequest(simulation=name, values=common_pb2.Values(handles=[handle], values=[1.0] * 6)))
        if self.random.random() < 0.1:
            call(self.stub.Linearize, pb.LinearizeRequest(simulation=name))
            call(self.stub.ComputeEigenvalues, pb.ComputeEigenvaluesRequest(simulation=name))
        if self.random.random() < 0.2:
            fork = call(self.stub.ForkSimulation, pb.ForkSimulationRequest(simulation=name, options=pb.CreateOptions(lease=Duration(seconds=1))))
            if fork:
                call(self.stub.Step, pb.StepRequest(simulation=fork.simulation.name))
        call(self.stub.ResetSimulation, pb.ResetSimulationRequest(simulation=name))

    def begin(self):
        if self.name:
            self.attacker.call(self.stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=self.name))
        self.name, self.saved = self.attacker.create(DECK, lease=Duration(seconds=60)), b""
        if not self.name:
            return
        self.attacker.call(self.stub.Step, pb.StepRequest(simulation=self.name, steps=self.random.choice([1, 4])))
        pieces = self.attacker.call(lambda *a, **o: list(self.stub.ExportSnapshot(*a, **o)), pb.ExportSnapshotRequest(simulation=self.name))
        self.saved = b"".join(piece.data for piece in pieces or ())

    def forged(self):
        data = bytearray(self.saved[:-8])
        for _ in range(self.random.choice([0, 1, 1, 1, 2, 5])):
            self.random.choice([self.resize, self.resize, self.renumber, self.recount, self.retime])(data)
        return bytes(data) + struct.pack("<Q", checksum(data))

    def resize(self, data):
        """One array of another length; the others as they were."""
        at, count = self.random.choice(arrays_of(data))
        length = self.random.choice([0, 1, max(count - 1, 0), count + 1, count // 2, 2 * count, 48, 96])
        data[at:at + 8 + 8 * count] = struct.pack("<Q", length) + (bytes(data[at + 8:at + 8 + 8 * count]) + bytes(8 * length))[:8 * length]

    def renumber(self, data):
        at, count = self.random.choice(arrays_of(data))
        if count:
            struct.pack_into("<d", data, at + 8 + 8 * self.random.randrange(count), self.random.choice(NUMBERS))

    def recount(self, data):
        struct.pack_into("<q", data, self.random.choice(COUNTS_AT), self.random.choice([0, 1, -1, 2**31, 2**53, 2**63 - 1, -(2**63)]))

    def retime(self, data):
        struct.pack_into("<d", data, self.random.choice(TIMES_AT), self.random.choice(NUMBERS))
