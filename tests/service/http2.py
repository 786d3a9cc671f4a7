"""HTTP/2 by hand, for what no gRPC client does: messages that are begun and not completed, calls that are reset at once."""
import contextlib
import select
import socket
import struct
import threading
import time

DATA, HEADERS, RESET, SETTINGS, PING, WINDOW = 0, 1, 3, 4, 6, 8
FRAME, WINDOW_BYTES = 16384, 65535  # HTTP/2's defaults
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def header(name, value):
    """Literal, without indexing."""
    return b"\0" + bytes([len(name)]) + name + bytes([len(value)]) + value


def headers_of(method):
    """Of a call, as they are sent."""
    fields = [(b":method", b"POST"), (b":scheme", b"http"), (b":path", method.encode()), (b":authority", b"localhost"),
              (b"content-type", b"application/grpc"), (b"te", b"trailers")]
    return b"".join(header(*field) for field in fields)


def flood(address, method, seconds, resets, count=1 << 29):
    """Makes calls over one connection to "unix:PATH" or "HOST:PORT", as many and as fast as the server reads them, and resets each at once,
    or never acknowledges how many there may be; how many were sent, and whether the server broke off."""
    block, at_once, start = headers_of(method), 100, time.monotonic()
    end = 0 if resets else 1  # END_STREAM: no message comes
    with connect(address) as connection, contextlib.suppress(ConnectionError):
        threading.Thread(target=read_to_the_end, args=[connection.dup()], daemon=True).start()
        connection.sendall(PREFACE + frame(SETTINGS, 0, 0))
        for first in range(0, count, at_once):
            if time.monotonic() - start - seconds > 0:
                return first, False
            calls = range(2 * first + 1, 2 * min(first + at_once, count) + 1, 2)
            try:
                connection.sendall(b"".join(frame(HEADERS, 4 | end, call, block) +
                                            (frame(RESET, 0, call, b"\0\0\0\x08") if resets else b"") for call in calls))
            except ConnectionError:
                return first, True
        connection.shutdown(socket.SHUT_WR)
    return count, False


def connect(address):
    if not address.startswith("unix:"):
        host, port = address.rsplit(":", 1)
        return socket.create_connection((host.strip("[]"), int(port)))
    connection = socket.socket(socket.AF_UNIX)
    connection.connect(address[len("unix:"):])
    return connection


def read_to_the_end(connection):
    with connection, contextlib.suppress(OSError):
        while connection.recv(1 << 20):
            pass


class HalfMessages:
    """`claimed` bytes are announced on each stream, `sent` of them come."""

    def __init__(self, path, method, streams, claimed, sent):
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.connect(path)
        self._socket.setblocking(False)
        block = headers_of(method)
        self._out = bytearray(PREFACE + frame(SETTINGS, 0, 0))
        self._in = bytearray()
        self._window, self._first_window = WINDOW_BYTES, WINDOW_BYTES
        self._windows = {1 + 2 * k: WINDOW_BYTES for k in range(streams)}
        self._left = {stream: sent for stream in self._windows}
        for stream in self._windows:
            self._out += frame(HEADERS, 4, stream, block)
        self._prefix = b"\0" + struct.pack(">I", claimed)
        self._begun = set()
        self.sent = 0

    def push(self, seconds):
        """Sends what the server lets in, for so long; the number of streams that it has not broken off."""
        start = time.monotonic()
        with contextlib.suppress(ConnectionError):
            while time.monotonic() - start - seconds < 0 and any(self._left.values()):
                self._fill()
                readable, writable, _ = select.select([self._socket], [self._socket] if self._out else [], [], 0.05)
                if writable:
                    del self._out[:self._socket.send(self._out)]
                if readable:
                    received = self._socket.recv(1 << 20)
                    if not received:
                        break
                    self._in += received
                    self._take_frames()
        return len(self._left)

    def close(self):
        self._socket.close()

    def _fill(self):
        for stream in self._left:
            while len(self._out) < 1 << 20:
                count = min(FRAME, self._windows[stream], self._window, self._left[stream])
                if count < len(self._prefix):
                    break
                prefix = b"" if stream in self._begun else self._prefix
                self._begun.add(stream)
                self._out += frame(DATA, 0, stream, prefix + bytes(count - len(prefix)))
                self._windows[stream] -= count
                self._window -= count
                self._left[stream] -= count
                self.sent += count

    def _take_frames(self):
        while len(self._in) >= 9 and len(self._in) >= 9 + int.from_bytes(self._in[:3], "big"):
            length, kind, flags = int.from_bytes(self._in[:3], "big"), self._in[3], self._in[4]
            stream = int.from_bytes(self._in[5:9], "big") & 0x7fffffff
            payload = bytes(self._in[9:9 + length])
            del self._in[:9 + length]
            self._take(kind, flags, stream, payload)

    def _take(self, kind, flags, stream, payload):
        if kind == SETTINGS and not flags & 1:
            for at in range(0, len(payload), 6):
                key, value = struct.unpack(">HI", payload[at:at + 6])
                if key == 4:  # the first window of a stream
                    for one in self._windows:
                        self._windows[one] += value - self._first_window
                    self._first_window = value
            self._out += frame(SETTINGS, 1, 0)
        elif kind == PING and not flags & 1:
            self._out += frame(PING, 1, 0, payload)
        elif kind == WINDOW and stream == 0:
            self._window += int.from_bytes(payload, "big")
        elif kind == WINDOW and stream in self._windows:
            self._windows[stream] += int.from_bytes(payload, "big")
        elif kind == RESET or kind == HEADERS and flags & 1:
            self._left.pop(stream, None)
