"""Connections to a server. Every call takes `timeout=` [s]."""
import os
import threading

import grpc

from mbcosim.v1 import simulations_pb2

from .calls import ServerCalls
from .errors import translated
from .rpc import CHANNEL_OPTIONS, PARTING, Connection, blocking, runs_calls
from .simulation import Simulation


def default_address():
    """The socket that `mbcosimd` listens on by default, or $MBCOSIM_ADDRESS."""
    if os.environ.get("MBCOSIM_ADDRESS"):
        return os.environ["MBCOSIM_ADDRESS"]
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"unix:{runtime}/mbcosim.sock" if runtime else f"unix:/tmp/mbcosim-{os.getuid()}/mbcosim.sock"


def connect(address=None, *, token=None, credentials=None, timeout=10.0, reconnect=0.0):
    """A connection to the server at `address` ("unix:PATH" or "HOST:PORT"); waits until it answers.

    token        bearer token
    credentials  grpc.ChannelCredentials for TLS
    timeout      seconds until Unavailable is raised
    reconnect    seconds for which calls that may be repeated are tried again when the server cannot be reached
    """
    server = Server(address or default_address(), token, credentials, reconnect)
    try:
        with translated():
            server.simulations.GetServerInfo(simulations_pb2.GetServerInfoRequest(), metadata=server.metadata, timeout=timeout,
                                             wait_for_ready=True)
    except Exception:
        server.close()
        raise
    return server


@runs_calls(blocking)
class Server(ServerCalls):
    """A connection. Use it as a context manager, or call close()."""
    _simulation_class = Simulation

    def __init__(self, address, token=None, credentials=None, reconnect=0.0):
        channel = (grpc.secure_channel(address, credentials, CHANNEL_OPTIONS) if credentials
                   else grpc.insecure_channel(address, CHANNEL_OPTIONS))
        self.address = address
        self._connection = Connection(channel, token, reconnect)
        self.metadata = self._connection.metadata
        stubs = self._connection.stubs
        self.simulations, self.reduction, self.coupling, self.telemetry = (
            stubs.simulations, stubs.reduction, stubs.coupling, stubs.telemetry)

    @property
    def _channel(self):
        return self._connection.channel

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Closes the connection. Simulations on the server live on for their lease."""
        closing = threading.Thread(target=self._channel.close, daemon=True)  # waits for calls that a silent server holds
        closing.start()
        closing.join(PARTING)
