#!/usr/bin/env python3
"""Writes pages about the contract, made from the comments in its files: contract.py DESCRIPTORS FOLDER

DESCRIPTORS is what protoc --include_source_info --include_imports writes. FOLDER gets a page for each file of lpdeform.v1, and
an index."""

import pathlib
import re
import sys

from google.protobuf import descriptor_pb2

Field = descriptor_pb2.FieldDescriptorProto
FILE = descriptor_pb2.FileDescriptorProto
MESSAGE, ENUM, SERVICE = (FILE.MESSAGE_TYPE_FIELD_NUMBER, FILE.ENUM_TYPE_FIELD_NUMBER, FILE.SERVICE_FIELD_NUMBER)
SCALARS = {Field.Type.Value(name): name[5:].lower() for name in Field.Type.keys()}
# Service first: it is where to begin.
ORDER = ["service", "handle", "frame", "data", "report"]


def pages_of(descriptors):
    files = [file for file in descriptors.file if file.package == "lpdeform.v1"]
    names = {pathlib.PurePosixPath(file.name).stem: file for file in files}
    return {name: names[name] for name in sorted(names, key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))}


class Comments:
    def __init__(self, file):
        self.at = {tuple(one.path): one.leading_comments or one.trailing_comments for one in file.source_code_info.location}

    def of(self, *path):
        return prose(self.at.get(path, ""))


def prose(comment):
    """Its paragraphs. Lines that are indented become items of a list; one that has two columns begins the next item."""
    lines, is_indented = [], False
    for line in (one[1:] if one.startswith(" ") else one for one in comment.rstrip().splitlines()):
        columns = re.match(r"  (\S+) {2,}(\S.*)$", line)
        if columns:
            lines.append(f"- `{columns[1]}`: {escaped(columns[2])}")
        elif line.startswith("  ") and not is_indented:
            lines.append(f"- {escaped(line.strip())}")
        elif line.startswith("  "):
            lines.append(f"  {escaped(line.strip())}")
        else:
            lines.append(escaped(line))
        if line.startswith("  ") != is_indented and len(lines) > 1:
            lines.insert(-1, "")
        is_indented = line.startswith("  ")
    return "\n".join(lines)


def escaped(text):
    """Text, in which only `code` keeps its meaning."""
    parts = re.split(r"(`[^`\n]*`)", text)
    return "".join(part if part.startswith("`") and len(part) > 1 else re.sub(r"([\\*_<>\[\]{}|$^~])", r"\\\1", part) for part in parts)


def anchor(name):
    return "contract-" + name.strip(".").lower().replace(".", "-").replace("_", "-")


def type_of(field):
    if field.type in (Field.TYPE_MESSAGE, Field.TYPE_ENUM):
        name = field.type_name
        short = name.removeprefix(".lpdeform.v1.")
        return f"[{short}](#{anchor(name)})" if name.startswith(".lpdeform.v1.") else f"`{name.strip('.')}`"
    return f"`{SCALARS[field.type]}`"


def label_of(message, field):
    if field.label == Field.LABEL_REPEATED:
        return "repeated "
    if field.proto3_optional:
        return "optional "
    return f"one of `{message.oneof_decl[field.oneof_index].name}`, " if field.HasField("oneof_index") else ""


def cell(text):
    return re.sub(r"\s*\n\s*", " ", text.replace("\n\n", "<br>"))


def rows(head, lines):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(line) + " |" for line in lines), ""]


def heading(level, name, full):
    return [f"({anchor(full)})=", f"{'#' * level} {name}", ""]


def message_lines(message, comments, path, full, level=3):
    if message.options.map_entry:
        return []
    lines = heading(level, full.removeprefix(".lpdeform.v1."), full) + [comments.of(*path), ""]
    if message.field:
        lines += rows(("field", "number", "type", "what it is"), [
            (f"`{field.name}`", str(field.number), label_of(message, field) + type_of(field),
             cell(comments.of(*path, message.FIELD_FIELD_NUMBER, at))) for at, field in enumerate(message.field)])
    for at, nested in enumerate(message.nested_type):
        lines += message_lines(nested, comments, (*path, message.NESTED_TYPE_FIELD_NUMBER, at), f"{full}.{nested.name}", level)
    for at, nested in enumerate(message.enum_type):
        lines += enum_lines(nested, comments, (*path, message.ENUM_TYPE_FIELD_NUMBER, at), f"{full}.{nested.name}", level)
    return lines


def enum_lines(enum, comments, path, full, level=3):
    return heading(level, full.removeprefix(".lpdeform.v1."), full) + [comments.of(*path), ""] + rows(
        ("value", "number", "what it means"),
        [(f"`{value.name}`", str(value.number), cell(comments.of(*path, enum.VALUE_FIELD_NUMBER, at)))
         for at, value in enumerate(enum.value)])


def link_to(name):
    short = name.removeprefix(".lpdeform.v1.")
    return f"[{short}](#{anchor(name)})" if short != name else f"`{name.strip('.')}`"


def service_lines(service, comments, path):
    lines = heading(2, f"Service {service.name}", f".lpdeform.v1.{service.name}") + [comments.of(*path), ""]
    for at, method in enumerate(service.method):
        took = "a stream of " * method.client_streaming + link_to(method.input_type)
        gave = "a stream of " * method.server_streaming + link_to(method.output_type)
        lines += [*heading(3, method.name, f".lpdeform.v1.{service.name}.{method.name}"), f"Takes {took}, answers with {gave}.", "",
                  comments.of(*path, service.METHOD_FIELD_NUMBER, at), ""]
    return lines


def page(file):
    comments = Comments(file)
    lines = [f"# {pathlib.PurePosixPath(file.name).name}", "", f"`{file.name}`", "", comments.of(FILE.PACKAGE_FIELD_NUMBER), ""]
    for at, service in enumerate(file.service):
        lines += service_lines(service, comments, (SERVICE, at))
    if file.message_type:
        lines += ["## Messages", ""]
    for at, message in enumerate(file.message_type):
        lines += message_lines(message, comments, (MESSAGE, at), f".{file.package}.{message.name}")
    if file.enum_type:
        lines += ["## Enumerations", ""]
    for at, enum in enumerate(file.enum_type):
        lines += enum_lines(enum, comments, (ENUM, at), f".{file.package}.{enum.name}")
    return "\n".join(lines)


def main(descriptors, folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    pages = pages_of(descriptor_pb2.FileDescriptorSet.FromString(pathlib.Path(descriptors).read_bytes()))
    for name, file in pages.items():
        (folder / f"{name}.md").write_text(page(file))
    listed = "\n".join(pages)
    (folder / "index.md").write_text(f"""# The contract

The contract is the gRPC interface of the server: its calls and messages. All clients are built on it, and a client for another
language can be generated from it. These pages are made from the comments in `proto/lpdeform/v1`. Begin with
[the service](service.md).

```{{toctree}}
{listed}
```
""")


main(*sys.argv[1:])
