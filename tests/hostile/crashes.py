"""What comes after the attacks: daemons on the same state folder that are killed, files damaged, and the next one, of whom all is asked."""
import os
import random
import signal
import subprocess
import time

import grpc

import attacks
from local_attacks import Damage
from mbcosim.v1 import simulations_pb2 as pb, simulations_pb2_grpc

ROUNDS = 4  # daemons
MADE = 8  # simulations that each of them makes
FACTOR = float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))
METADATA = [("authorization", "Bearer root-token")]


class Crashes:
    """Rounds of kill, damage and start; `faults` has what was wrong."""

    def __init__(self, start, state, seed):
        self.start, self.state, self.random, self.faults, self.codes = start, os.path.join(state, "simulations"), random.Random(seed), [], {}
        self.damaged, self.asked = 0, 0

    def run(self):
        """`start(log)` gives a daemon, its address and the path of its log. The last one ends by SIGTERM. Paths of all logs."""
        logs = []
        for number in range(ROUNDS):
            daemon, address, log = self.start(f"log of daemon {number + 2}")
            logs.append(log)
            with grpc.insecure_channel(address, options=[("grpc.use_local_subchannel_pool", 1)]) as channel:
                stub = simulations_pb2_grpc.SimulationsStub(channel)
                self.ask_all(stub)
                names = self.make(stub)
            if daemon.poll() is not None:
                self.faults.append(f"a daemon on a damaged folder ended with {daemon.returncode}: {open(log).read()[-2000:]}")
                break
            if number + 1 < ROUNDS:
                daemon.kill()
                daemon.wait()
                self.damage(names)
            else:
                self.end(daemon)
        print(f"  {ROUNDS} daemons on damaged files: {self.damaged} files damaged, {self.asked} simulations asked, {self.codes}", flush=True)
        if self.codes.get("OK", 0) < ROUNDS * MADE or self.asked < ROUNDS or self.damaged < ROUNDS:
            self.faults.append("hardly anything was damaged, or asked")
        return logs

    def call(self, function, *arguments):
        try:
            reply = function(*arguments, metadata=METADATA, timeout=10 * FACTOR)
            self.codes["OK"] = self.codes.get("OK", 0) + 1
            return reply
        except grpc.RpcError as error:
            code = error.code().name
            self.codes[code] = self.codes.get(code, 0) + 1
            if code in ("INTERNAL", "UNKNOWN", "UNAVAILABLE", "DEADLINE_EXCEEDED"):
                self.faults.append(f"on a damaged folder: {function._method.decode()}: {code} {error.details()}")
            return None

    def ask_all(self, stub):
        """All are brought back, one after the other, for a while; most are deleted then, that there is room for the others."""
        listed = self.call(stub.ListSimulations, pb.ListSimulationsRequest())
        start = time.monotonic()
        for info in listed.simulations if listed else []:
            if time.monotonic() - start > 3 * FACTOR or len(self.faults) > 5:
                break
            self.asked += 1
            self.call(stub.ReadVariables, pb.ReadVariablesRequest(simulation=info.name))
            self.call(stub.ListSnapshots, pb.ListSnapshotsRequest(simulation=info.name))
            self.call(stub.Step, pb.StepRequest(simulation=info.name, steps=2))
            if self.random.random() < 0.7:
                self.call(stub.DeleteSimulation, pb.DeleteSimulationRequest(simulation=info.name))

    def make(self, stub):
        """Simulations with a journal, each stepped some times; their names."""
        options = pb.CreateOptions(durability=pb.DURABILITY_JOURNAL, checkpoint_steps=1_000_000)
        names = []
        for _ in range(MADE):
            reply = self.call(stub.CreateSimulation, iter([pb.UploadRequest(header=pb.UploadHeader(bundle_main_file="deck", options=options)),
                                                           pb.UploadRequest(chunk={"path": "deck", "data": attacks.BODY.encode()})]))
            if not reply:
                continue
            names.append(reply.simulation.name)
            self.call(stub.CreateSnapshot, pb.CreateSnapshotRequest(simulation=names[-1]))
            for _ in range(self.random.randrange(1, 5)):
                self.call(stub.Step, pb.StepRequest(simulation=names[-1], steps=self.random.choice([1, 20])))
        return names

    def damage(self, names):
        """A journal at least, and files of half of all simulations: the others must come back beside them."""
        files = Damage(self.random)
        folders = [os.path.join(self.state, name.split("/")[1]) for name in names]
        journals = [os.path.join(folder, entry) for folder in folders for entry in os.listdir(folder) if entry.startswith("journal-")]
        if not journals:
            self.faults.append("no simulation had a journal when the daemon was killed")
            return
        self.random.choice([files.flip, files.cut, files.lengthen, files.replace])(self.random.choice(journals))
        self.damaged += 1
        others = [entry.path for entry in os.scandir(self.state) if entry.is_dir()]
        for folder in self.random.sample(others, len(others) // 2):
            self.damaged += files.damage(folder)

    def end(self, daemon):
        daemon.send_signal(signal.SIGTERM)
        try:
            if (code := daemon.wait(30 * FACTOR)) != 0:
                self.faults.append(f"the last daemon ended with {code}")
        except subprocess.TimeoutExpired:
            daemon.kill()
            self.faults.append("SIGTERM did not end the last daemon")
