"""What happens to simulations, as it happens."""
from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Optional

from mbcosim.v1 import events_pb2

from .errors import translated
from .rpc import USUAL, Connection, bounded, until_cancelled


def watch_request(simulation: str, after: Optional[int], journal: str) -> events_pb2.WatchEventsRequest:
    """`mbcosim.v1.WatchEventsRequest`."""
    return events_pb2.WatchEventsRequest(simulation=simulation, after_sequence=after, journal=journal)


class Course:
    """How far a watcher has come: `journal` and `last` let another one go on from there."""
    journal: str
    last: Optional[int]

    def _begin(self, started: events_pb2.Event, after: Optional[int]) -> None:
        self.journal, self.last = started.started.journal, after

    def _take(self, event: events_pb2.Event) -> events_pb2.Event:
        if event.sequence:
            self.last = event.sequence
        return event


class Events(Course):
    """Iterate over `mbcosim.v1.Event`: `event.WhichOneof("content")` tells what happened. Close it, or use it as a context manager."""

    def __init__(self, connection: Connection, simulation: str, after: Optional[int], journal: str, timeout: Optional[float] = USUAL) -> None:
        self._stream: Any = connection.stubs.events.WatchEvents(watch_request(simulation, after, journal), metadata=connection.about(simulation))
        with bounded(timeout, self._stream.cancel, "the beginning of the events"), translated():
            self._begin(next(self._stream), after)  # nothing is missed from now on

    def __enter__(self) -> Events:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[events_pb2.Event]:
        for event in until_cancelled(self._stream):
            yield self._take(event)

    def close(self) -> None:
        """Ends the watching."""
        self._stream.cancel()
