#!/usr/bin/env python3
"""Checks a site: check_site.py HTML SOURCE; HTML is its folder, SOURCE that of its pages.

    every link, picture, script and style of a page leads to a file of the site, and to an anchor that is there
    a page loads nothing from another place; it may link to one
    every cell of a notebook was run
    check_site.py --self-test    a page that breaks a rule is caught"""

import html.parser
import pathlib
import re
import sys
import tempfile
import urllib.parse

LOADS = {("img", "src"), ("script", "src"), ("link", "href"), ("source", "src"), ("iframe", "src"), ("object", "data")}
LINKS = {("a", "href"), *LOADS}
# Attributes of <link> that load nothing.
TOLD_ONLY = {"canonical", "next", "prev", "index", "search", "author"}


class Reader(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.anchors, self.links, self.cells = set(), [], 0

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.anchors.update(given[name] for name in ("id", "name") if given.get(name))
        self.cells += tag == "div" and "cell_input" in (given.get("class") or "").split()
        for name, value in attributes:
            if (tag, name) in LINKS and value is not None:
                is_load = (tag, name) in LOADS and not (set((given.get("rel") or "").split()) & TOLD_ONLY)
                self.links.append((value, is_load))


def read(path):
    reader = Reader()
    reader.feed(path.read_text())
    return reader


def problem_of(page, target, is_load, pages):
    """What is wrong with a link of a page; None if nothing is."""
    url = urllib.parse.urlsplit(target)
    if url.scheme == "data" and is_load:
        return None
    if url.scheme or url.netloc:
        if is_load:
            return f"loads {target}"
        return None if url.scheme in ("https", "mailto") else f"links to {target}, which is neither https nor a page of the site"
    file = (page.parent / urllib.parse.unquote(url.path)).resolve() if url.path else page
    if file.is_dir():
        file /= "index.html"
    if not file.is_file():
        return f"{target} leads to no file"
    if url.fragment and file in pages and urllib.parse.unquote(url.fragment) not in pages[file].anchors:
        return f"{target} leads to no anchor"
    return None


def problems_of_links(folder):
    pages = {path.resolve(): read(path) for path in sorted(folder.rglob("*.html"))}
    found = [] if pages else ["no page was found"]
    for page, reader in pages.items():
        for target, is_load in reader.links:
            problem = problem_of(page, target, is_load, pages)
            if problem:
                found.append(f"{page.relative_to(folder.resolve())}: {problem}")
    for style in folder.rglob("*.css"):
        for target in re.findall(r"url\(['\"]?((?:https?:)?//[^)'\"]+)", style.read_text()):
            found.append(f"{style.relative_to(folder)}: loads {target}")
    return found


def problems_of_cells(folder, source):
    """A notebook shows each cell that its page has; that it was run, and without an error, Sphinx sees to."""
    found = []
    for page in source.rglob("*.md"):
        text = page.read_text()
        count = len(re.findall(r"^```+\{code-cell\}", text, re.MULTILINE))
        shown = folder / page.relative_to(source).with_suffix(".html")
        if count and (not shown.exists() or read(shown).cells != count):
            found.append(f"{page.relative_to(source)}: the site does not show each of its {count} cells")
    return found


RIGHT = {
    "index.html": '<a id="top" href="#top"></a><a href="other.html#there"></a><img src="a.png"><a href="https://example.org"></a>'
                  '<link rel="canonical" href="https://example.org">',
    "other.html": '<p id="there"></p>', "a.png": "", "note.html": '<div class="cell_input"></div>',
}
WRONG = {
    "a link to no file": ("other.html#there", "another.html"),
    "a link to no anchor": ("#there", "#nowhere"),
    "a link within the page to no anchor": ('href="#top"', 'href="#bottom"'),
    "a picture that is not there": ("a.png", "b.png"),
    "a picture from another place": ("a.png", "https://example.org/a.png"),
    "a link without https": ("https://example.org\"></a>", "http://example.org\"></a>"),
    "a style from another place": ('rel="canonical"', 'rel="stylesheet"'),
    "a cell that is not shown": ("cell_input", "cell"),
}


def self_test():
    missed = []
    for what, (before, after) in {"": ("", ""), **WRONG}.items():
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for file, text in RIGHT.items():
                (folder / file).write_text(text.replace(before, after) if before else text)
            (folder / "note.md").write_text("```{code-cell} ipython3\nprint(1)\n```\n")
            found = problems_of_links(folder) + problems_of_cells(folder, folder)
        if bool(found) != bool(what):
            missed.append(f"{what or 'what is right'}: {found or 'is not caught'}")
    return missed


def main(arguments):
    if arguments == ["--self-test"]:
        problems = self_test()
    elif len(arguments) == 2:
        problems = problems_of_links(pathlib.Path(arguments[0])) + problems_of_cells(*map(pathlib.Path, arguments))
    else:
        sys.exit(__doc__)
    for problem in problems:
        print("check_site:", problem, file=sys.stderr)
    sys.exit(bool(problems))


main(sys.argv[1:])
