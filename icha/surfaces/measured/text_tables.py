"""Tables of numbers in text files: encoding, heading, delimiter, missing points, numbers of rows and columns."""

import gzip
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TextIO

import numpy as np

from icha.surfaces.measured.array_files import open_instrument
from icha.surfaces.measured.settings import UnfitTopography

# Characters in which heading and first line of numbers are looked for, and the largest number of lines of a heading.
_BEGINNING, _LONGEST_HEADING = 2**20, 1000
# Words, in small letters, that stand where a point has no height.
_MISSING = frozenset(
    "- -- --- * ** *** **** ? nan na n/a #n/a #na bad none null nil nodata no_data missing masked invalid void "
    "undefined undef #value! #num! #div/0! #null! #ref!".split()
) | {"", "no data"}
_NO_DATA = re.compile(r"\bno data\b", re.IGNORECASE)
_REMARK = re.compile(r"#(?!N/A|NA\b|VALUE!|NUM!|DIV/0!|NULL!|REF!)", re.IGNORECASE)
_FORTRAN = re.compile(r"([\d.])[dD]([-+]?\d+)$")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?$")
# Differences of a scale of coordinates or numbers, as written with few digits, agree to this part.
_EQUAL_STEPS = 1e-2
# Shortest row or column in which such a scale is looked for.
_SHORTEST_SCALE = 8


@dataclass(frozen=True, eq=False)
class Layout:
    """How the lines of a text file are to be read.

    heading : lines above the numbers, remarks included.
    words : whether the heading has lines that are no remarks (#).
    first_line : number of lines above the first line of numbers.
    delimiter : "\\t", ";", "," or None for blanks.
    decimal_comma : whether numbers have decimal commas.
    columns : numbers in the first line of numbers.
    """

    heading: tuple[str, ...]
    words: bool
    first_line: int
    delimiter: str | None
    decimal_comma: bool
    columns: int


class SourceFile:
    """The file of a scan, of which every part is read when it is asked for, and only once.

    path : of the file.
    """

    def __init__(self, path: Path):
        """Read nothing yet."""
        self.path = path

    @cached_property
    def layout(self) -> Layout | None:
        """How its lines are to be read; None if it is no text of numbers."""
        return layout_of(self.path)

    @cached_property
    def values(self) -> np.ndarray:
        """Numbers (rows, columns) of a text, nan where one is missing.

        Raises
        ------
        UnfitTopography
            If it has no numbers, a field that is no number, or a row of another length; with the line's number.
        """
        if self.layout is None or not self.layout.columns:
            raise UnfitTopography(
                "path",
                "cannot be read as a table, as it holds no numbers; allowed: a row of heights, or x y z, in every line",
            )
        values = _read_clean(self.path, self.layout)
        return _read_any(self.path, self.layout) if values is None else values

    @cached_property
    def instrument(self):
        """The file as SurfaceTopography opens it; None if it is of no format that it knows."""
        return open_instrument(self.path)


def open_text(path: Path) -> TextIO:
    """Open a text file, which may be compressed by gzip, in the encoding that it has."""
    with path.open("rb") as file:
        compressed = file.read(2) == b"\x1f\x8b"
    opener = gzip.open if compressed else open
    with opener(path, "rb") as file:
        start = file.read(2**12)
    return opener(path, "rt", encoding=_encoding(start), errors="replace")


def _encoding(start: bytes) -> str:
    """UTF-16 and UTF-8 by their marks; UTF-8, which may be broken off at the end; else what Windows writes."""
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8-sig")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def layout_of(path: Path) -> Layout | None:
    """Find out how the lines of a file are to be read; None if it is no text of numbers.

    A text of nothing but remarks has no columns.

    Raises
    ------
    UnfitTopography
        If it is not clear whether commas are decimal.
    """
    try:
        with open_text(path) as file:
            start = file.read(_BEGINNING)
    except (EOFError, OSError):  # a damaged gzip file
        return None
    if "\0" in start:
        return None
    heading: list[str] = []
    words = False
    for number, line in enumerate(start.splitlines()[:_LONGEST_HEADING]):
        text = _without_remark(line)
        if text.strip():
            found = _delimiter(text)
            fields = _fields(text, found[0])
            numbers = [_number(field, found[1]) for field in fields]
            if None not in numbers and not np.all(np.isnan(numbers)):  # type: ignore[arg-type]
                _refuse_damaged_row(heading, found)
                return Layout(tuple(heading), words, number, *found, _columns(fields))
            words = True
        heading.append(line)
    return None if words else Layout(tuple(heading), words, len(heading), None, False, 0)


def _refuse_damaged_row(heading, found):
    """Refuse a last line of a heading that is a row of numbers with something else in it, not names of columns."""
    fields = _fields(_without_remark(heading[-1]), found[0]) if heading else []
    numbers = [_number(field, found[1]) for field in fields]
    others = [k for k, number in enumerate(numbers) if number is None]
    if not others or len(fields) < _SHORTEST_SCALE or 2 * len(others) > len(fields):
        return
    # The corner of a row of column numbers may be a name.
    if others != [0] or _equal_steps(np.array(numbers[1:])) is None:
        raise _not_a_number(fields[others[0]], len(heading), others[0] + 1)


def _not_a_number(field, line, column):
    return UnfitTopography(
        "path",
        f"has {field[:40]!r} in line {line}, column {column}; allowed: a number, or NaN where a point is missing. "
        "Correct or remove the line",
    )


def _columns(fields):
    """Number of fields, without an empty one behind a delimiter at the end."""
    return len(fields) - (len(fields) > 1 and fields[-1] == "")


def _delimiter(text: str) -> tuple[str | None, bool]:
    """Delimiter of the numbers in a line, and whether these have decimal commas."""
    if "\t" in text.strip():
        fields = [field.strip() for field in text.split("\t") if field.strip()]
        return "\t", any(map(_DECIMAL_COMMA.match, fields)) and not any("." in field for field in fields)
    by_blanks = [field for field in re.split(r"[;\s]+", text) if field]
    if len(by_blanks) > 1 and all(map(_DECIMAL_COMMA.match, by_blanks)):
        raise UnfitTopography(
            "path",
            f"has commas in {text[:40]!r} that may be decimal or stand between numbers; allowed: decimal points. "
            "Replace the commas",
        )
    for delimiter in ";,":
        if delimiter in text:
            return delimiter, False
    return None, False


def _fields(text: str, delimiter: str | None) -> list[str]:
    """Fields of a line, without blanks and quotes around them."""
    if delimiter is None:
        text = _NO_DATA.sub("nan", text)
    return [field.strip().strip("\"'").strip() for field in text.split(delimiter)]


def _number(field: str, decimal_comma: bool) -> float | None:
    """The number that a field stands for, nan where it is missing, None if it is neither."""
    if field.lower() in _MISSING:
        return np.nan
    if decimal_comma:
        field = field.replace(",", ".")
    try:
        return float(_FORTRAN.sub(r"\1e\2", field)) if "_" not in field else None
    except ValueError:
        return None


def _lines(path: Path, layout: Layout) -> Iterator[tuple[int, str]]:
    """Lines of numbers, without remarks, and their numbers, counted from 1."""
    with open_text(path) as file:
        for number, line in enumerate(file, 1):
            if number > layout.first_line and (text := _without_remark(line)).strip():
                yield number, text


def _without_remark(line: str) -> str:
    """A line up to a #, but for one that begins a word such as #N/A."""
    text = _REMARK.split(line, maxsplit=1)[0] if "#" in line else line
    return text.strip(" \r\n")


def _read_clean(path, layout):
    """The numbers (rows, columns) of a file that has nothing else, read quickly; None if it has."""
    if layout.decimal_comma:
        return None
    ending = layout.delimiter or ""
    lines = (text.removesuffix(ending) if ending else text for _, text in _lines(path, layout))
    try:
        values = np.loadtxt(lines, delimiter=layout.delimiter, comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.shape[1] == layout.columns else None


def _read_any(path, layout):
    """The numbers (rows, columns) of a file field by field, nan where they are missing."""
    rows, widths, numbers = [], [], []
    for number, text in _lines(path, layout):
        fields = _fields(text, layout.delimiter)
        row = [_number(field, layout.decimal_comma) for field in fields]
        if None in row:
            wrong = row.index(None)
            raise _not_a_number(fields[wrong], number, wrong + 1)
        rows.append(np.array(row))
        widths.append(len(row))
        numbers.append(number)
    # A delimiter behind the last number of every row is no column.
    usual = int(np.bincount(widths).argmax())
    if all(np.isnan(row[-1]) for row in rows if len(row) == usual) and layout.columns == usual - 1:
        rows = [row[:-1] if len(row) == usual else row for row in rows]
        usual -= 1
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != usual:
            raise UnfitTopography(
                "path",
                f"has {len(row)} numbers in line {number} and {usual} in most lines; allowed: rows of one length. "
                "Complete or remove the line; missing points may be NaN",
            )
    return np.array(rows)


def without_scales(values: np.ndarray) -> tuple[np.ndarray, tuple[float, float] | None, str]:
    """Leave out a first row and a first column that number or measure the others.

    Heights of a rough surface do not rise in equal steps along a line, unless all of them do.

    Returns
    -------
    heights, steps of the scales along x and y (None unless both are there), and what was left out, in words.
    """
    across = _scale(values[0], values[1:3]) if len(values) > 2 else None
    heights = values if across is None else values[1:]
    down = _scale(values[:, 0] if across is None else values[1:, 0], heights[:, 1:3].T)
    if down is not None:
        heights = heights[:, 1:]
    left_out = [name for name, step in (("row", across), ("column", down)) if step is not None]
    remark = f"first {' and '.join(left_out)} left out: numbers in equal steps, not heights"
    steps = None if across is None or down is None else (across, down)
    return heights, steps, remark if left_out else ""


def _scale(line, others):
    """Step of a line of numbers that rises or falls in equal steps while its neighbours do not; None if it does not."""
    steps = _equal_steps(line)
    if steps is None or len(line) < _SHORTEST_SCALE or any(_equal_steps(each) is not None for each in others):
        return None
    return abs(steps)


def _equal_steps(line):
    # The corner of a row and a column of coordinates may be anything.
    for part in (line, line[1:]):
        steps = np.diff(part)
        if len(steps) and np.all(np.isfinite(steps)):
            mean = float(np.mean(steps))
            if mean and np.ptp(steps) <= _EQUAL_STEPS * abs(mean):
                return mean
    return None
