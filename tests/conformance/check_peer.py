#!/usr/bin/env python3
"""A scripted server that checks a peer: is what it says, and when, what the protocol wants?

The peer is a program that attaches to a port: it is started with the server's address, the simulation's name and the port's name as
its last arguments. The port has two nodes. The peer has passed when it went through every scene without an error.

usage: check_peer.py COMMAND...      exit code 0: all checks passed
"""
import math
import os
import subprocess
import sys
import tempfile
import threading
import time

import grpc

from mbcosim.v1 import coupling_pb2 as pb, coupling_types_pb2 as types
import scripted_server

WAIT = 5.0 * float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))  # [s] for any message, and for the peer's end
NODES = 2
STEPS = 4


class Wrong(Exception):
    """What a peer did that it must not do."""


def require(holds, what):
    if not holds:
        raise Wrong(what)


class Stage(scripted_server.ScriptedServer):
    """Plays scenes to one peer and writes down what it says."""

    def __init__(self, address):
        super().__init__(address)
        self.session = self.new_session()
        self.hello, self.heard, self.ended = None, [], threading.Event()
        self.changed = threading.Condition()
        self._out = scripted_server.queue.SimpleQueue()

    def Attach(self, requests, context):
        def read():
            try:
                for message in requests:
                    with self.changed:
                        self.heard.append((time.monotonic(), message))
                        self.changed.notify_all()
            except Exception:  # the call was cancelled
                pass
            self.ended.set()
            with self.changed:
                self.changed.notify_all()

        threading.Thread(target=read, daemon=True).start()
        while True:
            message = self._out.get()
            if message is None:
                return
            if isinstance(message, scripted_server.Refused):
                self._abort(context, message)
            yield message

    def say(self, message):
        self._out.put(message)

    def hear(self, count, seconds):
        """The messages so far, heartbeats left out, as soon as there are so many."""
        with self.changed:
            self.changed.wait_for(lambda: len(self._words()) >= count or self.ended.is_set(), seconds)
            return self._words()

    def _words(self):
        return [message for _, message in self.heard if not message.HasField("heartbeat")]

    # ------------------------------------------------------------ the parts of a scene

    def greet(self):
        words = self.hear(1, 2 * WAIT)
        require(words, "the peer says nothing")
        require(self.heard[0][1].HasField("hello"), "the first message is not `hello`")
        self.hello = self.heard[0][1].hello
        check_hello(self.hello, self.session.name)
        self.say(pb.ServerMessage(welcome=pb.Welcome(protocol=scripted_server.PROTOCOL, layout=self.session.layout(), step_size=scripted_server.STEP,
                                                     model_digest=scripted_server.DIGEST)))
        self.quiet("after `welcome`")

    def quiet(self, when):
        """Nothing is said unasked."""
        said = len(self._words())
        time.sleep(0.1)
        require(len(self._words()) == said, f"{when} the peer sends something although nothing was asked")

    @property
    def implicit(self):
        return self.hello.schedule.mode in scripted_server.IMPLICIT

    @property
    def bound(self):
        timeout = scripted_server.time_out_of(self.hello)
        return min(timeout, WAIT)

    def ask(self, step, iteration, position):
        """The answer to one exchange."""
        session, peer = self.session, self.session.peer
        session.x = scripted_server.np.array([[position, 0, 0], [1, 2, 3.0]])
        said = len(self._words())
        session.motion(step, iteration)
        self.say(peer.out.get())
        words = self.hear(said + 1, self.bound)
        require(len(words) > said, "no answer to an exchange within the peer's own time-out")
        require(words[said].HasField("exchange"), f"an exchange is answered by `{words[said].WhichOneof('content')}`")
        answer = words[said].exchange
        require(answer.index == peer.index, f"exchange {peer.index} is answered with index {answer.index}")
        check_answer(answer, self.hello)
        return answer

    def tell(self, kind, step):
        self.say(pb.ServerMessage(**{kind: pb.StepNotice(step=step, time=step * scripted_server.STEP)}))

    def finish(self):
        self.say(None)


def check_hello(hello, simulation):
    require(hello.simulation == simulation, f"`hello` names simulation {hello.simulation!r}")
    require(hello.port == "p", f"`hello` names port {hello.port!r}")
    require(hello.protocol.lowest <= hello.protocol.highest, "the range of versions is empty")
    version = scripted_server.VERSION
    require(hello.protocol.lowest <= version <= hello.protocol.highest, f"the peer does not speak version {version}")
    form, schedule, iteration, presence = hello.form, hello.schedule, hello.iteration, hello.presence
    for group, field, kind in ((schedule, "mode", types.CouplingMode), (form, "rotation_form", types.RotationForm),
                               (form, "frame", types.PortFrame), (schedule, "input_hold", types.InputHold),
                               (presence, "policy", types.PeerPolicy), (iteration, "acceleration", types.Acceleration),
                               (iteration, "tangent", pb.TangentForm)):
        require(getattr(group, field) in kind.values(), f"`{field}` has a value that the protocol does not know")
    for group, field, good in ((schedule, "every", lambda n: n >= 1), (iteration, "relaxation", lambda x: 0 < x < 2),
                               (iteration, "tolerance", lambda x: x > 0), (iteration, "maximum_passes", lambda n: n >= 1)):
        require(not group.HasField(field) or good(getattr(group, field)), f"`{field}` is out of its range")


def check_answer(exchange, hello):
    require(exchange.WhichOneof("content"), "an exchange with neither `answer` nor `failure` nor `reject`")
    if not exchange.HasField("answer"):
        return
    answer = exchange.answer
    require(len(answer.forces) == 3 * NODES, f"{len(answer.forces)} numbers in `forces` for {NODES} nodes")
    require(len(answer.moments) in (0, 3 * NODES), f"{len(answer.moments)} numbers in `moments` for {NODES} nodes")
    require(not answer.signals and not answer.positions, "numbers that belong to other kinds of ports")
    require(not answer.reference_force and not answer.reference_moment, "loads on a reference node that the port does not have")
    require(all(map(math.isfinite, [*answer.forces, *answer.moments])), "a number that is not finite")
    if answer.HasField("tangent"):
        require(hello.iteration.tangent > pb.TANGENT_FORM_NONE, "a tangent that `hello` did not announce")
        size = 36 * NODES if answer.tangent.block_diagonal else 36 * NODES * NODES
        sizes = {len(answer.tangent.stiffness), len(answer.tangent.damping)}
        require(sizes <= {0, size}, f"the tangent has {sorted(sizes)} numbers, expected {size}")


# ---------------------------------------------------------------- the scenes

def play_steps(stage):
    """Some steps with their notices, heartbeats in between, then the end."""
    for k in range(1, STEPS + 1):
        stage.say(pb.ServerMessage(heartbeat=pb.Heartbeat(count=k)))
        for iteration in (1, 2) if stage.implicit else (0,):
            stage.ask(k if stage.implicit else k - 1, iteration, 0.1 * k)
        if stage.implicit:
            stage.tell("accepted", k)
            stage.quiet("after `accepted`")


def play_rejection(stage):
    """A step fails and is done again: the same motion must get the same answer. Of an explicit peer, it is simply asked on."""
    if not stage.implicit:
        return play_steps(stage)
    stage.ask(1, 1, 0.1)
    stage.tell("accepted", 1)
    first = [stage.ask(2, iteration, 0.2 + 0.1 * iteration) for iteration in (1, 2)]
    stage.tell("rejected", 1)
    stage.quiet("after `rejected`")
    again = [stage.ask(2, iteration, 0.2 + 0.1 * iteration) for iteration in (1, 2)]
    for before, after in zip(first, again):
        require(list(before.answer.forces) == list(after.answer.forces), "after `rejected` the same motion gets another answer")
    stage.tell("accepted", 2)
    return None


def play_break(stage):
    """The server ends with an error in the middle: the peer has to leave, too."""
    stage.ask(1 if stage.implicit else 0, int(stage.implicit), 0.1)
    stage.say(scripted_server.Refused(grpc.StatusCode.UNAVAILABLE, "SHUTTING_DOWN", "the server is shutting down"))


SCENES = {"steps": play_steps, "rejection": play_rejection, "break": play_break}


def play(scene, start_peer):
    with tempfile.TemporaryDirectory() as folder:
        address = f"unix:{folder}/s"
        failures = []

        def run_peer(name):
            try:
                start_peer(address, name, "p")
            except Exception as error:
                failures.append(error)

        with Stage(address) as stage:
            peer = threading.Thread(target=run_peer, args=(stage.session.name,), daemon=True)
            peer.start()
            try:
                stage.session.peer = scripted_server.Attached(pb.Hello())
                stage.greet()
                stage.session.peer.hello = stage.hello
                scene(stage)
            finally:
                stage.finish()
            peer.join(WAIT)
            require(not peer.is_alive(), f"the peer is still there {WAIT} s after the end")


def check_peer(start_peer, scenes=SCENES):
    """What is wrong by scene; `start_peer(address, simulation, port)` runs the peer until it ends."""
    found = {}
    for name, scene in scenes.items():
        try:
            play(scene, start_peer)
        except Wrong as error:
            found[name] = str(error)
    return found


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)

    def start_peer(*arguments):
        subprocess.run([*sys.argv[1:], *arguments], timeout=60, check=False)

    found = check_peer(start_peer)
    for name in SCENES:
        print(f"{'FAILED' if name in found else 'ok':7} {name}{': ' + found[name] if name in found else ''}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
