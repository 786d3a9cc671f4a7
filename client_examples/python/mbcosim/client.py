"""Connections to a server. Every call takes `timeout=` [s]."""
from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from typing import Any, Optional, TypeVar

import grpc

from mbcosim.v1 import simulations_pb2

from . import access
from .calls import ServerCalls
from .errors import Unavailable, translated
from .events import Events
from .rpc import PARTING, USUAL, Blocking, Connection, InUse, blocking, channel_options, runs_calls
from .simulation import Simulation

Self = TypeVar("Self", bound="Server")


def connect(address: Optional[str] = None, *, token: Optional[str] = None, tls: Optional[bool] = None, ca: Optional[access.Path] = None,
            certificate: Optional[access.Path] = None, key: Optional[access.Path] = None, credentials: Any = None,
            timeout: Optional[float] = None, reconnect: float = 0.0) -> Server:
    """A connection to the server at `address` ("unix:PATH" or "HOST:PORT"; default: $MBCOSIM_ADDRESS, or the socket of this user's daemon).

    token        bearer token; default: $MBCOSIM_TOKEN, or what the file $MBCOSIM_TOKEN_FILE holds
    tls          True: TLS; default: where $MBCOSIM_TLS is 1 or one of the next is given
    ca           PEM file of the authority that signed the server's certificate; default: $MBCOSIM_TLS_CA, or those this machine trusts
    certificate  PEM file of the client's own certificate, `key` that of its key; default: $MBCOSIM_TLS_CERTIFICATE, $MBCOSIM_TLS_KEY
    credentials  grpc.ChannelCredentials instead of the four before
    timeout      seconds to wait for a server that is starting; without, Unavailable is raised as soon as nobody listens there
    reconnect    seconds for which calls that may be repeated are tried again when the server cannot be reached. Streams (peers, steppers,
                 subscriptions, events) end with it: a peer comes back by `couple(..., step=peer.step)`, see coupling.Peer
    """
    secured = credentials or access.credentials(tls, ca, certificate, key)
    server = Server(access.reached(address), access.checked_token(token), secured, reconnect)
    try:
        await_answer(server, timeout)
    except Exception:
        server.close()
        raise
    return server


def await_answer(server: Server, timeout: Optional[float], check: Callable[[], object] = lambda: None) -> simulations_pb2.GetServerInfoReply:
    """Waits until a server answers; see access.Attempts. `check` raises when there is nobody to wait for."""
    attempts = access.Attempts(server.address, timeout)

    def ask(seconds: float, waits: bool) -> simulations_pb2.GetServerInfoReply:
        with translated():
            info: simulations_pb2.GetServerInfoReply = server.simulations.GetServerInfo(
                simulations_pb2.GetServerInfoRequest(), metadata=server.metadata, timeout=seconds, wait_for_ready=waits)
            return info

    while True:
        try:
            return ask(attempts.left(), waits=False)
        except Unavailable as error:
            check()
            attempts.again(error)
        # gRPC looks after its connections while a call waits; in a pause without one, only every 5 s.
        with contextlib.suppress(Unavailable):
            return ask(attempts.PAUSE, waits=True)


@runs_calls(blocking)
class Server(Blocking, ServerCalls[Simulation]):
    """A connection. Use it as a context manager, or call close()."""
    _simulation_class = Simulation

    def __init__(self, address: str, token: Optional[str] = None, credentials: Any = None, reconnect: float = 0.0) -> None:
        InUse.check()
        options = channel_options(address)
        target = access.target(address)
        channel = grpc.secure_channel(target, credentials, options) if credentials else grpc.insecure_channel(target, options)
        self.address = address
        self._connection = Connection(channel, token, reconnect)
        self.metadata = self._connection.metadata
        stubs = self._connection.stubs
        self.simulations, self.reduction, self.coupling, self.telemetry = (
            stubs.simulations, stubs.reduction, stubs.coupling, stubs.telemetry)

    @property
    def _channel(self) -> Any:
        return self._connection.channel

    def __repr__(self) -> str:
        return f"<mbcosim.Server at {self.address}>"

    def events(self, simulation: str = "", *, after: Optional[int] = None, journal: str = "", timeout: Optional[float] = USUAL) -> Events:
        """Events as they happen, of one simulation (by name) or all that may be seen; see Events. With `after`, a sequence number of `journal`,
        those that came since then, too."""
        return Events(self._connection, simulation, after, journal, timeout)

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection. Simulations on the server live on for their lease."""
        closing = threading.Thread(target=self._connection.close, daemon=True)  # waits for calls that a silent server holds
        closing.start()
        closing.join(PARTING)
