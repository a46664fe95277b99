"""Templates of HTML pages, and a function that formats symbols on the pages."""

from __future__ import annotations

import os
import re

import jinja2
from markupsafe import Markup, escape

from icha.support.atomic_files import whole_file
from icha.support.formatting import printable_lines

# Symbols in captions and attributes, and their form on a page.
SYMBOLS = {
    r"h(?:&#39;|')_?rms": "<i>h</i>′<sub>rms</sub>",
    r"\bh_rms": "<i>h</i><sub>rms</sub>",
    r"\bE\*": "<i>E</i><sup>∗</sup>",
    r"\bA0\b": "<i>A</i><sub>0</sub>",
    r"λ_(\w)": r"<i>λ</i><sub>\1</sub>",
}


def format_symbols(text: str) -> Markup:
    """Format the symbols of plain text: E*, A0, h'rms."""
    result = str(escape(printable_lines(text)))
    for pattern, replacement in SYMBOLS.items():
        result = re.sub(pattern, replacement, result)
    return Markup(result)


def template(name: str) -> jinja2.Template:
    """Load the template of a page; all texts are escaped."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("icha.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
        # Titles, names and messages may contain characters that reverse the direction of text.
        finalize=lambda value: printable_lines(value) if type(value) is str else value,
    )
    environment.filters["symbols"] = format_symbols
    return environment.get_template(name)


def write_page(path: str | os.PathLike, name: str, **values) -> None:
    """Fill in the template `name` with values and write the page."""
    with whole_file(path) as temporary:
        temporary.write_text(template(name).render(values), encoding="utf-8")
