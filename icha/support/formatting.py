r"""Format numbers, bytes, times and lengths, and make untrusted text safe for a terminal, a log or a page.

In untrusted text, control characters could clear a screen, move the cursor and change colours. Characters that change
the writing direction could show `exe.txt` instead of `txt.exe`. Line breaks could add false lines to a log. The
functions replace such characters by Python escapes, such as `\x1b` and `\u202e`.
"""

import math
import re
from collections.abc import Iterable, Mapping
from html import escape

from icha.support.units import PREFIXES

# Largest number of texts in a sentence, and of values in a cell of a table.
_MOST_NAMES, _MOST_VALUES = 4, 12
_CONTROLS = r"\x00-\x08\x0b-\x1f\x7f-\x9f"
# Invisible marks, characters that change the writing direction, line separators, surrogates and tags. The joiners
# U+200C and U+200D are allowed, because Persian, Indian languages and emoji need these characters.
_UNSEEN = (
    "\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ud800-\udfff\ufeff\ufff9-\ufffb\U000e0000-\U000e007f"
)
_IN_LINES = re.compile(f"[{_CONTROLS}{_UNSEEN}]")
_IN_A_LINE = re.compile(f"[\t\n{_CONTROLS}{_UNSEEN}]")


def format_count(number: int, thing: str) -> str:
    """Format a number with a noun in singular or plural, such as `1 run` or `3 runs`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def join_first(cases: Iterable[str], between: str = ", ") -> str:
    """Join the first texts of a list to one text, and append how many more texts there are."""
    cases = list(cases)
    more = len(cases) - _MOST_NAMES
    return between.join(cases[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def list_first(values: Iterable[object]) -> str:
    """List the first values for a cell of a table, and append the number of all values if there are more."""
    texts = list(map(str, values))
    return ", ".join(texts[:_MOST_VALUES]) + (f", … ({len(texts)})" if len(texts) > _MOST_VALUES else "")


def share(count: int, total: int) -> str:
    """Format the ratio count/total as a percentage with two digits, such as `31 %` or `0.024 %`."""
    return f"{_digits(100 * count / total, 2)} %"


def size(count: float) -> str:
    """Format a number of bytes with three digits, such as `15 B`, `70.2 kB` or `1.5 GB`."""
    for factor, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= factor:
            return f"{_digits(count / factor, 3)} {unit}"
    return f"{count:.0f} B"


def choose_unit(value: float, unit: str) -> tuple[float, str]:
    """Choose the unit prefix with which `value` (SI) is between 1 and 1000; return the factor and the prefixed unit.

    Units in the notation of CF, such as `J m^-2`, are written with a slash.
    """
    exponent = 0 if value == 0 else math.floor(math.log10(abs(value)) / 3 + 1e-9) * 3
    exponent = min(max(exponent, min(PREFIXES)), max(PREFIXES))
    return 10.0**-exponent, PREFIXES[exponent] + unit.replace(" m^-1", "/m").replace(" m^-2", "/m²")


def format_quantity(value: float, unit: str) -> str:
    """Format a value (SI) with a prefixed unit, such as `25 MPa`."""
    factor, name = choose_unit(value, unit)
    return f"{value * factor:.4g} {name}"


def duration(seconds: float) -> str:
    """Format a time in seconds with two digits, such as `4.2 s`, `3.3 min`, `14 h` or `5.2 days`."""
    for factor, unit, least in ((86400, "days", 100 * 3600), (3600, "h", 3600), (60, "min", 60)):
        if seconds >= least:
            return f"{_digits(seconds / factor, 2)} {unit}"
    return f"{_digits(seconds, 2)} s"


def _digits(value: float, digits: int) -> str:
    """Format a number with `digits` significant digits, but round no digits before the decimal point."""
    return f"{value:.0f}" if value >= 10.0**digits - 0.5 else f"{value:.{digits}g}"


def length(metres: float, digits: int = 6) -> str:
    """Format a length in metres with a prefixed unit as in configurations, such as `2.5 um`."""
    factor, unit = choose_unit(metres, "m")
    return f"{metres * factor:.{digits}g} {unit.replace('µ', 'u')}"


def printable(text: object) -> str:
    """Escape control characters and line breaks of a text, so that the text is one harmless line."""
    return _IN_A_LINE.sub(_escaped, str(text))


def printable_lines(text: object) -> str:
    """Escape control characters of a text, but keep line breaks and tabs, unlike `printable`."""
    return _IN_LINES.sub(_escaped, str(text))


def _escaped(found: re.Match) -> str:
    return found[0].encode("unicode_escape").decode("ascii")


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Return a small table as HTML, for notebooks."""
    lines = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows.items())
    return f"<table><caption>{escape(title)}</caption>{lines}</table>"
