"""Tables of numbers in text files: encoding, heading, delimiter, missing points, numbers of rows and columns."""

import csv
import gzip
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
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
# Windows writes nan as 1.#IND and 1.#QNAN.
_REMARK = re.compile(r"(?<!1\.)#(?!N/A|NA\b|VALUE!|NUM!|DIV/0!|NULL!|REF!)", re.IGNORECASE)
_NAN = re.compile(r"[-+]?(1\.#(ind|qnan|snan)\d*|nan\(.*\))|\*+", re.IGNORECASE)
_FORTRAN = re.compile(r"([\d.])[dD]([-+]?\d+)$")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?$")
# A number with three digits behind its comma, which may be decimal or separate thousands.
AMBIGUOUS_COMMA = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
_QUOTED = re.compile(r"\"[^\"]*\"")
# The beginning of a number, whatever separates its thousands.
_LIKE_A_NUMBER = re.compile(r"[-+−]?\d[\d.,' ]*$")
# How Gwyddion begins the line with the width of an image that it exports, in the languages of its menus. The line with
# its height follows, that with its name goes before.
WIDTH = re.compile(r"^#?\s*(Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина)\s*[:：]\s*(.*)$")
# What libraries raise for a compressed file that is damaged.
_DAMAGED = (EOFError, zlib.error, gzip.BadGzipFile)
_OTHER_COMPRESSION = {b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"\x28\xb5\x2f\xfd": "zstd"}
# Differences of a scale of coordinates or numbers agree to this part, or to the last digit that is written.
_EQUAL_STEPS = 1e-2
# A scale spans so many units of its last digit.
_FEWEST_UNITS = 4
# A line of heights resembles the next one if the two differ by less than this factor times the difference of the next
# two, and if this part of its steps has the same sign or these differences are so small a part of the heights.
_DIFFERENCE, _SAME_SIGN, _SMOOTH = 3, 0.8, 0.2
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
    corner : whether the first line is a scale that has a word in its corner.
    images : names of the images that Gwyddion exported to the text, empty if there is no such heading.
    data : name of the image that is read, if there are several.
    last_line : number of lines up to the end of this image; None: the whole text.
    """

    heading: tuple[str, ...]
    words: bool
    first_line: int
    delimiter: str | None
    decimal_comma: bool
    columns: int
    corner: bool = False
    images: tuple[str, ...] = ()
    data: str = ""
    last_line: int | None = None


class SourceFile:
    """The file of a scan, of which every part is read when it is asked for, and only once.

    path : of the file.
    data : name of the image that is wanted; None: the first.
    """

    def __init__(self, path: Path, data: str | None = None):
        """Read nothing yet."""
        self.path, self.data = path, data
        self._gaps: list[tuple[int, int]] = []

    @cached_property
    def layout(self) -> Layout | None:
        """How its lines are to be read; None if it is no text of numbers."""
        try:
            layout = layout_of(self.path)
            if layout is not None and any(map(WIDTH.match, layout.heading)):
                layout = _layout_of_image(self.path, layout, self.data)
        except _DAMAGED:
            raise _damaged() from None
        return layout

    @property
    def table_layout(self) -> Layout:
        """The layout; UnfitTopography if the file is no text of numbers."""
        if self.layout is None or not self.layout.columns:
            raise UnfitTopography(
                "path",
                "cannot be read as a table, as it holds no numbers; allowed: a row of heights, or x y z, in every line",
            )
        return self.layout

    @cached_property
    def values(self) -> np.ndarray:
        """Numbers (rows, columns) of a text, nan where one is missing.

        Raises
        ------
        UnfitTopography
            If it has no numbers, a field that is no number, or a row of another length; with the line's number.
        """
        layout = self.table_layout
        try:
            values = _read_clean(self.path, layout, self._gaps)
            return _read_any(self.path, layout, self._gaps) if values is None else values
        except _DAMAGED:
            raise _damaged() from None

    def refuse_blocks(self) -> None:
        """Raise UnfitTopography if empty lines or remarks divide the rows into blocks, as several images are written.

        Such lines between all rows divide nothing.
        """
        rows = [row for row, _ in self._gaps]
        if rows and min(np.diff([0, *rows, len(self.values)])) > 1:
            raise UnfitTopography(
                "path",
                f"has {len(rows) + 1} blocks of rows, the second from line {self._gaps[0][1]}; allowed: one image. "
                "Remove the other blocks or, if all are one image, the empty lines and remarks between them",
            )

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
    """UTF by its mark, or by its zeros; UTF-8, which may be broken off at the end; else what Windows writes."""
    if start.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return "utf-32"
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    for zeros, others, encoding in ((start[1::2], start[::2], "utf-16-le"), (start[::2], start[1::2], "utf-16-be")):
        if zeros and not any(zeros) and all(byte in b"\t\r\n" or 32 <= byte < 127 for byte in others):
            return encoding
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8-sig")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _damaged():
    return UnfitTopography(
        "path", "is compressed by gzip and damaged or cut off; allowed: the whole file. Copy or compress it again"
    )


def layout_of(path: Path) -> Layout | None:
    """Find out how the lines of a file are to be read; None if it is no text of numbers.

    A text of nothing but remarks has no columns.

    Raises
    ------
    UnfitTopography
        If it is not clear whether commas are decimal.
    """
    lines = _first_lines(path)
    if lines is None:
        return None
    heading: list[str] = []
    words = False
    for number, line in enumerate(lines[:_LONGEST_HEADING]):
        text = _without_remark(line)
        if text.strip():
            delimiter, decimal = found = _delimiter(text)
            fields = _fields(text, delimiter)
            numbers = [_number(field, decimal) for field in fields]
            corner = numbers[0] is None and _is_scale(numbers[1:])
            if corner or (None not in numbers and not np.all(np.isnan(numbers))):  # type: ignore[arg-type]
                _refuse_damaged_row(heading, found)
                decimal = _decimal_comma(lines[number:], delimiter, len(fields), decimal)
                return Layout(tuple(heading), words, number, delimiter, decimal, _columns(fields), corner)
            words = True
        heading.append(line)
    return None if words else Layout(tuple(heading), words, len(heading), None, False, 0)


def _first_lines(path):
    """Lines at the beginning of a text; None if the file is no text."""
    with open_text(path) as file:
        start = file.read(_BEGINNING)
    return None if "\0" in start else start.splitlines()


def _is_scale(numbers):
    return len(numbers) >= _SHORTEST_SCALE and None not in numbers and _equal_steps(np.array(numbers)) is not None


def _decimal_comma(lines, delimiter, count, decimal):
    """Whether commas are decimal, by all lines that are known; `decimal`: whether they are in the first one.

    Raises
    ------
    UnfitTopography
        If that is not clear.
    """
    rows = [_fields(text, delimiter) for line in lines[:_LONGEST_HEADING] if (text := _without_remark(line)).strip()]
    rows = [row[: _columns(row)] for row in rows if len(row) == count]
    fields = [field for row in rows for field in row]
    with_comma = [field for field in fields if "," in field]
    if with_comma and all(map(AMBIGUOUS_COMMA.fullmatch, with_comma)):
        raise UnfitTopography(
            "path",
            f"has numbers such as {with_comma[0]}, whose comma may be decimal or separate thousands; allowed: decimal "
            "points. Replace or remove the commas",
        )
    if with_comma:
        return decimal or (any(map(_DECIMAL_COMMA.match, with_comma)) and not any("." in field for field in fields))
    if delimiter == "," and _are_halves(rows):
        raise UnfitTopography(
            "path",
            f"has commas that stand between numbers and seem to be decimal, too, as in {','.join(rows[0][:4])}; "
            "allowed: semicolons between numbers with decimal commas, quotes around these, or decimal points.",
        )
    return decimal


def _are_halves(rows):
    """Whether columns are in turn the digits before and behind decimal commas.

    Those behind have no sign, and in each column one number of digits. That tells them from integers if some of them
    begin with a zero, or if those before have another number of digits.
    """
    # A row whose last field is empty is shorter.
    width = max(map(len, rows))
    rows = [row for row in rows if len(row) == width]
    if width < 6 or width % 2:
        return False
    columns = list(zip(*rows, strict=True))
    evidence = False
    for k, (before, behind) in enumerate(zip(columns[::2], columns[1::2], strict=True)):
        digits = len(behind[0])
        if not all(field.isdecimal() and len(field) == digits for field in behind):
            return False
        if not all(re.fullmatch(r"[-+]?\d+", field) for field in before):
            return False
        evidence |= digits > 1 and any(field[0] == "0" for field in behind)
        # The first column may number the rows.
        evidence |= k > 0 and any(len(field) != digits for field in before)
    return evidence


def _layout_of_image(path, layout, data):
    """The layout of the image that is wanted, or of the first, of a text that Gwyddion exported."""
    names, headings, first, last, columns, heading = [], [], [], [], [], []
    with open_text(path) as file:
        for number, line in enumerate(file, 1):
            text = _without_remark(line)
            if not text.strip() or number <= layout.first_line:
                heading.append(line.rstrip("\r\n"))
                continue
            width = next((k for k, each in enumerate(heading) if WIDTH.match(each)), None)
            if width is not None:
                names.append(heading[width - 1].partition(":")[2].strip() if width else "")
                headings.append(tuple(heading))
                first.append(number - 1)
                last.append(number)
                columns.append(_columns(_fields(text, layout.delimiter)))
            last[-1:] = [number]
            heading = []
    if data is not None and data not in names:
        raise UnfitTopography("data", f"is no image of the file; allowed: {', '.join(names)}")
    k = 0 if data is None else names.index(data)
    chosen = replace(layout, heading=headings[k], first_line=first[k], last_line=last[k], columns=columns[k])
    return replace(chosen, images=tuple(names), data=names[k] if len(names) > 1 else "")


def reason_against_table(path: Path) -> str | None:
    """Say what keeps a file from being a table of numbers; None if it does not look like one at all."""
    with path.open("rb") as file:
        start = file.read(8)
    for signature, name in _OTHER_COMPRESSION.items():
        if start.startswith(signature):
            return f"is compressed by {name}; allowed: gzip, or a file that is not compressed. Decompress it"
    labelled = None
    for number, line in enumerate(_first_lines(path) or (), 1):
        text = _without_remark(line)
        fields = _fields(text, next((each for each in "\t;," if each in _QUOTED.sub("q", text)), None))
        wrong = [k for k, field in enumerate(fields) if _number(field, decimal_comma=False) is None]
        like = [_LIKE_A_NUMBER.match(fields[k]) is not None for k in wrong]
        if len(fields) < 3 or not wrong or 2 * (len(wrong) - sum(like)) > len(fields):
            continue
        if wrong != [0]:
            return str(_not_a_number(fields[wrong[0]], number, wrong[0] + 1))
        if labelled is not None:
            return (
                f"has labels in the first column, such as {labelled[0][:40]!r} in line {labelled[1]}; allowed: numbers "
                "alone. Remove the column"
            )
        labelled = fields[0], number
    return str(_not_a_number(labelled[0], labelled[1], 1)) if labelled else None


def _refuse_damaged_row(heading, found):
    """Refuse a last line of a heading that is a row of numbers with something else in it, not names of columns."""
    fields = _fields(_without_remark(heading[-1]), found[0]) if heading else []
    numbers = [_number(field, found[1]) for field in fields]
    others = [k for k, number in enumerate(numbers) if number is None]
    if not others or len(fields) < _SHORTEST_SCALE or 2 * len(others) > len(fields):
        return
    # The corner of a row of column numbers may be a name.
    if others != [0] or not _is_scale(numbers[1:]):
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
    separators = _QUOTED.sub("q", text).strip()
    delimiter = next((each for each in "\t;," if each in separators), None)
    by_blanks = re.split(r",?\s+", text.strip())
    if delimiter == "," and len(by_blanks) > 1 and all(map(_DECIMAL_COMMA.match, by_blanks)):
        raise UnfitTopography(
            "path",
            f"has commas in {text[:40]!r} that may be decimal or stand between numbers; allowed: decimal points. "
            "Replace the commas",
        )
    fields = _fields(text, delimiter)
    return delimiter, any(map(_DECIMAL_COMMA.match, fields)) and not any("." in field for field in fields)


def _fields(text: str, delimiter: str | None) -> list[str]:
    """Fields of a line, without blanks and quotes around them."""
    if delimiter is None:
        text = _NO_DATA.sub("nan", text)
    fields = text.split(delimiter)
    if delimiter is not None and '"' in text:
        fields = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
    return [field.strip().strip("\"'").strip() for field in fields]


def _number(field: str, decimal_comma: bool) -> float | None:
    """The number that a field stands for, nan where it is missing, None if it is neither."""
    if field.lower() in _MISSING or _NAN.fullmatch(field):
        return np.nan
    if decimal_comma:
        field = field.replace(",", ".")
    try:
        return float(_FORTRAN.sub(r"\1e\2", field.replace("−", "-"))) if "_" not in field else None
    except ValueError:
        return None


def _lines(path: Path, layout: Layout, gaps: list[tuple[int, int]]) -> Iterator[tuple[int, str]]:
    """Lines of numbers, without remarks, and their numbers, counted from 1.

    What follows an empty line or one of remarks is noted in `gaps`: its row, counted from 0, and its line.
    """
    gaps.clear()
    row, after_gap = 0, False
    with open_text(path) as file:
        for number, line in enumerate(file, 1):
            if layout.last_line is not None and number > layout.last_line:
                return
            if number <= layout.first_line:
                continue
            if not (text := _without_remark(line)).strip():
                after_gap = row > 0
                continue
            if after_gap and len(gaps) < _LONGEST_HEADING:
                gaps.append((row, number))
            row, after_gap = row + 1, False
            yield number, text


def _without_remark(line: str) -> str:
    """A line up to a #, but for one that begins a word such as #N/A."""
    text = _REMARK.split(line, maxsplit=1)[0] if "#" in line else line
    return text.strip(" \r\n\x1a")


def _read_clean(path, layout, gaps):
    """The numbers (rows, columns) of a file that has nothing else, read quickly; None if it has."""
    if layout.decimal_comma or layout.corner:
        return None
    ending = layout.delimiter or ""
    lines = (text.removesuffix(ending) if ending else text for _, text in _lines(path, layout, gaps))
    try:
        values = np.loadtxt(lines, delimiter=layout.delimiter, comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.shape[1] == layout.columns else None


def _read_any(path, layout, gaps):
    """The numbers (rows, columns) of a file field by field, nan where they are missing."""
    rows, widths, numbers = [], [], []
    for number, text in _lines(path, layout, gaps):
        fields = _fields(text, layout.delimiter)
        row = [_number(field, layout.decimal_comma) for field in fields]
        if layout.corner and not rows:
            row[0] = np.nan
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
    # Between blanks an empty corner is no field.
    if layout.delimiter is None and len(rows[0]) == usual - 1 and _is_scale(list(rows[0])):
        rows[0] = np.array([np.nan, *rows[0]])
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

    Raises
    ------
    UnfitTopography
        If a first row or column seems to hold coordinates in unequal steps, or a last one to number the others.
    """
    across = _scale(values, "row")
    heights = values if across is None else values[1:]
    down = _scale(heights.T, "column")
    if down is not None:
        heights = heights[:, 1:]
    for table, name in ((heights[::-1], "row"), (heights.T[::-1], "column")):
        if _scale(table) is not None:
            raise UnfitTopography(
                "path",
                f"has numbers in equal steps in its last {name}, no heights; allowed: heights. Remove the {name}",
            )
    left_out = [name for name, step in (("row", across), ("column", down)) if step is not None]
    remark = f"first {' and '.join(left_out)} left out: numbers in equal steps, not heights"
    steps = None if across is None or down is None else (across, down)
    return heights, steps, remark if left_out else ""


def _scale(table, name=""):
    """Step of a first line that rises or falls in equal steps while the next ones do not; None if it does not.

    A line of that name which rises or falls in other steps, as coordinates do, is refused.
    """
    line, others = table[0], table[1:3]
    if len(table) < 3 or len(line) < _SHORTEST_SCALE or any(_equal_steps(each) is not None for each in others):
        return None
    step = _equal_steps(line, rounded=False)
    if name and step is not None:
        return abs(step)
    if _resembles(line[1:], others[:, 1:]):
        return None
    step = _equal_steps(line)
    if step is not None:
        return abs(step)
    steps = np.diff(line[1:])
    if name and (np.all(steps > 0) or np.all(steps < 0)):
        raise UnfitTopography(
            "path",
            f"has a first {name} whose numbers rise or fall in unequal steps, as coordinates do and heights do not; "
            f"allowed: heights in equal distances. Remove the {name}, or interpolate the heights; if these numbers are "
            "heights, give all of them as .npy",
        )
    return None


def _resembles(line, others):
    """Whether a line can be the neighbour of two other lines of heights."""
    known = np.isfinite(line) & np.all(np.isfinite(others), axis=0)
    if np.count_nonzero(known) < 3:
        return False
    line, others = line[known], others[:, known]
    same = np.mean(np.sign(np.diff(line)) == np.sign(np.diff(others[0])))
    usual = np.std(others[0] - others[1])
    smooth = usual <= _SMOOTH * np.std(others[0])
    return (same >= _SAME_SIGN or smooth) and np.std(line - others[0]) <= _DIFFERENCE * usual


def _equal_steps(line: np.ndarray, *, rounded: bool = True) -> float | None:
    """The step of a line of equal steps, but for a corner, which may be anything; None if they are not equal.

    rounded : whether they may differ by the last digit that is written.
    """
    for part in (line, line[1:]):
        steps = np.diff(part)
        if not len(steps) or not np.all(np.isfinite(steps)):
            continue
        mean = float(part[-1] - part[0]) / len(steps)
        if mean and np.ptp(steps) <= _EQUAL_STEPS * abs(mean):
            return mean
        if not rounded:
            continue
        # Rounding shifts every number, and the ends, by half a unit of the last digit.
        unit = _last_digit(part)
        off = np.max(np.abs(part - part[0] - mean * np.arange(len(part))))
        if np.all(steps * mean >= 0) and off <= 1.001 * unit and np.ptp(part) >= _FEWEST_UNITS * unit:
            return mean
    return None


def _last_digit(numbers):
    """Unit of the last digit of the largest of some numbers as they were written, as far as can be seen."""
    largest = np.max(np.abs(numbers))
    digits = max(len(f"{abs(number):.14e}".partition("e")[0].replace(".", "").rstrip("0")) for number in numbers)
    return 10.0 ** (np.floor(np.log10(largest)) + 1 - digits) if largest else 0.0
