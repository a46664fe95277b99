"""Templates of HTML pages, and functions that format numbers and symbols on the pages."""

from __future__ import annotations

import os
import re

import jinja2
import numpy as np
from markupsafe import Markup, escape

from icha.support.atomic_files import whole_file
from icha.support.formatting import printable_lines
from icha.support.statistics import ENOUGH, ensemble

MOST_ROWS = 300  # largest number of rows in a table
# Symbols in captions and attributes, and their form on a page.
SYMBOLS = {
    r"h(?:&#39;|')_?rms": "<i>h</i>′<sub>rms</sub>",
    r"\bh_rms": "<i>h</i><sub>rms</sub>",
    r"\bE\*": "<i>E</i><sup>∗</sup>",
    r"\bA0\b": "<i>A</i><sub>0</sub>",
}


def _symbols(text: str) -> Markup:
    """Format the symbols of plain text: E*, A0, h'rms."""
    result = str(escape(printable_lines(text)))
    for pattern, replacement in SYMBOLS.items():
        result = re.sub(pattern, replacement, result)
    return Markup(result)


def format_scientific(value: float | None) -> Markup:
    """Format a number with three digits; a small or large number has a power of ten."""
    if value is None:
        return Markup("–")
    if value == 0:
        return Markup("0")
    # 0.01 may be stored as 0.00999….
    exponent = int(np.floor(np.log10(abs(value)) + 1e-9))
    if -3 <= exponent < 4:
        return Markup(escape(f"{value:.{max(0, 2 - exponent)}f}" if exponent < 3 else f"{value:.0f}"))
    return Markup(f"{value / 10.0**exponent:.2f}&thinsp;×&thinsp;10<sup>{str(exponent).replace('-', '−')}</sup>")


def per_cent(value: float, *, signed: bool = True) -> str:
    """Format a fraction in per cent, with one decimal and a typographic minus sign."""
    text = f"{100 * value:+.1f}" if signed else f"{100 * value:.1f}"
    return text.replace("+0.0", "0.0").replace("-0.0", "0.0").replace("-", "−")


def format_mean(values: np.ndarray, form, *, has_interval: bool = True) -> Markup:
    """Format the mean of values and the accuracy of the mean (`format_range`); `form` formats one number."""
    text = format_range(values, form, has_interval=has_interval)
    return Markup(form(float(np.mean(values)))) + (Markup(" ") + text if text else "")


def format_range(values: np.ndarray, form, *, has_interval: bool = True) -> Markup | str:
    """Format the 95 % interval of a mean, if it has one, or the extremes of fewer than five values.

    Equal values give an empty text.

    If all values are positive and the interval would reach zero, the interval is computed from their logarithms.
    """
    over = ensemble(values)
    # Runs reach target loads exactly, except for rounding errors.
    if len(values) < 2 or np.ptp(values) <= 1e-6 * abs(over.mean):
        return ""
    if len(values) < ENOUGH:
        low, high = np.min(values), np.max(values)
    elif not has_interval:
        return ""
    elif np.all(values > 0) and over.confidence >= over.mean:
        low, high = over.band(positive=True)
    else:
        return Markup("±&thinsp;") + form(float(over.confidence)).lstrip("+")
    return Markup("({} … {})").format(form(float(low)), form(float(high)))


def template(name: str) -> jinja2.Template:
    """Load the template of a page, with filters that format numbers and symbols."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("icha.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
        # Titles, names and messages may contain characters that reverse the direction of text.
        finalize=lambda value: printable_lines(value) if type(value) is str else value,
    )
    environment.filters |= {
        "symbols": _symbols,
        "scientific": format_scientific,
        "per_cent": per_cent,
        "number": "{:g}".format,
    }
    return environment.get_template(name)


def write_page(path: str | os.PathLike, name: str, **values) -> None:
    """Fill in the template `name` with values and write the page."""
    with whole_file(path) as temporary:
        temporary.write_text(template(name).render(values), encoding="utf-8")
