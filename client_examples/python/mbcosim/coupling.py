"""Peers: external codes that answer a running simulation's motion with loads, or its signals with signals.

    def spring(motion):
        return -100.0 * motion.x                     # forces on the nodes, n x 3 [N]

    ports = [mbcosim.structural_port("tip", nodes=[2])]
    with server.load("beam.mbd", ports=ports) as simulation, simulation.couple("tip", spring):
        simulation.run_until(1.0)
"""
from __future__ import annotations

import operator
import queue
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, Optional

import grpc
import numpy as np
import numpy.typing as npt

from mbcosim.v1 import coupling_pb2 as pb, coupling_types_pb2 as types

from . import exchange
from .errors import Unavailable, cancelled_here, from_rpc_error, translated
from .rpc import PARTING, USUAL, bounded, end_with
from .words import each_name

if TYPE_CHECKING:
    from .simulation import Simulation

Answer = Callable[[exchange.Motion], Any]  # see Peer


def _labels(port: str, nodes: Iterable[int]) -> list[int]:
    """The nodes of a port, which has no model yet in which names could be found."""
    try:
        return [operator.index(label) for label in nodes]
    except TypeError:
        raise TypeError(f"`nodes` of port {port!r} must be a list of labels, whole numbers, got {nodes!r}") from None


def structural_port(name: str, nodes: Iterable[int], *, offsets: Optional[npt.ArrayLike] = None,
                    reference: Optional[int] = None) -> types.PortDefinition:
    """A port on structural nodes, by their labels: motion out, forces and moments in. `offsets`: n x 3 in the nodes' frames [m]."""
    port = types.PortDefinition(name=name, kind=types.PORT_KIND_STRUCTURAL, node_labels=_labels(name, nodes))
    if offsets is not None:
        port.offsets.extend(np.ravel(np.asarray(offsets, float)))
    if reference is not None:
        port.reference_node_label = reference
    return port


def signal_port(name: str, outputs: Iterable[str], inputs: Iterable[str]) -> types.PortDefinition:
    """A port of scalars: variables out, inputs in, by name."""
    return types.PortDefinition(name=name, kind=types.PORT_KIND_SIGNAL, output_variables=each_name(outputs, "outputs"),
                                input_variables=each_name(inputs, "inputs"))


def motion_port(name: str, nodes: Iterable[int], *, positions_only: bool = False) -> types.PortDefinition:
    """A port that imposes the motion of nodes: reactions out, positions and orientations in."""
    return types.PortDefinition(name=name, kind=types.PORT_KIND_MOTION, node_labels=_labels(name, nodes), positions_only=positions_only)


def modal_port(name: str, joint: int) -> types.PortDefinition:
    """A port on a modal joint: amplitudes and their rates out, generalized forces in."""
    return types.PortDefinition(name=name, kind=types.PORT_KIND_MODAL, modal_joint_label=joint)


def open_stream(channel: Any) -> Any:
    """The method `Coupling.Attach` of a channel, without parsing what the server sends."""
    return channel.stream_stream("/mbcosim.v1.Coupling/Attach", request_serializer=pb.PeerMessage.SerializeToString,
                                 response_deserializer=None)


class Peer(exchange.Course):
    """An attached peer. A thread of its own calls `answer(Motion)` for each exchange.

    answer returns forces (n x 3), or (forces, moments), or the signals, or Loads; an exception in it fails the step. On a port of
    the deck with reference loads it returns (forces, moments, force on the reference node, moment on it), on a motion port
    positions or (positions, rotations). An answer of another shape fails the step, too.
    Without `answer` the peer is synchronous: iterate over it and answer each motion with `peer.answer(...)`, in another thread than
    the one that steps.

    every      steps between exchanges; "tight": iterations; None: the port's own, 1 unless its deck says otherwise
    mode       "loose", "staggered", "tight" or "window"; None: the port's own, "loose" unless its deck says otherwise
    frame      "global", "node" or "reference"; None: the port's own, "reference" if its deck gives it a reference node
    following_loads     loads keep their components in that node's frame until the next answer: they turn with it
    global_reference_loads  those on the reference node are global in any frame
    tangent    "dense" or "block_diagonal" when answers are Loads with derivatives
    units      of the peer, mbcosim.units(...): the server converts all that crosses, times and derivatives too; None: the deck's
    peer_timeout        the server waits so long for an answer [s]
    server_timeout      the server gives signs of life; when none comes for so long [s], the peer ends with an error
    heartbeat_timeout   the peer shows signs of life at least that often [s], also while it computes; the library sends them
    timeout             seconds that attaching may take
    step       of a peer that comes back: the step at whose end it stands, `step` of the peer that left. A simulation that was brought back from a
               checkpoint and stands at an earlier one refuses it (PreconditionFailed, reason PEER_AHEAD)
    can_go_back  it is let in all the same: before it answers it takes the state that it had at the end of step `peer.step`
    After the end `error` has what ended the stream, None when it ended in good order; `raised` what `answer` raised last.
    """

    def __init__(self, simulation: Simulation, port: str, answer: Optional[Answer] = None, *, rotation: str = "matrix",
                 heartbeat_timeout: Optional[float] = None, server_timeout: Optional[float] = None, timeout: Optional[float] = USUAL,
                 **options: Any) -> None:
        super().__init__(rotation)
        self._function = answer
        self._out: queue.SimpleQueue[Optional[pb.PeerMessage]] = queue.SimpleQueue()
        first = exchange.hello(simulation, port, rotation=rotation, heartbeat_timeout=heartbeat_timeout,
                               heartbeat_interval=None if server_timeout is None else server_timeout / 3, **options)
        self._out.put(first)
        connection = simulation._connection
        self._stream = open_stream(connection.channel)(iter(self._out.get, None), metadata=connection.about(simulation.name))
        end_with(self._stream, self._out)
        with bounded(timeout, self._stream.cancel, "attaching the peer"), translated():
            self._begin(exchange.receive(next(self._stream))[1], first.hello)
        self._closing = threading.Event()
        self._waiting_since: Optional[float] = None
        if heartbeat_timeout is not None or server_timeout is not None:
            threading.Thread(target=self._beat, args=(heartbeat_timeout, server_timeout), daemon=True).start()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        if answer is not None:
            self._thread.start()

    def __enter__(self) -> Peer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leaves the port."""
        self._closing.set()
        self._out.put(None)
        if self._function is not None and self._thread is not threading.current_thread():
            self._thread.join(PARTING)
        self._stream.cancel()

    def __iter__(self) -> Iterator[exchange.Motion]:
        """Every Motion until the stream ends."""
        exchange.check_synchronous(self._function)
        return self._motions()

    def _motions(self) -> Iterator[exchange.Motion]:
        try:
            while True:
                self._waiting_since = time.monotonic()
                data = next(self._stream, None)
                self._waiting_since = None
                if data is None:
                    break
                motion = self._take(data)
                if motion is not None:
                    yield motion
        except grpc.RpcError as error:
            if not cancelled_here(error):
                self.error = self.error or from_rpc_error(error)

    def answer(self, value: Any) -> None:
        """Answers the last motion."""
        self._out.put(self._answer(value))

    def fail(self, error: BaseException) -> None:
        """The peer cannot answer the last motion; the step fails with this text."""
        self._out.put(self._failure(error))

    def _beat(self, own: Optional[float], servers: Optional[float]) -> None:
        """Sends signs of life, and looks for those of the server."""
        count = 0
        while not self._closing.wait(min(t for t in (own, servers) if t is not None) / 3):
            since = self._waiting_since
            if servers is not None and since is not None and time.monotonic() - since > servers:
                self.error = Unavailable(f"the server was silent for {servers} s", grpc.StatusCode.UNAVAILABLE)
                self._stream.cancel()
                return
            if own is not None:
                count += 1
                self._out.put(pb.PeerMessage(heartbeat=pb.Heartbeat(count=count)))

    def _serve(self) -> None:
        assert self._function is not None
        for motion in self._motions():
            try:
                self.answer(self._function(motion))
            except BaseException as error:  # whatever the user's code raises becomes a failed step with this text
                self.fail(error)
