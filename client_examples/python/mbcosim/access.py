"""Where the server is, and how a client shows who it is: by arguments, else by the environment.

    MBCOSIM_ADDRESS          unix:PATH or HOST:PORT
    MBCOSIM_TOKEN            bearer token; MBCOSIM_TOKEN_FILE: a file that holds it
    MBCOSIM_TLS              1: TLS, trusting the authorities that this machine trusts
    MBCOSIM_TLS_CA           PEM file of the authority that signed the server's certificate
    MBCOSIM_TLS_CERTIFICATE  PEM file of the client's own certificate, where the server asks for one
    MBCOSIM_TLS_KEY          its key
"""
from __future__ import annotations

import os
import pathlib
import shutil
import socket
import time
from typing import Any, Optional, Union

import grpc

from .errors import TimedOut, Unavailable

_PATIENCE = 2.0  # seconds in which a daemon may appear that was started a moment ago
_ANSWER = 10.0   # seconds that a server may take to answer
Path = Union[str, "os.PathLike[str]"]


def default_address() -> str:
    """The socket that `mbcosimd` listens on by default, or $MBCOSIM_ADDRESS."""
    if os.environ.get("MBCOSIM_ADDRESS"):
        return os.environ["MBCOSIM_ADDRESS"]
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"unix:{runtime}/mbcosim.sock" if runtime else f"unix:/tmp/mbcosim-{os.getuid()}/mbcosim.sock"


def default_token() -> Optional[str]:
    """$MBCOSIM_TOKEN, or the first line of the file $MBCOSIM_TOKEN_FILE."""
    if os.environ.get("MBCOSIM_TOKEN"):
        return os.environ["MBCOSIM_TOKEN"]
    if os.environ.get("MBCOSIM_TOKEN_FILE"):
        return _read(os.environ["MBCOSIM_TOKEN_FILE"], "MBCOSIM_TOKEN_FILE").decode().strip()
    return None


def credentials(tls: Optional[bool], ca: Optional[Path], certificate: Optional[Path], key: Optional[Path]) -> Any:
    """grpc.ChannelCredentials, or None for a plain connection."""
    ca = ca or os.environ.get("MBCOSIM_TLS_CA") or None
    certificate = certificate or os.environ.get("MBCOSIM_TLS_CERTIFICATE") or None
    key = key or os.environ.get("MBCOSIM_TLS_KEY") or None
    if (certificate is None) != (key is None):
        raise ValueError("a client's certificate and its key go together: give both `certificate` and `key`")
    if tls is None:
        tls = ca is not None or certificate is not None or os.environ.get("MBCOSIM_TLS", "") not in ("", "0")
    if not tls:
        return None
    return grpc.ssl_channel_credentials(*(None if path is None else _read(path, what)
                                          for path, what in ((ca, "ca"), (key, "key"), (certificate, "certificate"))))


def _read(path: Path, what: str) -> bytes:
    try:
        return pathlib.Path(path).read_bytes()
    except OSError as error:
        raise ValueError(f"{what}: cannot read {os.fspath(path)!r}: {error.strerror}") from None


def daemon_program(program: Optional[Path] = None) -> str:
    """Path of `mbcosimd`: `program`, or in the folder $MBCOSIM_BIN, or of the build that this package is in, or on the PATH."""
    if program is not None:
        return os.fspath(program)
    folders = [os.environ.get("MBCOSIM_BIN"), pathlib.Path(__file__).resolve().parents[2] / "bin"]
    for folder in folders:
        if folder and os.access(os.path.join(folder, "mbcosimd"), os.X_OK):
            return os.path.join(folder, "mbcosimd")
    found = shutil.which("mbcosimd")
    if found is None:
        raise FileNotFoundError("the program mbcosimd is neither on the PATH nor in $MBCOSIM_BIN: install it, or set MBCOSIM_BIN to the "
                                "folder that holds it (build/bin of a clone)")
    return found


def refuses(address: str) -> bool:
    """Does nobody listen at this address? False where that cannot be told at once."""
    try:
        if address.startswith("unix:"):
            path = address[len("unix:"):]
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as plain:
                plain.settimeout(1.0)
                plain.connect(path[2:] if path.startswith("//") else path)
        else:
            host, _, port = address.rpartition(":")
            socket.create_connection((host.strip("[]"), int(port)), timeout=1.0).close()
    except (FileNotFoundError, ConnectionRefusedError, NotADirectoryError):
        return True
    except (OSError, ValueError):
        return False
    return False


def nobody_there(address: str, detail: str) -> str:
    """What to say when nobody answers at an address."""
    if not refuses(address):
        secured = "" if address.startswith("unix:") else "; does the server use TLS (`tls=True`, `ca=`), or this client while it does not?"
        return f"the server at {address} does not answer as it should: {detail}{secured}"
    how = "mbcosimd &" if address == default_address() and not os.environ.get("MBCOSIM_ADDRESS") else f"mbcosimd --listen {address} &"
    return (f"no daemon listens at {address}. Start one in a terminal with `{how}`, or use mbcosim.local(), which starts a private one "
            "and ends it; connect(timeout=30) waits for one that is starting")


class Attempts:
    """First calls of a server: while nobody listens they are repeated for `timeout` seconds (None: for a moment)."""
    PAUSE = 0.05  # between two [s]

    def __init__(self, address: str, timeout: Optional[float]) -> None:
        self._address, self._waits = address, timeout is not None
        self._timeout = _PATIENCE if timeout is None else timeout
        self._end = time.monotonic() + self._timeout

    def left(self) -> float:
        """Seconds that the next call may take."""
        return max(self._end - time.monotonic(), 0.1) if self._waits else _ANSWER

    def again(self, error: Unavailable) -> None:
        """Raises what a call ended with unless another one is of use."""
        if isinstance(error, TimedOut):
            patience = self._timeout if self._waits else _ANSWER
            raise TimedOut(f"the server at {self._address} did not answer within {patience:g} s", error.code) from None
        if time.monotonic() >= self._end:
            raise Unavailable(nobody_there(self._address, str(error)), error.code, error.reason, error.metadata) from None
