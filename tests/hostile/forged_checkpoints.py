"""Checkpoints that no server wrote: one that was exported, with fields of its messages, and whole records, changed, and checksums that fit."""
import struct
import zlib

from fuzzer import Fuzzer
from google.protobuf.descriptor import FieldDescriptor as F
from google.protobuf.duration_pb2 import Duration
from mbcosim.v1 import checkpoints_pb2, simulations_pb2 as pb

HEAD, POINT = 3, 5  # kinds of records
HEADER = 16  # bytes of a record before its content


def records_of(data):
    """[kind, content] of each."""
    found, at = [], 0
    while at < len(data):
        kind, size = struct.unpack_from("<IQ", data, at)
        found.append([kind, data[at + HEADER:at + HEADER + size]])
        at += HEADER + size
    return found


def bytes_of(records):
    data = b""
    for kind, content in records:
        start = struct.pack("<IQ", kind, len(content))
        data += start + struct.pack("<I", zlib.crc32(content, zlib.crc32(start))) + content
    return data


class ForgedCheckpoints:
    """Imports of one attacker; what is taken is woken, stepped and deleted."""

    def __init__(self, attacker, deck, port):
        self.attacker, self.random, self.stub = attacker, attacker.random, attacker.stub
        self.deck, self.port = deck, port
        self.fuzzer, self.saved = Fuzzer(self.random), []

    def once(self):
        if not self.saved or self.random.random() < 0.02:
            self.begin()
        if not self.saved:
            return
        call, data = self.attacker.call, self.forged()
        header = pb.ImportCheckpointHeader(display_name="forged")
        reply = call(self.stub.ImportCheckpoint, iter([pb.ImportCheckpointRequest(header=header),
                                                       *(pb.ImportCheckpointRequest(data=data[at:at + 65536]) for at in range(0, len(data), 65536))]))
        if not reply:
            return
        name = reply.simulation.name
        call(self.stub.Step, pb.StepRequest(simulation=name, steps=2))
        call(self.stub.GetSimulation, pb.GetSimulationRequest(simulation=name))
        snapshots = call(self.stub.ListSnapshots, pb.ListSnapshotsRequest(simulation=name))
        for snapshot in snapshots.snapshots if snapshots else ():
            call(self.stub.RestoreSnapshot, pb.RestoreSnapshotRequest(simulation=name, snapshot=snapshot.name))
        call(self.stub.Step, pb.StepRequest(simulation=name, steps=1))
        call(self.stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=name))

    def begin(self):
        name = self.attacker.create(self.deck, lease=Duration(seconds=20), durability=pb.DURABILITY_CHECKPOINT, ports=[self.port], optional_ports=True)
        if not name:
            return
        self.attacker.call(self.stub.CreateSnapshot, pb.CreateSnapshotRequest(simulation=name))
        pieces = self.attacker.call(lambda *a, **o: list(self.stub.ExportCheckpoint(*a, **o)), pb.ExportCheckpointRequest(simulation=name))
        self.saved = records_of(b"".join(piece.data for piece in pieces or ()))
        self.attacker.call(self.stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=name))

    def forged(self):
        records = [list(record) for record in self.saved]
        for _ in range(self.random.choice([0, 1, 1, 1, 3])):
            if self.random.random() < 0.15:
                self.rearrange(records)
                continue
            record = self.random.choice([record for record in records if record[0] in (HEAD, POINT)] or records)
            message = checkpoints_pb2.CheckpointHead() if record[0] == HEAD else checkpoints_pb2.CheckpointPoint()
            try:
                message.ParseFromString(record[1])
            except Exception:  # of another kind
                continue
            self.change(message)
            record[1] = message.SerializeToString()
        return bytes_of(records)

    def rearrange(self, records):
        at, other = self.random.randrange(len(records)), self.random.randrange(len(records))
        change = self.random.random()
        if change < 0.4:
            del records[at]
        elif change < 0.7:
            records.insert(other, list(records[at]))
        else:
            records[at][1], records[other][1] = records[other][1], records[at][1]

    def change(self, message):
        """One field, here or further in."""
        inner = [getattr(message, field.name) for field, _ in message.ListFields() if field.cpp_type == F.CPPTYPE_MESSAGE and field.label != F.LABEL_REPEATED]
        inner += [entry for field, entries in message.ListFields() if field.label == F.LABEL_REPEATED and field.cpp_type == F.CPPTYPE_MESSAGE
                  and not field.message_type.GetOptions().map_entry for entry in entries]
        if inner and self.random.random() < 0.6:
            return self.change(self.random.choice(inner))
        field = self.random.choice(message.DESCRIPTOR.fields)
        if self.random.random() < 0.3:
            message.ClearField(field.name)
        else:
            self.fuzzer.put(message, field, 2)
