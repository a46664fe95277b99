"""Templates of the pages, and how numbers and symbols are set in them."""

from __future__ import annotations

import re

import jinja2
import numpy as np
from markupsafe import Markup, escape

from icha.support import formatting
from icha.support.formatting import printable_lines

# A table has so many rows at most.
MOST_ROWS = 300

# Symbols as they stand in captions and attributes, and how a page sets them.
_SYMBOLS = (
    (re.compile(r"h(?:&#39;|')_?rms"), "<i>h</i>′<sub>rms</sub>"),
    (re.compile(r"\bh_rms"), "<i>h</i><sub>rms</sub>"),
    (re.compile(r"\bE\*"), "<i>E</i><sup>∗</sup>"),
    (re.compile(r"\bA0\b"), "<i>A</i><sub>0</sub>"),
)


def _symbols(text: str) -> Markup:
    """Set the symbols of plain text: E*, A0, h'rms."""
    result = str(escape(printable_lines(text)))
    for pattern, replacement in _SYMBOLS:
        result = pattern.sub(replacement, result)
    return Markup(result)


def scientific(value: float | None) -> Markup:
    """A number with three digits, in powers of ten where it is small or large."""
    if value is None:
        return Markup("–")
    if value == 0:
        return Markup("0")
    # A hundredth less a rounding error is a hundredth.
    exponent = int(np.floor(np.log10(abs(value)) + 1e-9))
    if -3 <= exponent < 4:
        return Markup(escape(f"{value:.{max(0, 2 - exponent)}f}" if exponent < 3 else f"{value:.0f}"))
    return Markup(f"{value / 10.0**exponent:.2f}&thinsp;×&thinsp;10<sup>{str(exponent).replace('-', '−')}</sup>")


def _per_cent(value: float, *, signed: bool = True) -> str:
    """A part in per cent, to a tenth, with a true minus sign."""
    text = f"{100 * value:+.1f}" if signed else f"{100 * value:.1f}"
    return text.replace("+0.0", "0.0").replace("-0.0", "0.0").replace("-", "−")


def template(name: str) -> jinja2.Template:
    """A page to be filled in, with the filters above."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("icha.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
        # Titles, names and messages of failed runs: what a browser would turn round is written out.
        finalize=lambda value: printable_lines(value) if type(value) is str else value,
    )
    environment.filters |= {
        "symbols": _symbols,
        "scientific": scientific,
        "per_cent": _per_cent,
        "number": "{:g}".format,
        "duration": formatting.duration,
    }
    return environment.get_template(name)
