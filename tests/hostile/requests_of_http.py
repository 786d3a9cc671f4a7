"""Random requests for the HTTP door: calls of the service as Connect and gRPC-Web have them, and the same with something wrong."""
import base64
import struct

from google.protobuf import json_format

TYPES = ["application/json", "application/proto", "application/connect+json", "application/connect+proto", "application/grpc-web",
         "application/grpc-web+json", "application/grpc-web-text", "text/plain", "application/json; charset=latin-1", ""]
JSONS = [b"", b"{", b"null", b"[]", b'"x"', b"{}{}", b'{"simulation": 1e999}', b"[" * 20000, b'{"a":' * 5000, b'{"steps": "1e3"}', b"\xff\xfe{}",
         b'{"simulation": "\\ud800"}']


class Requests:
    """`fuzzer` makes the messages; `methods`: (service, method) descriptors; `get_class`: from a descriptor to its class."""

    def __init__(self, random, fuzzer, door, token, methods, get_class):
        self.random, self.fuzzer, self.door, self.token, self.methods, self.get_class = random, fuzzer, door, token, methods, get_class

    def body(self, method, content_type):
        if self.random.random() < 0.1:
            return self.random.choice(JSONS)
        message = self.fuzzer.message(self.get_class(method.input_type))
        try:
            body = json_format.MessageToJson(message).encode() if "json" in content_type else message.SerializeToString()
        except (json_format.Error, ValueError):  # a time or duration out of its range has no JSON
            body = b"{}"
        if "connect+" in content_type or "grpc-web" in content_type:
            length = len(body) if self.random.random() < 0.9 else self.random.choice([0, 1, 2**31, 2**32 - 1])
            body = struct.pack(">BI", self.random.choice([0, 0, 0, 1, 2, 128, 255]), length) + body
        return base64.b64encode(body) if content_type.endswith("text") else body

    def request(self):
        if self.random.random() < 0.1:
            return self.framed("POST", "/mbcosim.v1.Simulations/GetServerInfo", "application/json", b"{}")
        service, method = self.random.choice(self.methods)
        content_type = self.random.choice(TYPES)
        path = self.random.choice([f"/{service.full_name}/{method.name}"] * 9
                                  + ["/", "/healthz", "/metrics", "/../../etc/passwd", "/%00", "/?token=x", "*"])
        verb = self.random.choice(["POST"] * 12 + ["GET", "PUT", "OPTIONS", "HEAD", "TRACE", "CONNECT", "post", ""])
        return self.framed(verb, path, content_type, self.body(method, content_type))

    def framed(self, verb, path, content_type, body):
        token = self.token if self.random.random() < 0.9 else "x" * self.random.choice([0, 1, 9000])
        lines = [f"{verb} {path} HTTP/1.1", f"Host: {self.door if self.random.random() < 0.97 else 'evil.example'}",
                 f"Authorization: Bearer {token}", f"Content-Type: {content_type}"]
        if self.random.random() < 0.9:
            lines.append("Connection: close")
        if self.random.random() < 0.2:
            lines.append(self.random.choice(["Connect-Timeout-Ms: 5", "Connect-Timeout-Ms: -1", "Grpc-Timeout: 99999999999H", "Origin: null",
                                             "Connection: x", "Expect: 100-continue", "Content-Encoding: gzip", "Cookie: mbcosim=" + "y" * 5000,
                                             "Upgrade: h2c", "Range: bytes=0-1", "X: " + "z" * 20000]))
        if self.random.random() < 0.1:
            body = b"%x\r\n%s\r\n0\r\n\r\n" % (len(body), body)
            lines.append("Transfer-Encoding: chunked")
        else:
            lines.append(f"Content-Length: {len(body) if self.random.random() < 0.95 else self.random.choice([-1, 0, 10**12, 2**64])}")
        return "\r\n".join(lines).encode() + b"\r\n\r\n" + body

    def mangled(self, text):
        at = self.random.randrange(len(text))
        to = self.random.randrange(at, len(text))
        how = self.random.randrange(5)
        if how == 0:
            return text[:at]
        if how == 1:
            return text[:at] + self.random.randbytes(self.random.choice([1, 4, 200])) + text[at:]
        if how == 2:
            return text[:at] + text[to:]
        if how == 3:
            return text[:to] + text[at:]
        return text + self.request()  # one behind the other

    def pieces(self):
        """Bytes of one connection."""
        text = self.request()
        if self.random.random() < 0.4:
            text = self.mangled(text)
        if self.random.random() < 0.8:
            return [text]
        at = self.random.randrange(len(text) + 1)
        return [text[:at], text[at:]]
