"""Checks that licences/README.txt of a wheel names the licence of each of its files, and that the texts are there:
check_licences.py WHEEL..."""

from __future__ import annotations

import fnmatch
import re
import sys
import zipfile


def faults(wheel: str) -> list[str]:
    with zipfile.ZipFile(wheel) as files:
        entries = [name for name in files.namelist() if not name.endswith("/")]
        names = [name for name in entries if ".dist-info/" not in name and "/licences/" not in name]
        page = files.read("lpdeform/licences/README.txt").decode()
        texts = {name.rpartition("/")[2]: files.read(name) for name in entries if "/licences/" in name}
    patterns = [one for one in re.findall(r"lpdeform(?:\.libs)?/[^\s,]*", page) if not one.endswith(".txt")]
    patterns = [one + "*" if one.endswith("/") else one for one in patterns] + ["lpdeform/py.typed"]
    unnamed = [name for name in names if not any(fnmatch.fnmatchcase(name, one) for one in patterns)]
    missing = [name for name in set(re.findall(r"[a-z0-9-]+\.txt", page)) if len(texts.get(name, b"")) < 500]
    return [f"{wheel}: no licence is named for {name}" for name in unnamed] + [
        f"{wheel}: the text {name} is missing" for name in missing
    ]


if __name__ == "__main__":
    found = [fault for wheel in sys.argv[1:] for fault in faults(wheel)]
    sys.exit("\n".join(found) or None)
