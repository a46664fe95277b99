"""Configuration of Sphinx for `make docs`, which needs no network."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "ICHA"
author = "ICHA developers"
project_copyright = author
release = version_of("icha")
version = release

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "generated_reference",
]
exclude_patterns = ["_build", "tables"]
source_suffix = {".md": "markdown"}

# Links `[text](page.md#heading)` work on the site and where the files are browsed.
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]
# Every link that looks like a file must lead to one.
myst_all_links_external = False

# Docstrings mark code by single backticks.
default_role = "literal"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False
# A list of fields, because autodoc describes the members as well.
napoleon_use_ivar = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
add_module_names = False

html_theme = "furo"
html_title = "ICHA"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}

# `make linkcheck`: publishers turn robots away from pages that people can read.
linkcheck_ignore = [r"https://doi\.org/.*"]
linkcheck_anchors = False
linkcheck_timeout = 20
linkcheck_retries = 2
