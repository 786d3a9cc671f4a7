"""Stubs of an earlier state of the proto files, made from its descriptor set: what a client that nobody has updated sends and understands."""
import types

from google.protobuf import descriptor_pool, message_factory

from additions import read


class Frozen:
    """The messages by name, and stubs for a channel."""

    def __init__(self, path):
        pool = descriptor_pool.DescriptorPool()
        self._files = read(path).file
        for file in self._files:
            pool.Add(file)
        factory = message_factory.MessageFactory(pool)
        self._pool, self._class = pool, factory.GetPrototype

    def __getattr__(self, name):
        return self._class(self._pool.FindMessageTypeByName(f"mbcosim.v1.{name}"))

    def stub(self, channel, service):
        """The methods of a service."""
        descriptor = self._pool.FindServiceByName(f"mbcosim.v1.{service}")
        return types.SimpleNamespace(**{m.name: self._method(channel, m) for m in descriptor.methods})

    def _method(self, channel, method):
        proto = next(m for f in self._files for s in f.service for m in s.method if f"{f.package}.{s.name}.{m.name}" == method.full_name)
        kind = ("stream" if proto.client_streaming else "unary") + ("_stream" if proto.server_streaming else "_unary")
        request, reply = self._class(method.input_type), self._class(method.output_type)
        return getattr(channel, kind)(f"/{method.containing_service.full_name}/{method.name}", request_serializer=request.SerializeToString,
                                      response_deserializer=reply.FromString)
