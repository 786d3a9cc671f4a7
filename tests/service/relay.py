"""Relays between clients and a daemon: one that falls silent, and one that loses and repeats messages."""
import os
import random
import select
import socket
import threading
from concurrent import futures

import grpc


class BlackHole:
    """Forwards bytes of a Unix socket until `fall_silent`: from then on nothing passes, and no connection ends; `break_off` ends one."""

    def __init__(self, folder, target):
        self._left, self._upwards = None, True
        self._target, self._silent, self._stop = target[len("unix:"):], threading.Event(), threading.Event()
        path = os.path.join(folder, "relay.sock")
        self.address = f"unix:{path}"
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(path)
        self._listener.listen()
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._threads[0].start()

    def break_off(self, after, upwards):
        """Ends a connection, one time, when more than `after` bytes come over it in one direction; what is over is lost."""
        self._left, self._upwards = after, upwards

    def has_broken(self):
        return self._left is not None and self._left < 0

    def fall_silent(self):
        self._silent.set()

    def close(self):
        self._stop.set()
        for thread in self._threads:
            thread.join(5)
        self._listener.close()

    def _accept(self):
        while not self._stop.is_set():
            if not select.select([self._listener], [], [], 0.05)[0]:
                continue
            client = self._listener.accept()[0]
            server = self._connect()
            if server is None:
                client.close()
                continue
            self._threads.append(threading.Thread(target=self._forward, args=(client, server), daemon=True))
            self._threads[-1].start()

    def _connect(self):
        """The daemon may still be starting."""
        for _ in range(200):
            server = socket.socket(socket.AF_UNIX)
            try:
                server.connect(self._target)
                return server
            except OSError:
                server.close()
            if self._stop.wait(0.05):
                break
        return None

    def _forward(self, client, server):
        other = {client: server, server: client}
        with client, server:
            while not self._stop.is_set():
                if self._silent.is_set():
                    self._stop.wait(0.05)
                    continue
                for ready in select.select([client, server], [], [], 0.05)[0]:
                    try:
                        data = ready.recv(1 << 16)
                        if self._breaks(ready is client, len(data)):
                            return
                        if data and not self._silent.is_set():
                            other[ready].sendall(data)
                    except OSError:
                        data = b""
                    if not data:
                        return

    def _breaks(self, upwards, count):
        if self._left is None or self._left < 0 or upwards != self._upwards:
            return False
        self._left -= count
        return self._left < 0


class Unreliable(grpc.GenericRpcHandler):
    """A relay of unary calls: a part of the requests and of the replies is lost, another part of the requests arrives twice."""

    def __init__(self, folder, target, part, seed):
        self._channel, self._random, self._part = grpc.insecure_channel(target), random.Random(seed), part / 2
        self.lost = self.repeated = 0
        self.address = f"unix:{folder}/unreliable.sock"
        self._server = grpc.server(futures.ThreadPoolExecutor(4), handlers=[self])
        self._server.add_insecure_port(self.address)
        self._server.start()

    def close(self):
        self._server.stop(0).wait()
        self._channel.close()

    def service(self, call):
        method = self._channel.unary_unary(call.method)

        def forward(request, context):
            dice = self._random.random() if call.method.endswith("/Step") else 1.0
            if dice < self._part:
                self.lost += 1
                if self.lost % 2:
                    context.abort(grpc.StatusCode.CANCELLED, "CANCELLED")  # as gRPC answers while its server is being shut down
                context.abort(grpc.StatusCode.UNAVAILABLE, "the request is lost")
            try:
                if dice > 1 - self._part:
                    self.repeated += 1
                    method(request)
                reply = method(request)
            except grpc.RpcError as error:
                context.set_trailing_metadata(error.trailing_metadata())
                context.abort(error.code(), error.details())
            if dice < 2 * self._part:
                self.lost += 1
                context.abort(grpc.StatusCode.UNAVAILABLE, "the reply is lost")
            return reply

        return grpc.unary_unary_rpc_method_handler(forward)
