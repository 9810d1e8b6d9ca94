#!/usr/bin/env python3
"""Prints a page about the command line, made from what PROGRAM --help says: command_line.py PROGRAM

What stands in columns becomes a table; what is written in full sentences stays a text."""

import re
import subprocess
import sys

INTRODUCTION = """# Command line

`lpdeform` deforms meshes from the shell. It reads GLB, glTF, OFF, OBJ, PLY and STL files, and writes meshes and pictures. It solves in its own
process, or on a server if `--server` is given. This page is what `lpdeform --help` and the `--help` of each command print.

"""


def help_of(program, *command):
    return subprocess.run([program, *command, "--help"], check=True, capture_output=True, text=True).stdout


def commands_of(text):
    return re.findall(r"^  (\w+) {2,}", text[text.index("Subcommands:"):], re.MULTILINE)


def escaped(text):
    return re.sub(r"([\\|<>*_`\[\]{}$])", r"\\\1", text)


def rows_of(lines):
    """(name, what it says) of the lines of a table with two columns."""
    rows = []
    for line in lines:
        name, what = re.match(r"  (\S.*?)(?: {2,}(.*))?$", line).groups()
        rows.append((name, what or ""))
    return rows


def table(lines, head):
    rows = [f"| `{name.replace('|', chr(92) + '|')}` | {escaped(what)} |" for name, what in rows_of(lines)]
    return "\n".join([f"| {head} | |", "|---|---|", *rows]) + "\n"


def section(program, command):
    parts = re.split(r"\n\n+", help_of(program, command).strip())
    about = parts[0].splitlines()
    page = [f"## lpdeform {command}\n", escaped(about[0]) + ".\n", f"```text\n{about[1]}\n```\n"]
    for part in parts[1:]:
        lines = part.splitlines()
        if lines[0] in ("Positionals:", "Options:"):
            page.append(table(joined(lines[1:]), "argument" if lines[0] == "Positionals:" else "option"))
        elif any(line.startswith(" ") for line in lines):
            first = lines.index(next(line for line in lines if line.startswith(" ")))
            if first:
                page.append(escaped("\n".join(lines[:first])) + "\n")
            page.append("```text\n" + "\n".join(lines[first:]) + "\n```\n")
        else:
            page.append(escaped(part) + "\n")
    return "\n".join(page)


def joined(lines):
    """Lines of a table; those that go on with the one before are joined to it."""
    whole = []
    for line in lines:
        if re.match(r"  \S", line) or not whole:
            whole.append(line)
        else:
            whole[-1] += ("  " if not re.search(r"\S {2,}\S", whole[-1]) else " ") + line.strip()
    return whole


def main(program):
    commands = commands_of(help_of(program))
    assert commands, "the program has no commands"
    print(INTRODUCTION + "\n".join(section(program, command) for command in commands))


main(*sys.argv[1:])
