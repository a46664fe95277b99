r"""Numbers, bytes, times and lengths as people say them; and text of others, made fit for a terminal, a log or a page.

In text from files and jobs that are not ours, control characters clear a screen, move its cursor and change its
colours; overrides of the direction of writing show `exe.txt` for `txt.exe`; line breaks begin lines of their own. They
are written as Python writes them: `\x1b`, `\u202e`.
"""

import math
import re

_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: ""}
_CONTROLS = r"\x00-\x08\x0b-\x1f\x7f-\x9f"
# Marks that cannot be seen, overrides and isolates of direction, separators of lines, halves of surrogate pairs, tags.
# Not the joiners U+200C and U+200D, with which Persian, the languages of India and emoji are written.
_UNSEEN = (
    "\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ud800-\udfff\ufeff\ufff9-\ufffb\U000e0000-\U000e007f"
)
_IN_LINES = re.compile(f"[{_CONTROLS}{_UNSEEN}]")
_IN_A_LINE = re.compile(f"[\t\n{_CONTROLS}{_UNSEEN}]")


def format_count(number: int, thing: str) -> str:
    """`1 run`, `3 runs`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def share(count: int, total: int) -> str:
    """A part of a whole as a percentage to two digits: `31 %`, `0.024 %`."""
    return f"{_digits(100 * count / total, 2)} %"


def size(count: float) -> str:
    """Bytes to three digits: `15 B`, `70.2 kB`, `1.5 GB`."""
    for factor, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= factor:
            return f"{_digits(count / factor, 3)} {unit}"
    return f"{count:.0f} B"


def duration(seconds: float) -> str:
    """Seconds to two digits: `4.2 s`, `3.3 min`, `14 h`, `5.2 days`."""
    for factor, unit, least in ((86400, "days", 100 * 3600), (3600, "h", 3600), (60, "min", 60)):
        if seconds >= least:
            return f"{_digits(seconds / factor, 2)} {unit}"
    return f"{_digits(seconds, 2)} s"


def _digits(value: float, digits: int) -> str:
    """A number to so many digits, without a power of ten where it has more before its point."""
    return f"{value:.0f}" if value >= 10.0**digits - 0.5 else f"{value:.{digits}g}"


def length(metres: float) -> str:
    """Metres with a unit as configurations write it, such as `2.5 um`."""
    power = 3 * math.floor(math.log10(abs(metres)) / 3 + 1e-9) if metres else 0
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return f"{metres * 10.0**-power:.6g} {_PREFIXES[power]}m"


def printable(text: object) -> str:
    """The text in a single line, in which nothing acts on a terminal or on the order of what is beside it."""
    return _IN_A_LINE.sub(_escaped, str(text))


def printable_lines(text: object) -> str:
    """The same for text of several lines: line breaks and tabs are kept."""
    return _IN_LINES.sub(_escaped, str(text))


def is_printable(text: str) -> bool:
    """Whether the text is what `printable` makes of it."""
    return not _IN_A_LINE.search(text)


def _escaped(found: re.Match) -> str:
    return found[0].encode("unicode_escape").decode("ascii")
