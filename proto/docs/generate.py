#!/usr/bin/env python3
"""Writes the reference of the protocol from the comments of its files, and the catalogue of reasons with their remedies.

usage: generate.py [--check]     with --check nothing is written; tells what would change and ends with 1
"""
import pathlib
import re
import subprocess
import sys
import tempfile

from google.protobuf import descriptor_pb2 as pb

HERE = pathlib.Path(__file__).resolve().parent
PROTO = HERE.parent
FILES = ["simulations", "coupling", "coupling_types", "telemetry", "geometry", "results", "events", "reduction", "record", "common"]
NOTE = "<!-- Written by proto/docs/generate.py from the comments of the .proto files; change those. -->\n"
TYPES = {value: name[5:].lower() for name, value in pb.FieldDescriptorProto.Type.items()}


def described():
    """FileDescriptorProto of every file, with comments."""
    with tempfile.NamedTemporaryFile() as out:
        subprocess.run(["protoc", f"-I{PROTO}", "--include_source_info", f"--descriptor_set_out={out.name}",
                        *(f"mbcosim/v1/{name}.proto" for name in FILES)], check=True)
        return {file.name.split("/")[-1].split(".")[0]: file for file in pb.FileDescriptorSet.FromString(pathlib.Path(out.name).read_bytes()).file}


def comments(file):
    """Text of the comment before each element, by its path."""
    return {tuple(place.path): re.sub(r"(?m)^ ", "", place.leading_comments).strip() for place in file.source_code_info.location}


def line(text):
    """A comment as one line of a table."""
    return re.sub(r"\s*\n\s*", " ", text).replace("|", "\\|")


def anchor(name):
    return re.sub(r"[^\w-]", "", name.lower())


def type_of(field, maps, known):
    if field.type_name.split(".")[-1] in maps:
        key, value = maps[field.type_name.split(".")[-1]]
        return f"map of {TYPES[key.type]} to {type_of(value, {}, known)}"
    name = field.type_name.split(".")[-1]
    shown = (f"[{name}](#{anchor(name)})" if name in known else f"`{field.type_name.lstrip('.')}`") if field.type_name else TYPES[field.type]
    if field.label == field.LABEL_REPEATED:
        return f"repeated {shown}"
    return f"optional {shown}" if field.proto3_optional else shown


def message_text(message, path, said, known):
    maps = {n.name: (n.field[0], n.field[1]) for n in message.nested_type if n.options.map_entry}
    yield f"### {message.name}\n\n{said.get(path, '')}\n"
    if not message.field:
        return
    yield "| Field | Type | |\n|---|---|---|"
    for k, field in enumerate(message.field):
        of = f" (one of `{message.oneof_decl[field.oneof_index].name}`)" if field.HasField("oneof_index") and not field.proto3_optional else ""
        yield f"| `{field.name}` {field.number}{of} | {type_of(field, maps, known)} | {line(said.get((*path, 2, k), ''))} |"
    yield ""


def enum_text(enum, path, said):
    yield f"### {enum.name}\n\n{said.get(path, '')}\n\n| Value | |\n|---|---|"
    for k, value in enumerate(enum.value):
        yield f"| `{value.name}` {value.number} | {line(said.get((*path, 2, k), ''))} |"
    yield ""


def service_text(service, path, said, known):
    yield f"### {service.name}\n\n{said.get(path, '')}\n"
    for k, method in enumerate(service.method):
        sides = []
        for streams, name in ((method.client_streaming, method.input_type), (method.server_streaming, method.output_type)):
            name = name.split(".")[-1]
            sides.append(("stream of " if streams else "") + (f"[{name}](#{anchor(name)})" if name in known else f"`{name}`"))
        yield f"#### {service.name}.{method.name}\n\n{sides[0]} → {sides[1]}\n\n{said.get((*path, 2, k), '')}\n"


def reference(files):
    """The page, as text."""
    known = {element.name for file in files.values() for element in [*file.message_type, *file.enum_type]}
    parts = [NOTE, "# Reference of the protocol", "",
             "Package `mbcosim.v1`: services, then messages and enumerations, file by file, with field numbers. "
             "Errors carry a [reason](REASONS.md).", ""]
    for name in FILES:
        file, said = files[name], comments(files[name])
        parts += [f"## {name}.proto", ""]
        for k, service in enumerate(file.service):
            parts += service_text(service, (6, k), said, known)
        for k, message in enumerate(file.message_type):
            parts += message_text(message, (4, k), said, known)
        for k, enum in enumerate(file.enum_type):
            parts += enum_text(enum, (5, k), said)
    return "\n".join(parts).rstrip() + "\n"


def reasons(files):
    """The catalogue; every reason needs a remedy, and no other has one."""
    remedies = dict(row.split("\t") for row in (HERE / "remedies.tsv").read_text().splitlines())
    file, said = files["common"], comments(files["common"])
    number, enum = next((k, e) for k, e in enumerate(file.enum_type) if e.name == "Reason")
    rows = []
    for k, value in enumerate(enum.value):
        name = value.name[len("REASON_"):]
        if name == "UNSPECIFIED":
            continue
        meaning, code = re.fullmatch(r"(.*) ([A-Z_]+)\.", line(said[(5, number, 2, k)])).groups()
        if name not in remedies:
            sys.exit(f"proto/docs/remedies.tsv: there is no remedy for {name}")
        rows.append(f"| `{name}` | {code} | {meaning} | {remedies.pop(name)} |")
    if remedies:
        sys.exit(f"proto/docs/remedies.tsv: there is no reason {', '.join(remedies)}")
    return "\n".join([NOTE, "# Reasons of errors, and what to do", "",
                      "A call that fails ends with a code of gRPC and a text; `google.rpc.ErrorInfo` among its details names the reason, and "
                      "particulars as metadata. In Python they are `error.code`, `error.reason`, `error.metadata`; over HTTP they are in the "
                      "body. [Troubleshooting](../../client_examples/docs/troubleshooting.md) starts from what you see.", "",
                      "| Reason | Code | What it says | What to do |", "|---|---|---|---|", *rows]) + "\n"


def main():
    files = described()
    stale = []
    for name, text in (("REFERENCE.md", reference(files)), ("REASONS.md", reasons(files))):
        page = HERE / name
        if page.exists() and page.read_text() == text:
            continue
        stale.append(name)
        if "--check" not in sys.argv:
            page.write_text(text)
    if stale and "--check" in sys.argv:
        sys.exit(f"proto/docs: {', '.join(stale)}: not what the .proto files say; run proto/docs/generate.py")


if __name__ == "__main__":
    main()
