#!/usr/bin/env python3
"""The daemon under attack. usage: hostile.py BIN [--seconds N] [--seed N] [--kinds a,b] [--sanitized]

Starts a daemon with tokens, lets hostile clients do their worst from one core at nice 10 (attacks.py), and watches a
bystander with a token of its own. Every few seconds they are stopped for a moment: the bystander's quiet times are taken then,
so that what else the machine does counts on both sides. Fails on: the daemon's death or hang, INTERNAL from its code, a thread, a
descriptor or memory that stays, a probe that finds no healthy daemon, attacks that come to nothing, a bystander's p99 above 5 times its quiet
value (and above 50 ms: below, the scheduler decides), a SIGTERM that does not end it in time. Then other daemons are started on its state
folder and killed, and files are damaged in between (crashes.py). The seed is printed; the same one gives the same requests, though not
the same interleaving. A sanitizer's report is a fault, too; its build takes memory of its own, which --sanitized does not judge.
"""
import argparse
import atexit
import json
import math
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

import grpc

import attacks
from crashes import METADATA as ROOT, Crashes
from mbcosim.v1 import simulations_pb2 as pb, simulations_pb2_grpc

HERE = os.path.dirname(os.path.abspath(__file__))
FACTOR = float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))
MEMORY = 400 << 20  # the daemon's budget
STATE = 1 << 30  # the state folder's
GRACE = 2


def prepare(folder):
    """The tokens, and the folders of all daemons."""
    tokens = os.path.join(folder, "tokens")
    with open(tokens, "w") as file:
        file.write("bob-token control bob\nroot-token admin root\n")
        file.writelines(f"{kind}-token control mallory-{kind}\n" for kind in attacks.KINDS)
    os.chmod(tokens, 0o600)
    for kept in ("state", "results"):
        os.mkdir(os.path.join(folder, kept), 0o700)


def start(program, folder, log_name="log"):
    tokens, state = os.path.join(folder, "tokens"), os.path.join(folder, "state")
    address = f"unix:{folder}/mbcosim.sock"
    log = open(os.path.join(folder, log_name), "w")
    page = open(os.path.join(folder, "page"), "w")
    daemon = subprocess.Popen([os.path.join(program, "mbcosimd"), "--listen", address, "--listen", "127.0.0.1:0",
                               "--http", "127.0.0.1:0", "--tokens", tokens, "--limit-memory", str(MEMORY), "--shutdown-grace", str(GRACE),
                               "--shared-memory", "--state-dir", state, "--checkpoint-interval", "0.2", "--suspended-expiry", "5",
                               "--limit-state-bytes", str(STATE), "--results-root", os.path.join(folder, "results")],
                              stdout=page, stderr=log, preexec_fn=lambda: limit_descriptors(512))
    for _ in range(int(200 * FACTOR)):
        text, door = open(log.name).read(), re.search(r"^page: http://([^/]*)/.*\n", open(page.name).read())
        if "listening on 127.0.0.1:" in text and door or daemon.poll() is not None:
            break
        time.sleep(0.05)
    if not door:
        daemon.kill()
        raise RuntimeError(f"no daemon comes: {text[-2000:]}")
    tcp = "127.0.0.1:" + text.split("listening on 127.0.0.1:")[1].split()[0]
    return daemon, (address, tcp, door.group(1), state), log.name


def limit_descriptors(most):
    import resource
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


class Bystander:
    """Steps a simulation of its own and asks for health, and keeps the times that takes."""

    def __init__(self, address):
        self.channel = grpc.insecure_channel(address)
        self.stub = simulations_pb2_grpc.SimulationsStub(self.channel)
        self.metadata = [("authorization", "Bearer bob-token")]
        self.health = self.channel.unary_unary("/grpc.health.v1.Health/Check", request_serializer=bytes,
                                               response_deserializer=bytes)
        self.name = self.stub.CreateSimulation(iter([
            pb.UploadRequest(header=pb.UploadHeader(bundle_main_file="deck")),
            pb.UploadRequest(chunk={"path": "deck", "data": attacks.BODY.encode()})]), metadata=self.metadata,
            timeout=30 * FACTOR).simulation.name
        self.step = 0
        self.errors = []

    def once(self):
        start = time.monotonic()
        reply = self.stub.Step(pb.StepRequest(simulation=self.name, steps=5, outputs=[0]), metadata=self.metadata,
                               timeout=30 * FACTOR)
        assert self.health(b"", timeout=30 * FACTOR) == b"\x08\x01"
        took = time.monotonic() - start
        self.step += 5
        assert reply.step == self.step, (reply.step, self.step)
        return took

    def watch(self, seconds):
        """Times of many rounds."""
        times, start = [], time.monotonic()
        while time.monotonic() - start - seconds < 0:
            try:
                times.append(self.once())
            except (grpc.RpcError, AssertionError) as error:
                self.errors.append(repr(error)[:500])
                break
            time.sleep(0.005)
        return times


def p99(times):
    return sorted(times)[int(0.99 * (len(times) - 1))] if times else float("inf")


def memory_of(pid):
    with open(f"/proc/{pid}/status") as file:
        return int(next(line for line in file if line.startswith("VmRSS")).split()[1]) << 10


def threads_of(pid):
    return len(os.listdir(f"/proc/{pid}/task"))


def descriptors_of(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def watch_memory(pid, peak, stop):
    while not stop.wait(0.2):
        try:
            peak[0] = max(peak[0], memory_of(pid))
        except (OSError, StopIteration):  # it has ended; a process that nobody has waited for has no memory
            return


def probe(program, pid, address, faults, stop):
    """What an orchestrator does: a new connection, by a process of its own, every two seconds; two failures in a row count."""
    failed, begin = 0, time.monotonic()
    command = [os.path.join(program, "mbcosimd"), "--check", address, "--check-timeout", str(math.ceil(3 * FACTOR))]
    while not stop.wait(2):
        asked = time.monotonic()
        try:
            result = subprocess.run(command, timeout=60 * FACTOR, stderr=subprocess.PIPE, text=True)
        except subprocess.TimeoutExpired:
            faults.append("the probe does not end in its time")
            return
        failed = failed + 1 if result.returncode != 0 else 0
        if result.returncode != 0 and os.path.exists(f"/proc/{pid}/fd"):
            print(f"  probe, {asked - begin:.0f} s after the start, {time.monotonic() - asked:.1f} s long: {result.stderr[-500:].strip()} "
                  f"({descriptors_of(pid)} descriptors, {threads_of(pid)} threads)", flush=True)
        if failed == 2:
            faults.append("the probe finds no healthy daemon")


def processor_time(pid):
    """[s]"""
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def time_to_rest(pid, most):
    """How long the daemon works on what was sent, until it takes less than a tenth of a core for a second [s]; `most`: no longer than that."""
    start = last = time.monotonic()
    used = processor_time(pid)
    while last - start < most:
        time.sleep(1)
        now, then = time.monotonic(), processor_time(pid)
        if then - used < 0.1 * (now - last):
            return last - start
        last, used = now, then
    return most


def send(attackers, number):
    for attacker in attackers.values():
        if attacker.poll() is None:
            os.killpg(attacker.pid, number)


def watch_both(bystander, attackers, seconds):
    """The bystander's times while the attackers stand still, and under attack."""
    quiet, loud, start = [], [], time.monotonic()
    while time.monotonic() - start - seconds < 0 and not bystander.errors:
        loud += bystander.watch(min(8, seconds / 2))
        send(attackers, signal.SIGSTOP)
        time.sleep(0.5)
        quiet += bystander.watch(2)
        send(attackers, signal.SIGCONT)
    return quiet, loud


def attack(kinds, places, seed, seconds):
    """Each in a process group of its own, for `send`; not in a session of its own: Linux gives each session a share of the processor
    (sched(7), autogroup), whatever the nice values in it."""
    rng = random.Random(seed)
    return {kind: subprocess.Popen([sys.executable, os.path.join(HERE, "attacks.py"), kind, *places, f"{kind}-token",
                                    str(rng.randrange(1 << 30)), str(seconds)], stdout=subprocess.PIPE, text=True,
                                   process_group=0)
            for kind in kinds}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", default=",".join(attacks.KINDS))
    parser.add_argument("--sanitized", action="store_true")
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        prepare(folder)
        daemon, places, log = start(options.bin, folder)
        atexit.register(daemon.kill)  # whatever comes; nothing once it has ended
        address = places[0]
        bystander = Bystander(address)
        bystander.watch(1)
        before = threads_of(daemon.pid), descriptors_of(daemon.pid)
        peak, stop = [0], threading.Event()
        threading.Thread(target=watch_memory, args=(daemon.pid, peak, stop), daemon=True).start()
        prober = threading.Thread(target=probe, args=(options.bin, daemon.pid, address, faults, stop), daemon=True)
        prober.start()
        attackers = attack(options.kinds.split(","), places, options.seed, options.seconds)
        quiet, loud = watch_both(bystander, attackers, options.seconds)
        for kind, attacker in attackers.items():
            try:
                text, _ = attacker.communicate(timeout=60 * FACTOR)
                result = json.loads(text) if text else {"codes": {}, "internal": [f"the attacker itself ended with {attacker.returncode}"]}
            except subprocess.TimeoutExpired:
                os.killpg(attacker.pid, signal.SIGKILL)
                result = {"codes": {}, "internal": [f"{kind} hangs"]}
            print(f"  {kind:12} {result['codes']}", flush=True)
            faults += [f"{kind}: {text}" for text in result["internal"]]
            missing = [code for code in attacks.KINDS[kind] if not result["codes"].get(code)]
            if missing:
                faults.append(f"{kind}: none of its attacks came to {', '.join(missing)}")
        if daemon.poll() is None:
            rest = time_to_rest(daemon.pid, 60 * FACTOR)
            print(f"at rest {rest:.1f} s after the last of them", flush=True)
            if rest >= 10 * FACTOR:
                faults.append(f"the daemon works for {rest:.0f} s on what nobody waits for")
        stop.set()
        prober.join()
        most = math.inf if options.sanitized else MEMORY + (300 << 20)  # besides the budget: program, gRPC's buffers, allocator
        faults += judge(daemon, places, bystander, p99(quiet), p99(loud), before, peak[0], most, log)
        if faults:
            print("the daemon's last words:\n" + open(log).read()[-5000:])
        bystander.channel.close()
        crashes = Crashes(lambda name: start_again(options.bin, folder, name), places[3], options.seed)
        for log in crashes.run():
            faults += reports(log)
        faults += crashes.faults
    for fault in faults:
        print("FAULT", fault)
    sys.exit(1 if faults else 0)


def start_again(program, folder, log_name):
    daemon, places, log = start(program, folder, log_name)
    return daemon, places[0], log


def remaining(bystander, pid, before):
    """What is left of threads and descriptors when all but the bystander's simulation are gone: a journal has a descriptor."""
    try:
        listed = bystander.stub.ListSimulations(pb.ListSimulationsRequest(), metadata=ROOT, timeout=30 * FACTOR, wait_for_ready=True).simulations
    except grpc.RpcError as error:
        yield f"simulations cannot be listed: {error.code()} {error.details()}"
        return
    for info in listed:
        if info.name != bystander.name and info.state != pb.SIMULATION_STATE_SUSPENDED:
            try:
                bystander.stub.DeleteSimulation(pb.DeleteSimulationRequest(simulation=info.name), metadata=ROOT, timeout=30 * FACTOR,
                                                wait_for_ready=True)
            except grpc.RpcError as error:
                if error.code() is not grpc.StatusCode.NOT_FOUND:  # its lease was over
                    yield f"a simulation cannot be deleted: {error.code()} {error.details()}"
    timeout = time.monotonic() + 30 * FACTOR
    for what, count, then in zip(("threads", "descriptors"), (threads_of, descriptors_of), before):
        while count(pid) > then + 4 and time.monotonic() < timeout:
            time.sleep(0.2)
        if count(pid) > then + 4:
            yield f"{count(pid)} {what} are left, {then} were there before"


def judge(daemon, places, bystander, quiet, loud, before, peak, most, log):
    floor = 0.05 * FACTOR
    decides = f", where the floor of {1e3 * floor:.0f} ms decides" if 5 * quiet < loud <= floor else ""
    print(f"bystander p99: quiet {1e3 * quiet:.1f} ms, under attack {1e3 * loud:.1f} ms, {loud / quiet:.1f} times as long{decides}; "
          f"memory at most {peak >> 20} MB", flush=True)
    if daemon.poll() is not None:
        yield f"the daemon ended with {daemon.returncode}: {open(log).read()[-2000:]}"
        return
    yield from bystander.errors
    if loud > max(5 * quiet, floor):
        yield "the bystander was slowed down more than 5 times"
    if peak > most:
        yield f"memory of {peak >> 20} MB, with a budget of {MEMORY >> 20} MB"
    yield from remaining(bystander, daemon.pid, before)
    with grpc.insecure_channel(bystander_address(bystander), options=[("grpc.use_local_subchannel_pool", 1)]) as fresh:
        try:
            simulations_pb2_grpc.SimulationsStub(fresh).GetServerInfo(pb.GetServerInfoRequest(), metadata=bystander.metadata,
                                                                      timeout=10 * FACTOR, wait_for_ready=True)
        except grpc.RpcError as error:
            yield f"a new connection is not served: {error.code()}"
    still = attack(["slow"], places, 1, 600)
    try:
        time.sleep(3 * FACTOR)
        send(still, signal.SIGSTOP)
        daemon.send_signal(signal.SIGTERM)
        code = daemon.wait((GRACE + 3) * FACTOR)
        if code != 0:
            yield f"the daemon ended with {code}"
    except subprocess.TimeoutExpired:
        daemon.kill()
        daemon.wait()
        yield "SIGTERM did not end the daemon within its grace, while a client of it stood still"
    finally:
        send(still, signal.SIGKILL)
    yield from reports(log)


def reports(log):
    """What a daemon says itself of its faults."""
    text = open(log).read()
    if "uncaught" in text:
        yield "an exception came to the top of a thread: " + text.split("uncaught")[1][:200]
    if found := re.search(r"runtime error: |(ERROR|WARNING): \w+Sanitizer", text):
        yield "a sanitizer reports: " + text[text.rfind("\n", 0, found.start()) + 1:][:3000]


def bystander_address(bystander):
    return bystander.channel._channel.target().decode()


if __name__ == "__main__":
    main()
