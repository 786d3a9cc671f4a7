#!/usr/bin/env python3
"""What a set of proto files has lost or changed compared with an earlier one: only additions are allowed.

usage: additions.py OLD.binpb NEW.binpb        descriptor sets as `protoc --descriptor_set_out` writes them
Exit code 1 and one line for each finding when clients of the old one would not understand the new one.
"""
import sys

from google.protobuf import descriptor_pb2

FIELD = descriptor_pb2.FieldDescriptorProto


def parts(descriptor_set):
    """Everything that a client relies on: name and what it is, as comparable values."""
    found = {}
    for file in descriptor_set.file:
        for message in file.message_type:
            found.update(message_parts(f"{file.package}.{message.name}", message))
        for enum in file.enum_type:
            found.update(enum_parts(f"{file.package}.{enum.name}", enum))
        for service in file.service:
            name = f"{file.package}.{service.name}"
            found[name] = "service"
            found.update({f"{name}/{m.name}": ("method", m.input_type, m.output_type, m.client_streaming, m.server_streaming)
                          for m in service.method})
    return found


def message_parts(name, message):
    found = {name: "message"}
    for field in message.field:
        oneof = message.oneof_decl[field.oneof_index].name if field.HasField("oneof_index") else ""
        found[f"{name}.{field.name}"] = ("field", field.number, FIELD.Label.Name(field.label), FIELD.Type.Name(field.type), field.type_name,
                                         field.json_name, oneof)
    for inner in message.nested_type:
        found.update(message_parts(f"{name}.{inner.name}", inner))
    for enum in message.enum_type:
        found.update(enum_parts(f"{name}.{enum.name}", enum))
    return found


def enum_parts(name, enum):
    return {name: "enum", **{f"{name}.{value.name}": ("value", value.number) for value in enum.value}}


def losses(old, new):
    """A line for each part of `old` that is not in `new`, or is another thing there."""
    before, after = parts(old), parts(new)
    return [f"{name}: was {what}, is {after.get(name, 'gone')}" for name, what in before.items() if after.get(name) != what]


def read(path):
    with open(path, "rb") as file:
        return descriptor_pb2.FileDescriptorSet.FromString(file.read())


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    lost = losses(read(sys.argv[1]), read(sys.argv[2]))
    print("\n".join(lost))
    sys.exit(bool(lost))
