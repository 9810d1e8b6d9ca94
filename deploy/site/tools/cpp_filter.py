#!/usr/bin/env python3
"""Prints a header as Doxygen understands it: cpp_filter.py HEADER

Doxygen reads /// comments. Here also a // comment behind a declaration tells what that is, a /// line that is indented is code, and
no plain text is a command or a link."""

import re
import sys

DECLARATION = re.compile(r"^(?P<code>\s*[^\s/].*[;,{}]|\s*\w+(?: = [^,/]+)?,?)  ?// (?P<comment>\S.*)$")


def line_of(line, is_in_braces):
    """One line; only members and enumerators, which stand in braces, have comments behind them."""
    code = re.match(r"^(\s*)///(   +)(\S.*)$", line)
    if code:
        return f"{code[1]}///     {code[2][3:]}{code[3]}"
    text = re.match(r"^(\s*/// ?)(.*)$", line)
    if text:
        return text[1] + re.sub(r"([<>#@%])", r"\\\1", text[2])
    told = DECLARATION.match(line)
    if told and is_in_braces and not re.search(r"^\s*(return|if|for|namespace|#)\b", line):
        return f"{told['code']} ///< " + re.sub(r"([<>#@%])", r"\\\1", told["comment"])
    return line


depth = 0
for line in open(sys.argv[1]).read().splitlines():
    print(line_of(line, depth > 0))
    code = re.sub(r"//.*", "", line)
    if not code.startswith("namespace"):
        depth += code.count("{") - code.count("}")
    elif "}" in code:
        depth += 0
