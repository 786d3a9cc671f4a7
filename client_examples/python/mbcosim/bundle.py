"""Decks on disk as bundles to upload."""
import os
import re

from mbcosim.v1 import common_pb2, simulations_pb2

CHUNK_BYTES = 1 << 20
_QUOTED = re.compile(rb'"([^"\n]{1,1000})"')


def collect(deck):
    """Name of the main file, and the bytes of it and of every file below its folder that it names in quotes, by name."""
    folder = os.path.realpath(os.path.dirname(os.path.abspath(deck)))
    main = os.path.basename(deck)
    files, waiting = {}, [main]
    while waiting:
        name = waiting.pop()
        if name in files:
            continue
        with open(os.path.join(folder, name), "rb") as file:
            files[name] = file.read()
        for quoted in _QUOTED.findall(files[name]):
            waiting += _names_of(quoted.decode(errors="replace"), os.path.dirname(name), folder)
    return main, files


def _names_of(text, current, folder):
    """Names within the bundle that a quoted text may stand for: relative to the including file or to the deck."""
    found = []
    for base in {current, ""}:
        name = os.path.normpath(os.path.join(base, text))
        path = os.path.realpath(os.path.join(folder, name))
        inside = not os.path.isabs(name) and not name.startswith("..") and path.startswith(folder + os.sep)
        if inside and os.path.isfile(path):
            found.append(name.replace(os.sep, "/"))
    return found


def requests(header, files):
    """The messages of an upload."""
    yield simulations_pb2.UploadRequest(header=header)
    for name, data in files.items():
        for start in range(0, max(len(data), 1), CHUNK_BYTES):
            chunk = common_pb2.FileChunk(path=name, data=data[start:start + CHUNK_BYTES])
            yield simulations_pb2.UploadRequest(chunk=chunk)
