"""The settings of the site. deploy/docs lays the pages, and the references that it makes, into one folder beside this file."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[3]

project = "lpdeform"
release = re.search(r'__version__ = "([^"]+)"', (ROOT / "client/python/src/lpdeform/__init__.py").read_text())[1]
copyright = "the lpdeform authors, Apache-2.0"

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "breathe"]
exclude_patterns = ["README.md", "tools"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist", "attrs_block"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "show-inheritance": False}
python_use_unqualified_type_names = True

breathe_projects = {"lpdeform": str(ROOT / "build/docs/doxygen/xml")}
breathe_default_project = "lpdeform"
breathe_domain_by_extension = {"h": "cpp"}
cpp_maximum_signature_line_length = 90
maximum_signature_line_length = 90

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
