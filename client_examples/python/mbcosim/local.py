"""A private daemon: started for this program, ended with it."""
from __future__ import annotations

import contextlib
import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import weakref
from typing import Any, Optional

from .access import Path, daemon_program
from .client import Server, await_answer
from .errors import Unavailable
from .rpc import PARTING

# The shell ends the daemon when this process writes a line, closes the pipe or dies, however it dies; its own end is that of the daemon.
# Where nobody wrote a line nobody is left to remove the folder, $0, also when the daemon ended before.
_KEEPER = r'''
exec 3<&0
"$@" </dev/null 3<&- &
child=$! left=
trap left=1 HUP
(read -r _ <&3 || kill -HUP "$$"; kill "$child") 2>/dev/null &
reader=$!
wait "$child"
code=$?
if [ -n "$left" ]; then
  wait "$child"
  rm -rf "$0"
elif kill "$reader" 2>/dev/null; then
  (read -r _ <&3 || rm -rf "$0") &
fi
exit "$code"
'''


def local(*options: str, program: Optional[Path] = None, timeout: float = 30.0) -> LocalServer:
    """Starts a daemon that nobody else can reach, and connects to it; closing the connection ends it.

        with mbcosim.local() as server, server.load("pendulum.mbd") as pendulum:
            pendulum.run_until(1.0)

    options  of the daemon: "--workers", "2"; variables MBCOSIMD_… of the environment are of others
    program  path of `mbcosimd`; default: of $MBCOSIM_BIN, of the build, or on the PATH
    timeout  seconds until it must answer
    """
    return LocalServer(daemon_program(program), options, timeout)


class _Daemon:
    """The process and its folder."""

    def __init__(self, program: str, options: tuple[str, ...]) -> None:
        self._starter = os.getpid()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="mbcosim-"))
        if len(os.fsencode(self.folder)) > 80 or "," in str(self.folder):  # of a socket's name: at most 107 bytes, no comma for gRPC
            self.folder.rmdir()
            self.folder = pathlib.Path(tempfile.mkdtemp(prefix="mbcosim-", dir="/tmp"))
        self.address = f"unix:{self.folder}/s"
        command = [program, "--listen", self.address, "--log-level", "warn", "--shutdown-grace", "1", *options]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("MBCOSIMD_")}  # those are of another daemon
        with open(self.folder / "log", "wb") as log:
            self.process = subprocess.Popen(["/bin/sh", "-c", _KEEPER, str(self.folder), *command], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                                            stderr=log, env=environment, start_new_session=True)

    def log(self) -> str:
        """The end of what it wrote."""
        return (self.folder / "log").read_text(errors="replace").strip()[-2000:]

    def check(self) -> None:
        """Unavailable with what it wrote where it has ended."""
        code = self.process.poll()
        if code is not None:
            raise Unavailable(f"the daemon ended with {code} before it served: {self.log()}")

    def stop(self) -> None:
        """Ends it and removes its folder, unless this is a process that was forked from the one that started it."""
        if os.getpid() != self._starter:
            return
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(b"\n")  # forked processes keep the pipe open
            self.process.stdin.close()
        try:
            self.process.wait(PARTING)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, 9)
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


class LocalServer(Server):
    """A connection to a private daemon, which ends with it."""

    def __init__(self, program: str, options: tuple[str, ...], timeout: float) -> None:
        self._daemon = _Daemon(program, options)
        self._stop = weakref.finalize(self, self._daemon.stop)  # also at the program's end
        try:
            self._await_socket(time.monotonic() + timeout)
            super().__init__(self._daemon.address)
            await_answer(self, timeout, self._daemon.check)  # one that cannot serve HTTP, say, ends after it listened
        except Exception:
            self._stop()
            raise

    def _await_socket(self, end: float) -> None:
        while not os.path.exists(self._daemon.address[len("unix:"):]):
            self._daemon.check()
            if time.monotonic() > end:
                raise Unavailable(f"the daemon did not listen in time: {self._daemon.log()}")
            time.sleep(0.005)

    @property
    def process_id(self) -> int:
        """Of the process that keeps the daemon."""
        return self._daemon.process.pid

    def close(self) -> None:
        """Closes the connection and ends the daemon with all its simulations."""
        super().close()
        self._stop()

    def __repr__(self) -> str:
        state = "running" if self._stop.alive and self._daemon.process.poll() is None else "ended"
        return f"<mbcosim.Server private, {state}, {self.address}>"


def connect_or_start(address: Optional[str] = None, **options: Any) -> Server:
    """mbcosim.connect(address), or, where no daemon runs at the default address, a private one."""
    from .client import connect
    if address is not None or os.environ.get("MBCOSIM_ADDRESS"):
        return connect(address, **options)
    try:
        return connect(**options)
    except Unavailable:
        return local()
