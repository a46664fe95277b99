"""Read tables of numbers from text files: first line of numbers, notation, values, rows of coordinates."""

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

# The first line of numbers must lie within the first `_BEGINNING` characters and `_LONGEST_HEADING` lines.
_BEGINNING, _LONGEST_HEADING = 2**20, 1000
# A line is a damaged row, not titles, if it has at least this number of fields, and at least half resemble numbers.
_FEWEST_FIELDS = 8
# Steps count as equal if their relative difference is at most this value, or if rounding explains the difference.
_EQUAL_STEPS = 1e-2
# Smallest range of coordinates, in units of the last digit.
_FEWEST_UNITS = 4
# Limits in `_resembles` for the first three lines of a table. Lines 1 and 2 differ by at most `_DIFFERENCE` times the
# difference of lines 2 and 3. In addition, at least the fraction `_SAME_SIGN` of the steps has the same sign in lines 1
# and 2, or lines 2 and 3 differ by at most `_SMOOTH` times their heights.
_DIFFERENCE, _SAME_SIGN, _SMOOTH = 3, 0.8, 0.2
# Fewest numbers in a row or column of coordinates.
_FEWEST_COORDINATES = 8


@dataclass(frozen=True, eq=False)
class Layout:
    """Heading, notation and number of columns of a text file with a table.

    Attributes
    ----------
    heading : lines above the numbers, including remarks.
    notation : delimiter and decimal sign.
    columns : number of columns, counted in the first line of numbers.
    """

    heading: tuple[str, ...]
    notation: Notation
    columns: int


@dataclass(eq=False)
class SourceFile:
    """Text file or instrument file of a scan. Each attribute is read from the file once, at its first use."""

    path: Path

    @cached_property
    def layout(self) -> Layout | None:
        """Heading, notation and number of columns of the file; None if the file is not a text with numbers."""
        return _find_layout(self.path)

    @property
    def table_layout(self) -> Layout:
        """Heading, notation and number of columns; raises UnfitTopography if the file has no numbers."""
        if self.layout is None:
            raise UnfitTopography(
                "path",
                "cannot be read as a table, because it has no numbers; expected a row of heights, or x y z, in "
                "every line",
            )
        return self.layout

    @property
    def values(self) -> np.ndarray:
        """Numbers in the file, array of shape (rows, columns); nan where a number is missing.

        Raises UnfitTopography if the file has no numbers, a field that is not a number, or rows of different lengths.
        """
        return self._table[0]

    @cached_property
    def _table(self):
        """Numbers in the file, array of shape (rows, columns), and the line number (from 1) of each row."""
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
        # A delimiter after the last number of every row does not add a column.
        if usual == columns + 1 and all(np.isnan(row[-1]) for row in rows if len(row) == usual):
            rows = [row[:columns] if len(row) == usual else row for row in rows]
            usual = columns
        for line, row in zip(lines, rows, strict=True):
            if len(row) != usual:
                raise UnfitTopography(
                    "path",
                    f"has {len(row)} numbers in line {line} but {usual} in most lines; expected rows of one "
                    "length. Complete or remove the line; missing heights may be NaN",
                )
        return np.array(rows), np.array(lines)

    def refuse_blocks(self) -> None:
        """Raise UnfitTopography if empty lines or remarks divide the rows into blocks, as in files with several images.

        A file with empty lines or remarks between all rows is accepted.
        """
        values, lines = self._table
        begins = np.flatnonzero(np.diff(lines) > 1) + 1
        if len(begins) and min(np.diff([0, *begins, len(values)])) > 1:
            raise UnfitTopography(
                "path",
                f"has {len(begins) + 1} blocks of rows, the second from line {lines[begins[0]]}; expected one "
                "image. Remove all blocks but one. If the blocks form one image, remove the lines between the "
                "blocks instead",
            )

    @cached_property
    def instrument(self):
        """The file, opened with SurfaceTopography; None if SurfaceTopography does not support the format."""
        return open_instrument(self.path)


def _not_a_number(fields, index, line):
    return UnfitTopography(
        "path",
        f"has {fields[index][:40]!r} in line {line}, column {index + 1}; expected a number, or NaN where a point is "
        "missing. Correct or remove the line",
    )


def _first_lines(path):
    """Read the lines at the beginning of a text file; return an empty list if the file is not text."""
    with open_text(path) as file:
        start = file.read(_BEGINNING)
    return [] if "\0" in start else start.splitlines()[:_LONGEST_HEADING]


def _count_columns(fields):
    """Count the fields of a line, without an empty last field after a delimiter."""
    return len(fields) - (len(fields) > 1 and fields[-1] == "")


def _find_layout(path: Path) -> Layout | None:
    """Find the first line of numbers and the notation of the numbers; None if the file is not a text with numbers.

    Raises UnfitTopography if commas may be decimal or delimiters, or if the line above the numbers is a damaged row.
    """
    lines = _first_lines(path)
    for number, line in enumerate(lines):
        if not (text := strip_remark(line)):
            continue
        notation = Notation.of_line(text)
        if notation.delimiter == "," and are_decimal_between_blanks(text):
            raise UnfitTopography(
                "path",
                f"has commas in {text[:40]!r} that may be decimal signs or delimiters; expected decimal points. "
                "Replace the commas",
            )
        fields = notation.fields(text)
        numbers = [notation.number(field) for field in fields]
        if None not in numbers and not np.isnan(np.array(numbers, dtype=float)).all():
            if number and (damage := _find_damage(strip_remark(lines[number - 1]), number, notation)):
                raise damage
            notation = _decide_on_commas(notation, lines[number:], len(fields))
            return Layout(tuple(lines[:number]), notation, _count_columns(fields))
    return None


def _find_damage(text, number, notation):
    """Return the error for a damaged row, where most but not all fields are numbers; None for other lines."""
    fields = notation.fields(text)
    wrong = [k for k, field in enumerate(fields) if notation.number(field) is None]
    words = [k for k in wrong if not LIKE_A_NUMBER.match(fields[k])]
    if not wrong or len(fields) < _FEWEST_FIELDS or 2 * len(words) > len(fields):
        return None
    return _not_a_number(fields, wrong[0], number)


def _decide_on_commas(notation, lines, count):
    """Decide from all lines with `count` fields whether commas are decimal signs; return the completed notation.

    Raises UnfitTopography if it is not clear whether the commas are decimal signs.
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
            f"has both decimal commas and commas as delimiters, as in {','.join(rows[0][:4])}; expected decimal "
            "points, semicolons as delimiters, or quotes around numbers with decimal commas",
        )
    return replace(notation, decimal_comma=notation.decimal_comma or has_decimal_commas(fields))


def first_damaged_line(path: Path) -> UnfitTopography | None:
    """Return the error for the first damaged row, where most but not all fields are numbers; None if there is none."""
    texts = map(strip_remark, _first_lines(path))
    damages = (_find_damage(text, number, Notation.of_line(text)) for number, text in enumerate(texts, 1))
    return next(filter(None, damages), None)


# The next functions find rows and columns of coordinates or of point numbers. Heights of a rough surface do not rise in
# equal steps along a row or column. If heights rise in equal steps in all rows, the surface is a plane.


def drop_coordinates(values: np.ndarray) -> tuple[np.ndarray, tuple[float, float] | None, str]:
    """Remove the first row or column of a table if it contains coordinates or point numbers instead of heights.

    Returns
    -------
    Heights; steps of the coordinates along x and y, or None without both coordinates; and a remark on removed parts.

    Raises UnfitTopography if the first row or column seems to contain coordinates with unequal steps, or if the last
    row or column contains numbers with equal steps.
    """
    heights, steps = values, {}
    for name in ("row", "column"):
        table = heights if name == "row" else heights.T
        first, last = _coordinate_step(table), _coordinate_step(table[::-1])
        uneven = first is not None and np.isnan(first)
        if uneven or (last is not None and not np.isnan(last)):
            raise UnfitTopography(
                "path",
                f"has a {'first' if uneven else 'last'} {name} of numbers that seem to be coordinates; "
                f"expected heights on a regular grid. Remove the {name}, or interpolate the heights. If all numbers "
                "are heights, save them as a .npy file",
            )
        if first is not None:
            steps[name] = first
            heights = table[1:] if name == "row" else table[1:].T
    remark = f"first {' and '.join(steps)} left out: numbers in equal steps, not heights" if steps else ""
    return heights, (steps["row"], steps["column"]) if len(steps) == 2 else None, remark


def _coordinate_step(table):
    """Return the step of the coordinates in the first line of a table: nan if steps differ, None if it has heights."""
    line, others = table[0], table[1:3]
    if len(table) < 3 or len(line) < _FEWEST_COORDINATES or any(_equal_step(each) is not None for each in others):
        return None
    step = _equal_step(line, rounded=False)
    if step is None and not _resembles(line[1:], others[:, 1:]):
        step = _equal_step(line)
        differences = np.diff(line[1:])
        if step is None and (np.all(differences > 0) or np.all(differences < 0)):
            step = np.nan
    return None if step is None else abs(step)


def _resembles(line, others):
    """Return whether the heights in a line are similar to the heights in the next two lines."""
    known = np.isfinite(line) & np.all(np.isfinite(others), axis=0)
    if np.count_nonzero(known) < 3:
        return False
    line, others = line[known], others[:, known]
    same = np.mean(np.sign(np.diff(line)) == np.sign(np.diff(others[0])))
    usual = np.std(others[0] - others[1])
    smooth = usual <= _SMOOTH * np.std(others[0])
    return (same >= _SAME_SIGN or smooth) and np.std(line - others[0]) <= _DIFFERENCE * usual


def _equal_step(line: np.ndarray, *, rounded: bool = True) -> float | None:
    """Return the step from number to number in a line; None if the steps differ, also without the first number.

    rounded : True if steps may differ because numbers are rounded to few digits.
    """
    for numbers in (line, line[1:]):
        steps = np.diff(numbers)
        if not len(steps) or not np.all(np.isfinite(steps)):
            continue
        mean = float(numbers[-1] - numbers[0]) / len(steps)
        if mean and np.ptp(steps) <= _EQUAL_STEPS * abs(mean):
            return mean
        if not rounded:
            continue
        # Rounding shifts every number by up to half a unit of the last digit.
        unit = _last_digit(numbers)
        error = np.max(np.abs(numbers - numbers[0] - mean * np.arange(len(numbers))))
        if np.all(steps * mean >= 0) and error <= 1.001 * unit and np.ptp(numbers) >= _FEWEST_UNITS * unit:
            return mean
    return None


def _last_digit(numbers):
    """Return the probable unit of the last digit of the largest number, such as 0.01 for 3.25."""
    largest = np.max(np.abs(numbers))
    digits = max(len(f"{abs(number):.14e}".partition("e")[0].replace(".", "").rstrip("0")) for number in numbers)
    return 10.0 ** (np.floor(np.log10(largest)) + 1 - digits) if largest else 0.0
