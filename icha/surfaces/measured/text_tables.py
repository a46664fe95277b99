"""Tables of numbers in text files: where the numbers begin, how they are written, and their values."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from icha.surfaces.measured.array_files import open_instrument
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.text_lines import (
    AMBIGUOUS_COMMA,
    LIKE_A_NUMBER,
    Notation,
    are_decimal_between_blanks,
    are_halves_of_decimals,
    has_decimal_commas,
    open_text,
    strip_remark,
)

# Characters and lines at the beginning of a file in which the first line of numbers must be.
_BEGINNING, _LONGEST_HEADING = 2**20, 1000
# Fewest fields of a line that counts as a damaged row if most of its fields are numbers, not as titles of columns.
_FEWEST_FIELDS = 8


@dataclass(frozen=True, eq=False)
class Layout:
    """How to read the lines of a text file.

    Attributes
    ----------
    heading : lines above the numbers, remarks included.
    words : whether the heading contains lines that are not remarks (#).
    notation : delimiter and decimal sign.
    columns : numbers in the first line of numbers.
    """

    heading: tuple[str, ...]
    words: bool
    notation: Notation
    columns: int


class SourceFile:
    """The file of a scan; each attribute is read from the file once, at its first use.

    Attributes
    ----------
    path : the file.
    """

    def __init__(self, path: Path):
        """Read nothing yet."""
        self.path = path

    @cached_property
    def layout(self) -> Layout | None:
        """How to read the lines of the file; None if it is not a text with numbers."""
        return _find_layout(self.path)

    @property
    def table_layout(self) -> Layout:
        """The layout; raises UnfitTopography if the file has no numbers."""
        if self.layout is None:
            raise UnfitTopography(
                "path",
                "cannot be read as a table, because it holds no numbers; expected a row of heights, or x y z, in every "
                "line",
            )
        return self.layout

    @property
    def values(self) -> np.ndarray:
        """Numbers (rows, columns) of a text, nan where one is missing.

        Raises UnfitTopography if the file has no numbers, a field that is not a number, or rows of different lengths.
        """
        return self._table[0]

    @cached_property
    def _table(self):
        """Numbers (rows, columns), and the line in the file, from 1, of each row."""
        notation, columns = self.table_layout.notation, self.table_layout.columns
        rows, lines = [], []
        with open_text(self.path) as file:
            for line, text in enumerate(map(strip_remark, file), 1):
                if not text or line <= len(self.table_layout.heading):
                    continue
                row = notation.numbers(text)
                if None in row:
                    raise _not_a_number(notation.fields(text), row.index(None), line)
                rows.append(np.array(row))
                lines.append(line)
        usual = int(np.bincount([len(row) for row in rows]).argmax())
        # A delimiter after the last number of every row does not begin a column.
        if usual == columns + 1 and all(np.isnan(row[-1]) for row in rows if len(row) == usual):
            rows = [row[:columns] if len(row) == usual else row for row in rows]
            usual = columns
        for line, row in zip(lines, rows, strict=True):
            if len(row) != usual:
                raise UnfitTopography(
                    "path",
                    f"has {len(row)} numbers in line {line} and {usual} in most lines; expected rows of one length. "
                    "Complete or remove the line; missing points may be NaN",
                )
        return np.array(rows), np.array(lines)

    def refuse_blocks(self) -> None:
        """Raise UnfitTopography if empty lines or remarks divide the rows into blocks, as in files of several images.

        Empty lines or remarks between all rows are accepted.
        """
        values, lines = self._table
        begins = np.flatnonzero(np.diff(lines) > 1) + 1
        if len(begins) and min(np.diff([0, *begins, len(values)])) > 1:
            raise UnfitTopography(
                "path",
                f"has {len(begins) + 1} blocks of rows, the second from line {lines[begins[0]]}; expected one image. "
                "Remove the other blocks or, if all are one image, the empty lines and remarks between them",
            )

    @cached_property
    def instrument(self):
        """The file as SurfaceTopography opens it; None if SurfaceTopography does not know its format."""
        return open_instrument(self.path)


def _not_a_number(fields, index, line):
    return UnfitTopography(
        "path",
        f"has {fields[index][:40]!r} in line {line}, column {index + 1}; expected a number, or NaN where a point is "
        "missing. Correct or remove the line",
    )


def _first_lines(path):
    """Read the lines at the beginning of a text; an empty list if the file is not text."""
    with open_text(path) as file:
        start = file.read(_BEGINNING)
    return [] if "\0" in start else start.splitlines()[:_LONGEST_HEADING]


def _count_columns(fields):
    """Count fields, without an empty one after a delimiter at the end."""
    return len(fields) - (len(fields) > 1 and fields[-1] == "")


def _find_layout(path: Path) -> Layout | None:
    """Find the first line of numbers and how numbers are written; None if the file is not a text with numbers.

    Raises UnfitTopography if commas may or may not be decimal, or if the line above the numbers is a damaged row.
    """
    lines, words = _first_lines(path), False
    for number, line in enumerate(lines):
        if not (text := strip_remark(line)):
            continue
        notation = Notation.of_line(text)
        if notation.delimiter == "," and are_decimal_between_blanks(text):
            raise UnfitTopography(
                "path",
                f"has commas in {text[:40]!r} that may be decimal or stand between numbers; expected decimal "
                "points. Replace the commas",
            )
        fields = notation.fields(text)
        numbers = [notation.number(field) for field in fields]
        if None not in numbers and not np.isnan(np.array(numbers, dtype=float)).all():
            if number and (damage := _find_damage(strip_remark(lines[number - 1]), number, notation)):
                raise damage
            notation = _decide_on_commas(notation, lines[number:], len(fields))
            return Layout(tuple(lines[:number]), words, notation, _count_columns(fields))
        words = True
    return None


def _find_damage(text, number, notation):
    """Return the error for a line that resembles a row of numbers but has other fields, too; None for other lines."""
    fields = notation.fields(text)
    wrong = [k for k, field in enumerate(fields) if notation.number(field) is None]
    words = [k for k in wrong if not LIKE_A_NUMBER.match(fields[k])]
    if not wrong or len(fields) < _FEWEST_FIELDS or 2 * len(words) > len(fields):
        return None
    return _not_a_number(fields, wrong[0], number)


def _decide_on_commas(notation, lines, count):
    """Return the notation after deciding, from all lines with `count` fields, whether their commas are decimal.

    Raises UnfitTopography if this is not clear.
    """
    rows = [notation.fields(text) for line in lines if (text := strip_remark(line))]
    rows = [row[: _count_columns(row)] for row in rows if len(row) == count]
    fields = [field for row in rows for field in row]
    with_comma = [field for field in fields if "," in field]
    if with_comma and all(map(AMBIGUOUS_COMMA.fullmatch, with_comma)):
        raise UnfitTopography(
            "path",
            f"has numbers such as {with_comma[0]}, whose comma may be decimal or separate thousands; expected decimal "
            "points. Replace or remove the commas",
        )
    if notation.delimiter == "," and not with_comma and are_halves_of_decimals(rows):
        raise UnfitTopography(
            "path",
            f"has commas that stand between numbers and seem to be decimal, too, as in {','.join(rows[0][:4])}; "
            "expected semicolons between numbers with decimal commas, quotes around these, or decimal points",
        )
    return replace(notation, decimal_comma=notation.decimal_comma or has_decimal_commas(fields))


def first_damaged_line(path: Path) -> UnfitTopography | None:
    """Return the error for the first line that resembles a row of numbers but has other fields, too, or None."""
    texts = map(strip_remark, _first_lines(path))
    damages = (_find_damage(text, number, Notation.of_line(text)) for number, text in enumerate(texts, 1))
    return next(filter(None, damages), None)
