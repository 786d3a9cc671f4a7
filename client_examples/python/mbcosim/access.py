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
import re
import shutil
import socket
import stat
import time
import urllib.parse
from typing import Any, Optional, Union

import grpc

from .errors import NotAllowed, TimedOut, Unavailable

_PATIENCE = 2.0  # seconds in which a daemon may appear that was started a moment ago
_ANSWER = 10.0   # seconds that a server may take to answer
_OF_GRPC = re.compile(r"(dns|ipv4|ipv6|unix-abstract|vsock|xds):")  # other forms of addresses
_TOKEN = re.compile("[!-~]+")
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
        return _read(os.environ["MBCOSIM_TOKEN_FILE"], "MBCOSIM_TOKEN_FILE").decode(errors="replace").strip()
    return None


def checked_token(token: Optional[str]) -> Optional[str]:
    """`token`, or the default one; ValueError, which does not show it, for what cannot travel."""
    chosen = token or default_token()
    if chosen and not (isinstance(chosen, str) and _TOKEN.fullmatch(chosen)):
        raise ValueError("the token has characters that none can have: expected printable ones of ASCII, without blanks and ends of lines")
    return chosen


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


def reached(address: Optional[str]) -> str:
    """The address to connect to: `address`, or the default one. ValueError for what can be none, NotAllowed where strangers may answer."""
    if not address and not os.environ.get("MBCOSIM_ADDRESS"):
        _check_default_folder(default_address())
    chosen = address or default_address()
    fault = _fault_of_socket(chosen[len("unix:"):]) if chosen.startswith("unix:") else None if _OF_GRPC.match(chosen) else _fault_of_host(chosen)
    if fault is not None:
        raise ValueError(f"the address {chosen!r} {fault}")
    return chosen


def target(address: str) -> str:
    """`address` as gRPC takes it: for it `%`, `#` and `?` in the path of a socket mean something."""
    return f"unix:{urllib.parse.quote(os.fsencode(address[len('unix:'):]))}" if address.startswith("unix:") else address


def _fault_of_socket(path: str) -> Optional[str]:
    size = len(os.fsencode(path))
    if not path.strip("/"):
        return "names no socket: expected unix:PATH"
    if "," in path:
        return "has a comma in the path of a socket, for gRPC the beginning of another one: choose a path without"
    return f"is too long: the path of a socket has at most 107 bytes, this one {size}" if size > 107 else None


def _fault_of_host(address: str) -> Optional[str]:
    host, colon, port = address.rpartition(":")
    if address.startswith(("http://", "https://")):
        return "is that of a page, or of calls over HTTP: expected the one that the daemon listens on (--listen), unix:PATH or HOST:PORT"
    if "://" in address:
        return "has a scheme that is not known here: expected unix:PATH or HOST:PORT"
    if "/" in address:
        return f"is a path without `unix:` before it: say 'unix:{address}'"
    if not colon:
        return "has no port, nor `unix:` before it: expected HOST:PORT or unix:PATH"
    if not (port.isascii() and port.isdecimal() and 0 < int(port) < 65536):
        return f"has the port {port!r}: expected a number from 1 to 65535"
    if not host:
        return f"has no host before its port: say 'localhost:{port}' for this machine"
    return "has colons in its host: expected [HOST]:PORT for one of IPv6" if ":" in host and not host.startswith("[") else None


def _check_default_folder(address: str) -> None:
    """As the daemon does that makes it: in /tmp anybody may have made the folder, and a daemon of theirs would answer there."""
    folder = os.path.dirname(address[len("unix:"):])
    if not folder.startswith("/tmp/") or not os.path.lexists(folder):
        return
    parents = {parent for path in (os.path.abspath(folder), os.path.realpath(folder)) for parent in pathlib.Path(path).parents}
    for place in [folder, *sorted(map(str, parents), reverse=True)]:
        fault = _fault_of_folder(place, shared=place != folder)
        if fault:
            raise NotAllowed(f"others may have put the default socket {address} where it is: the folder {place} {fault}. Remove it, or say where the "
                             "daemon is: with an address, $MBCOSIM_ADDRESS or $XDG_RUNTIME_DIR")


def _fault_of_folder(folder: str, shared: bool) -> Optional[str]:
    """What lets strangers replace what is in a folder; one that is `shared` may be sticky."""
    for info in (os.lstat(folder), os.stat(folder)):
        if info.st_uid not in (0, os.geteuid()):
            return f"belongs to user {info.st_uid}, neither root nor this one ({os.geteuid()})"
    if info.st_mode & 0o022 and not (shared and info.st_mode & stat.S_ISVTX):
        return "may be written by others"
    return None


def _why_nobody(address: str) -> tuple[str, bool]:
    """Why nobody can be there, empty where that cannot be told at once; and would a daemon that is started help?"""
    path = address[len("unix:"):] if address.startswith("unix:") else None
    try:
        if path is not None:
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as plain:
                plain.settimeout(1.0)
                plain.connect(path[2:] if path.startswith("//") else path)
        else:
            host, _, port = address.rpartition(":")
            socket.create_connection((host.strip("[]"), int(port)), timeout=1.0).close()
    except (FileNotFoundError, NotADirectoryError):
        return "there is no such socket" + ("" if os.path.isdir(os.path.dirname(path or "") or ".") else ", nor its folder"), True
    except ConnectionRefusedError:
        if path is not None and not stat.S_ISSOCK(os.stat(path).st_mode):
            return "that is no socket", False
        return "nobody accepts connections there", True
    except PermissionError:
        return "this user may not open that socket", False
    except socket.gaierror as error:
        return f"no host is known by that name ({error.strerror})", False
    except (OSError, ValueError):
        pass
    return "", False


def nobody_there(address: str, detail: str) -> str:
    """What to say when nobody answers at an address."""
    why, helps = _why_nobody(address)
    if not why:
        return f"the server at {address} does not answer as it should: {detail}{_question(address, detail)}"
    if not helps:
        return f"no server can be reached at {address}: {why}"
    usual = address == default_address() and not os.environ.get("MBCOSIM_ADDRESS")
    how = "mbcosimd" if usual else f"mbcosimd --listen {address}" + ("" if address.startswith("unix:") else " --tokens FILE")
    return (f"no daemon listens at {address}: {why}. Start one in a terminal with `{how} &`, or use mbcosim.local(), which starts a private one "
            "and ends it; connect(timeout=30) waits for one that is starting")


def _question(address: str, detail: str) -> str:
    """What may be wrong where somebody listens."""
    if address.startswith("unix:"):
        return ""
    if "http1" in detail:
        return "; is that the port of the page (--http)? This client needs one of --listen"
    return "; does the server use TLS (`tls=True`, `ca=`), or this client while it does not?"


class Attempts:
    """First calls of a server: while nobody listens they are repeated for `timeout` seconds (None: for a moment)."""
    PAUSE = 0.2  # between two [s]

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
