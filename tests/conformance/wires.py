"""What carries a scripted peer's messages: the stream, or shared memory read and written here without the library's help."""
import ctypes
import mmap
import os
import platform
import queue
import select
import socket
import struct
import threading
import time

import grpc

from mbcosim.v1 import common_pb2, coupling_pb2 as pb

END = object()  # what receive() gives when the server has ended


class Status:
    """How a server ended: code, and the reason with its particulars."""

    def __init__(self, code, details):
        self.code, self.reason, self.metadata = code, "", {}
        status = common_pb2.ErrorStatus.FromString(details)
        for detail in status.details:
            if detail.type_url.endswith("google.rpc.ErrorInfo"):
                info = common_pb2.ErrorInfo.FromString(detail.value)
                self.reason, self.metadata = info.reason, dict(info.metadata)

    def __repr__(self):
        return f"{grpc_name(self.code)} [{self.reason}]"


def grpc_name(code):
    """"NOT_FOUND" for 5."""
    return next((c.name for c in grpc.StatusCode if c.value[0] == code), str(code))


class StreamWire:
    """Over gRPC."""

    def __init__(self, address):
        self._channel = grpc.insecure_channel(address)
        self._out, self._in = queue.SimpleQueue(), queue.SimpleQueue()
        attach = self._channel.stream_stream("/mbcosim.v1.Coupling/Attach", pb.PeerMessage.SerializeToString,
                                             pb.ServerMessage.FromString)
        self._stream = attach(iter(self._out.get, None))
        self.status = None
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        code, details = 0, b""
        try:
            for message in self._stream:
                self._in.put(message)
        except grpc.RpcError as error:
            code = error.code().value[0]
            details = next((value for key, value in error.trailing_metadata() or () if key == "grpc-status-details-bin"), b"")
        self.status = Status(code, details)
        self._in.put(END)

    def send(self, message):
        self._out.put(message)

    def receive(self, timeout):
        """The next message, END, or None when none comes in time."""
        try:
            return self._in.get(timeout=timeout)
        except queue.Empty:
            return None

    def close(self):
        self._out.put(None)
        self._stream.cancel()
        self._channel.close()


_RING = 1 << 20
_HEADERS, _HEADER = 4096, 256
_WRITTEN, _READ, _DATA_BELL, _SPACE_BELL = 0, 64, 128, 192
_MAGIC = b"mbcosim1"
_FUTEX_CALL = {"x86_64": 202, "aarch64": 98}[platform.machine()]
_FUTEX_WAKE = 1
_LIBC = ctypes.CDLL(None, use_errno=True)


class SharedMemoryWire:
    """Over the rings that a daemon at unix:PATH offers at PATH.shm. Looks for messages instead of sleeping in the kernel."""

    def __init__(self, address, authorization="", seconds=10):
        self._seconds = seconds  # for a message to be taken
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(5)
        self._socket.connect(address[len("unix:"):] + ".shm")
        self._socket.send(_MAGIC + authorization.encode())
        _, fds, _, _ = socket.recv_fds(self._socket, 1 << 16, 1)
        self._memory = mmap.mmap(fds[0], _HEADERS + 2 * _RING)
        os.close(fds[0])
        self._base = ctypes.addressof(ctypes.c_char.from_buffer(self._memory))
        self._read = self._written = 0
        self._buffer = bytearray()
        self.status = None

    def _word(self, ring, at, value=None):
        place = ctypes.c_uint64.from_address(self._base + ring * _HEADER + at)
        if value is not None:
            place.value = value
        return place.value

    def _ring_bell(self, ring, bell):
        rings = ctypes.c_uint32.from_address(self._base + ring * _HEADER + bell)
        sleepers = ctypes.c_uint32.from_address(self._base + ring * _HEADER + bell + 4)
        if sleepers.value:
            rings.value = (rings.value + 1) & 0xFFFFFFFF
            _LIBC.syscall(_FUTEX_CALL, ctypes.byref(rings), _FUTEX_WAKE, 2**31 - 1, None, None, 0)

    def send(self, message):
        data = message.SerializeToString()
        self.write(struct.pack("<I", len(data)) + data)

    def write(self, data):
        """Any bytes, as far as they are taken in time."""
        end = time.monotonic() + self._seconds * float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))
        while data and time.monotonic() < end:
            at = self._written % _RING
            part = data[:min(_RING - at, _RING - (self._written - self._word(1, _READ)))]
            self._memory[_HEADERS + _RING + at:_HEADERS + _RING + at + len(part)] = part
            self._written += len(part)
            self._word(1, _WRITTEN, self._written)
            self._ring_bell(1, _DATA_BELL)
            data = data[len(part):]

    def overwrite(self, ring, at, value):
        """A word of the header of a ring."""
        self._word(ring, at, value)
        self._ring_bell(1, _DATA_BELL)
        self._ring_bell(0, _SPACE_BELL)

    def _take(self):
        count = self._word(0, _WRITTEN) - self._read
        while count:
            at = self._read % _RING
            part = min(count, _RING - at)
            self._buffer += self._memory[_HEADERS + at:_HEADERS + at + part]
            self._read += part
            count -= part
            self._word(0, _READ, self._read)
            self._ring_bell(0, _SPACE_BELL)
        if len(self._buffer) < 4:
            return None
        size, = struct.unpack_from("<I", self._buffer)
        if len(self._buffer) < 4 + size:
            return None
        message = pb.ServerMessage.FromString(bytes(self._buffer[4:4 + size]))
        del self._buffer[:4 + size]
        return message

    def receive(self, timeout):
        end = time.monotonic() + timeout
        while True:
            message = self._take()
            if message is not None:
                return message
            if self.status is None and select.select([self._socket], [], [], 0)[0]:
                last = self._socket.recv(1 << 16)
                self.status = Status(last[len(_MAGIC)], last[len(_MAGIC) + 1:]) if last.startswith(_MAGIC) else Status(14, b"")
                continue  # messages that came before the end
            if self.status is not None:
                return END
            if time.monotonic() > end:
                return None
            time.sleep(1e-4)

    def close(self):
        self._socket.close()


def open_wire(address, transport):
    """A wire to the server at `address`."""
    return {"stream": StreamWire, "shared_memory": SharedMemoryWire}[transport](address)
