"""The settings of the site. deploy/docs lays the pages, and the references that it makes, into one folder beside this file."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[3]

project = "lpdeform"
release = re.search(r'__version__ = "([^"]+)"', (ROOT / "client/python/src/lpdeform/__init__.py").read_text())[1]
copyright = "the lpdeform authors, Apache-2.0"

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "breathe"]
exclude_patterns = ["README.md", "tools"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist", "attrs_block"]
myst_heading_anchors = 6
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # they are long unions; the comments say shapes and units
autodoc_default_options = {"members": True, "show-inheritance": False}
python_use_unqualified_type_names = True

breathe_projects = {name: str(ROOT / "build/docs/doxygen" / name / "xml") for name in ("client", "core", "c")}
breathe_domain_by_extension = {"h": "cpp"}
cpp_maximum_signature_line_length = 90
maximum_signature_line_length = 90

# Each header declares the namespace again; in C a struct and the typedef of its name are two declarations.
suppress_warnings = ["duplicate_declaration.cpp"]

html_theme = "furo"
html_title = "lpdeform"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0b5cad", "color-brand-content": "#0b5cad"},
    "dark_css_variables": {"color-brand-primary": "#7ab8f5", "color-brand-content": "#7ab8f5"},
    "footer_icons": [],
}
# The site loads nothing from elsewhere.
mathjax_path = "mathjax/tex-svg.js"


def lines_as_written(app, what, name, obj, options, lines):
    """The docstrings are plain text: a line that begins with "name: what it is" is an item, an indented one goes on with it."""
    text = []
    for line in lines:
        item = re.match(r"([a-z_]+): (\S.*)$", line)
        if item:
            text += ["", f"* **{item[1]}**: {item[2]}"]
        elif line.startswith("    ") and text and text[-1].startswith(("* ", "  ")):
            text.append("  " + line.strip())
        elif line and text and text[-1].startswith(("* ", "  ")):
            text += ["", line]
        else:
            text.append(line)
    lines[:] = text


def setup(app):
    app.connect("autodoc-process-docstring", lines_as_written)
