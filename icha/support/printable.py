r"""Text from files and jobs that are not ours, made fit for a terminal, a log or a page.

Control characters clear a screen, move its cursor and change its colours; overrides of the direction of writing show
`exe.txt` for `txt.exe`; line breaks begin lines of their own. They are written as Python writes them: `\x1b`, `\u202e`.
"""

import re

_CONTROLS = r"\x00-\x08\x0b-\x1f\x7f-\x9f"
# Marks that cannot be seen, overrides and isolates of direction, separators of lines, halves of surrogate pairs, tags.
# Not the joiners U+200C and U+200D, with which Persian, the languages of India and emoji are written.
_UNSEEN = (
    "\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ud800-\udfff\ufeff\ufff9-\ufffb\U000e0000-\U000e007f"
)
_IN_LINES = re.compile(f"[{_CONTROLS}{_UNSEEN}]")
_IN_A_LINE = re.compile(f"[\t\n{_CONTROLS}{_UNSEEN}]")


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
