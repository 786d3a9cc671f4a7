"""Decks on disk as bundles to upload."""
from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from typing import Union

from mbcosim.v1 import common_pb2, reduction_pb2, simulations_pb2

Path = Union[str, "os.PathLike[str]"]
CHUNK_BYTES = 1 << 20
_QUOTED = re.compile(rb'"([^"\n]{1,1000})"')


def collect(deck: Path) -> tuple[str, dict[str, bytes]]:
    """Name of the main file, and the bytes of it, of `NAME.view.json` beside it, and of every file below its folder that they name in quotes, by name."""
    folder = os.path.realpath(os.path.dirname(os.path.abspath(deck)))
    main = os.path.basename(deck)
    files: dict[str, bytes] = {}
    view = os.path.splitext(main)[0] + ".view.json"
    waiting = [main, view] if os.path.isfile(os.path.join(folder, view)) else [main]
    while waiting:
        name = waiting.pop()
        if name in files:
            continue
        with open(os.path.join(folder, name), "rb") as file:
            files[name] = file.read()
        for quoted in _QUOTED.findall(files[name]):
            waiting += _names_of(quoted.decode(errors="replace"), os.path.dirname(name), folder)
    return main, files


def _names_of(text: str, current: str, folder: str) -> list[str]:
    """Names within the bundle that a quoted text may stand for: relative to the including file or to the deck."""
    found = []
    for base in {current, ""}:
        name = os.path.normpath(os.path.join(base, text))
        path = os.path.realpath(os.path.join(folder, name))
        inside = not os.path.isabs(name) and name.split(os.sep)[0] != ".." and os.path.commonpath([folder, path]) == folder
        if inside and os.path.isfile(path):
            found.append(name.replace(os.sep, "/"))
    return found


def collect_job(job: Path) -> tuple[str, dict[str, bytes]]:
    """Name of a job file of the reduction, and the bytes of it and of the files beside it that it names, by name."""
    folder, main = os.path.split(os.path.abspath(job))
    with open(job, "rb") as file:
        files = {main: file.read()}
    for line in files[main].decode(errors="replace").splitlines():
        _, equal, value = line.split("#")[0].partition("=")
        path = os.path.join(folder, value.strip())
        if equal and value.strip() and os.path.isfile(path):
            with open(path, "rb") as file:
                files[value.strip()] = file.read()
    return main, files


def checked(files: Mapping[str, bytes]) -> Mapping[str, bytes]:
    """Files of a bundle; TypeError for those that are no bytes."""
    for name, data in files.items():
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise TypeError(f"the file {name!r} of a bundle must be bytes, got a {type(data).__name__}"
                            + (": say text.encode()" if isinstance(data, str) else ""))
    return {name: bytes(data) for name, data in files.items()}


def check_state(data: object) -> None:
    """TypeError for a saved state that is no bytes."""
    if not isinstance(data, bytes):
        raise TypeError(f"a saved state must be bytes, got a {type(data).__name__}")


def _chunks(files: Mapping[str, bytes]) -> Iterator[common_pb2.FileChunk]:
    for name, data in files.items():
        for start in range(0, max(len(data), 1), CHUNK_BYTES):
            yield common_pb2.FileChunk(path=name, data=data[start:start + CHUNK_BYTES])


def requests(header: simulations_pb2.UploadHeader, files: Mapping[str, bytes]) -> Iterator[simulations_pb2.UploadRequest]:
    """The messages of an upload."""
    yield simulations_pb2.UploadRequest(header=header)
    for chunk in _chunks(files):
        yield simulations_pb2.UploadRequest(chunk=chunk)


def reduce_requests(header: reduction_pb2.ReduceHeader, files: Mapping[str, bytes]) -> Iterator[reduction_pb2.ReduceRequest]:
    """The messages of a reduction."""
    yield reduction_pb2.ReduceRequest(header=header)
    for chunk in _chunks(files):
        yield reduction_pb2.ReduceRequest(chunk=chunk)
