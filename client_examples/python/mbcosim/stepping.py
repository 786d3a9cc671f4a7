"""A loop of steps that are asked for one by one: they travel on an open stream, which takes less time than calls."""
from __future__ import annotations

import queue
import threading
import time
from typing import Any, Optional

import grpc

from mbcosim.v1 import simulations_pb2 as pb

_SOON = 0.05  # seconds within which a step follows the one before in a loop
_IDLE = 1.0   # seconds after which the stream is closed: an open one would keep the simulation alive


class StepLine:
    """The stream is opened when steps follow each other quickly, and closed when they do not. What cannot go on it is a call of its own."""

    def __init__(self, stub: Any, metadata: Any) -> None:
        self._stub, self._metadata = stub, metadata
        self._one = threading.Lock()  # who has it steps
        self._state = threading.Lock()  # protects all below
        self._requests: queue.SimpleQueue[Optional[pb.StepRequest]] = queue.SimpleQueue()
        self._replies: Any = None
        self._last, self._allowed = float("-inf"), True

    def step(self, request: pb.StepRequest) -> Optional[pb.StepReply]:
        """The reply; None: make a call of it. Raises grpc.RpcError as a call does: an id that is asked for again is not done again."""
        if not self._one.acquire(blocking=False):
            return None
        try:
            replies = self._open()
            if replies is None:
                return None
            self._requests.put(request)
            try:
                reply: pb.StepReply = next(replies).step
                return reply
            except StopIteration:
                self.close()
                return None
            except grpc.RpcError as error:
                self.close()
                if error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED:  # as many streams as one may have
                    self._allowed = False
                    return None
                raise
            except BaseException:  # the reply of an interrupted step would be taken for the next one's
                self.close()
                raise
        finally:
            self._last = time.monotonic()
            self._one.release()

    def _open(self) -> Any:
        with self._state:
            if self._replies is None and self._allowed and time.monotonic() - self._last < _SOON:
                self._requests = queue.SimpleQueue()
                self._replies = self._stub.StepStream(iter(self._requests.get, None), metadata=self._metadata)
                threading.Thread(target=self._close_when_idle, args=(self._replies,), daemon=True).start()
            return self._replies

    def _close_when_idle(self, replies: Any) -> None:
        while self._replies is replies:
            time.sleep(_IDLE / 2)
            if time.monotonic() - self._last > _IDLE and self._one.acquire(blocking=False):
                try:
                    if self._replies is replies:
                        self.close()
                finally:
                    self._one.release()

    def close(self) -> None:
        """Ends the stream; a later loop opens another one."""
        with self._state:
            replies, self._replies = self._replies, None
            self._requests.put(None)
        if replies is not None:
            replies.cancel()
