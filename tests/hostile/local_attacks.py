"""Attacks that take a process of the daemon's own user: on the socket and the rings of shared memory, and on files of the state folder."""
import os
import shutil
import socket
import struct
import sys
import time

import grpc

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
import wires
from google.protobuf.duration_pb2 import Duration
from mbcosim.v1 import coupling_pb2, simulations_pb2 as pb

PORT = {"name": "p", "kind": 4, "output_variables": ["time"]}


class SharedMemory:
    """Peers over shared memory that talk nonsense: before the memory is theirs, in messages, and in what lies beside them."""

    def __init__(self, attacker, fuzzer):
        self.attacker, self.random, self.fuzzer = attacker, attacker.random, fuzzer

    def once(self):
        name = self.attacker.create(lease=Duration(seconds=5), ports=[PORT])
        try:
            if self.random.random() < 0.3:
                self.knock()
            else:
                self.exchange(name)
        except (OSError, IndexError):  # no connection, or an answer without memory
            self.attacker.codes["REFUSED"] += 1

    def knock(self):
        """What comes instead of a request."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
            connection.settimeout(2)
            connection.connect(self.attacker.address[len("unix:"):] + ".shm")
            connection.send(self.random.choice([b"", b"mbcosim", b"mbcosim1Bearer x", b"mbcosim1" + b"\xff" * 60000, self.random.randbytes(50)]))
            if self.random.random() < 0.7:
                connection.recv(100)

    def exchange(self, name):
        wire = wires.SharedMemoryWire(self.attacker.address, f"Bearer {self.attacker.token}", seconds=1)
        try:
            self.fuzzer.learn("simulation", name or "")
            if self.random.random() < 0.8:
                wire.send(coupling_pb2.PeerMessage(hello=coupling_pb2.Hello(simulation=name, port="p")))
                wire.receive(0.5)
            running = self.attacker.stub.Step.future(pb.StepRequest(simulation=name, steps=3), metadata=self.attacker.metadata, timeout=1)
            for _ in range(self.random.randrange(6)):
                self.disturb(wire)
                wire.receive(0.02)
            if self.random.random() < 0.3:  # last: nothing can be received with counters that cannot be
                wire.overwrite(self.random.randrange(2), 8 * self.random.randrange(32),
                               self.random.choice([0, 1, 2**20 + 1, 2**63, 2**64 - 1]))
                time.sleep(0.05)
            running.cancel()
            self.attacker.codes["OK" if wire.status is None else f"ENDED {wire.status.code}"] += 1
        finally:
            wire.close()

    def disturb(self, wire):
        what = self.random.randrange(5)
        message = self.fuzzer.message(coupling_pb2.PeerMessage).SerializeToString()
        if what <= 1:
            wire.write(struct.pack("<I", len(message)) + message)
        elif what == 2:
            wire.write(struct.pack("<I", self.random.choice([0, 1, 2**24, 2**31, 2**32 - 1])) + message)
        elif what == 3:
            wire.write(self.random.randbytes(self.random.choice([1, 100, 100_000])))
        else:  # half a message, and silence
            wire.write(struct.pack("<I", len(message) + 1000) + message)
            time.sleep(0.05)


class Damage:
    """Files of a simulation's folder, changed at random places."""

    def __init__(self, rolls):
        self.random = rolls

    def damage(self, folder):
        """One of its files. False: there is none any more."""
        try:
            paths = [os.path.join(folder, entry) for entry in os.listdir(folder)]
            path = self.random.choice(paths)
            self.random.choice([self.flip, self.flip, self.cut, self.lengthen, os.unlink, self.replace, self.exchange_with(paths)])(path)
        except (OSError, IndexError, shutil.Error):  # the daemon was quicker
            return False
        return True

    def flip(self, path):
        with open(path, "r+b") as file:
            at = self.random.randrange(max(1, os.path.getsize(path)))
            file.seek(at)
            byte = file.read(1) or b"\0"
            file.seek(at)
            file.write(bytes([byte[0] ^ 1 << self.random.randrange(8)]))

    def cut(self, path):
        os.truncate(path, self.random.randrange(os.path.getsize(path) + 1))

    def lengthen(self, path):
        descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_NONBLOCK)  # of a pipe that nobody reads: an error, no wait
        with open(descriptor, "ab") as file:
            file.write(self.random.randbytes(self.random.choice([1, 16, 5000])))

    def replace(self, path):
        """By what is no file."""
        os.unlink(path)
        self.random.choice([os.mkdir, lambda p: os.symlink("/dev/zero", p), lambda p: os.mkfifo(p, 0o600), lambda p: os.symlink(p, p)])(path)

    def exchange_with(self, paths):
        """By its own bytes: a link to /dev/zero has no end."""
        def copy(path):
            if os.path.isfile(path):
                shutil.copyfile(path, self.random.choice(paths))
        return copy


class Folder:
    """Files of the attacker's own suspended simulations, damaged; then they are asked for."""

    def __init__(self, attacker, folder):
        self.attacker, self.random, self.folder, self.files = attacker, attacker.random, folder, Damage(attacker.random)

    def once(self):
        durability = self.random.choice([pb.DURABILITY_CHECKPOINT, pb.DURABILITY_JOURNAL])
        name = self.attacker.create(lease=Duration(nanos=300_000_000), durability=durability)
        if not name:
            time.sleep(0.1)
            return
        for _ in range(self.random.randrange(4)):
            self.attacker.call(self.attacker.stub.Step, pb.StepRequest(simulation=name, steps=self.random.choice([1, 20])))
        self.attacker.call(self.attacker.stub.CreateSnapshot, pb.CreateSnapshotRequest(simulation=name))
        time.sleep(self.random.choice([0, 0.3, 1]))  # alive, about to be suspended, suspended
        for _ in range(self.random.choice([1, 1, 5])):
            if not self.files.damage(os.path.join(self.folder, name)):
                self.attacker.codes["GONE"] += 1
        self.ask(name)
        self.attacker.call(self.attacker.stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=name))

    def ask(self, name):
        stub, random = self.attacker.stub, self.random
        requests = [(stub.Step, pb.StepRequest(simulation=name)), (stub.GetSimulation, pb.GetSimulationRequest(simulation=name)),
                    (stub.ForkSimulation, pb.ForkSimulationRequest(simulation=name, options=pb.CreateOptions(lease=Duration(seconds=1)))),
                    (stub.ListSnapshots, pb.ListSnapshotsRequest(simulation=name))]
        for function, request in random.sample(requests, 2):
            self.attacker.call(function, request)
        try:
            for _ in stub.ExportCheckpoint(pb.ExportCheckpointRequest(simulation=name), metadata=self.attacker.metadata, timeout=5):
                pass
        except grpc.RpcError as error:
            self.attacker.count(error, "ExportCheckpoint")
