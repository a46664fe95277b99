"""Tables of numbers in text files: where the numbers begin, how they are written, and their values."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from icha.surfaces.measured.array_files import open_instrument
from icha.surfaces.measured.coordinate_lines import is_scale
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.text_headings import WIDTH
from icha.surfaces.measured.text_lines import (
    AMBIGUOUS_COMMA,
    DAMAGED,
    LIKE_A_NUMBER,
    Notation,
    are_decimal_between_blanks,
    are_halves_of_decimals,
    has_decimal_commas,
    open_text,
    strip_remark,
)

# Characters in which the first line of numbers is looked for, and the largest number of lines of a heading.
_BEGINNING, _LONGEST_HEADING = 2**20, 1000
# Fewest fields of a line whose fields are mostly numbers that make it a damaged row, not names of columns.
_FEWEST_FIELDS = 8
_OTHER_COMPRESSION = {b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"\x28\xb5\x2f\xfd": "zstd"}


@dataclass(frozen=True, eq=False)
class Layout:
    """How to read the lines of a text file.

    Attributes
    ----------
    heading : lines above the numbers, remarks included.
    words : whether some lines of the heading are not remarks (#).
    first_line : number of lines above the first line of numbers.
    notation : delimiter and decimal sign.
    columns : numbers in the first line of numbers; 0 if the text has none.
    corner : whether the first line is a scale with a word in its corner.
    images : names of the images that Gwyddion exported to the text; empty without its heading.
    data : name of the image to read, if there are several.
    last_line : number of lines up to the end of this image; None for the whole text.
    """

    heading: tuple[str, ...]
    words: bool
    first_line: int
    notation: Notation
    columns: int
    corner: bool = False
    images: tuple[str, ...] = ()
    data: str = ""
    last_line: int | None = None


class SourceFile:
    """The file of a scan; each piece of it is read on demand, and once.

    Parameters
    ----------
    path : the file.
    data : name of the image to read; None for the first.
    """

    def __init__(self, path: Path, data: str | None = None):
        """Read nothing yet."""
        self.path, self.data = path, data
        # Rows of numbers, counted from 0, that follow an empty line or a remark, with their lines, counted from 1.
        self._gaps: list[tuple[int, int]] = []

    @cached_property
    def layout(self) -> Layout | None:
        """How to read its lines; None if it is not a text with numbers."""
        try:
            layout = _find_layout(self.path)
            if layout is not None and any(map(WIDTH.match, layout.heading)):
                layout = _find_image(self.path, layout, self.data)
        except DAMAGED:
            raise _damaged() from None
        return layout

    @property
    def table_layout(self) -> Layout:
        """The layout; raises UnfitTopography if the file has no numbers."""
        if self.layout is None or not self.layout.columns:
            raise UnfitTopography(
                "path",
                "cannot be read as a table, because it holds no numbers; expected a row of heights, or x y z, in every "
                "line",
            )
        return self.layout

    @cached_property
    def values(self) -> np.ndarray:
        """Numbers (rows, columns) of a text, nan where one is missing.

        Raises
        ------
        UnfitTopography
            If it has no numbers, a field that is not a number, or a row of another length; with the line's number.
        """
        layout = self.table_layout
        try:
            values = None
            if not (layout.notation.decimal_comma or layout.corner):
                values = self._read_plain_numbers(layout)
            return self._read_fields(layout) if values is None else values
        except DAMAGED:
            raise _damaged() from None

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Iterate over the lines of numbers, without remarks, with their numbers, counted from 1; note gaps."""
        self._gaps.clear()
        layout, row, after_gap = self.table_layout, 0, False
        with open_text(self.path) as file:
            for number, line in enumerate(file, 1):
                if layout.last_line is not None and number > layout.last_line:
                    return
                if number <= layout.first_line:
                    continue
                if not (text := strip_remark(line)):
                    after_gap = row > 0
                    continue
                if after_gap and len(self._gaps) < _LONGEST_HEADING:
                    self._gaps.append((row, number))
                row, after_gap = row + 1, False
                yield number, text

    def _read_plain_numbers(self, layout):
        """Read the numbers (rows, columns) of a file that has nothing else, quickly; None if it has."""
        ending = layout.notation.delimiter or ""
        lines = (text.removesuffix(ending) for _, text in self._lines())
        try:
            values = np.loadtxt(lines, delimiter=layout.notation.delimiter, comments=None, ndmin=2)
        except ValueError:
            return None
        return values if values.shape[1] == layout.columns else None

    def _read_fields(self, layout):
        """Read the numbers (rows, columns) of a file field by field, nan where they are missing."""
        rows, line_numbers = [], []
        for number, text in self._lines():
            fields = layout.notation.fields(text)
            row = [layout.notation.number(field) for field in fields]
            if layout.corner and not rows:
                row[0] = np.nan
            if None in row:
                raise _not_a_number(fields, row.index(None), number)
            rows.append(np.array(row))
            line_numbers.append(number)
        usual = int(np.bincount([len(row) for row in rows]).argmax())
        # A delimiter after the last number of every row does not begin a column.
        if usual == layout.columns + 1 and all(np.isnan(row[-1]) for row in rows if len(row) == usual):
            rows = [row[: layout.columns] if len(row) == usual else row for row in rows]
            usual = layout.columns
        # With blanks between fields an empty corner has no field.
        if layout.notation.delimiter is None and len(rows[0]) == usual - 1 and is_scale(list(rows[0])):
            rows[0] = np.array([np.nan, *rows[0]])
        for number, row in zip(line_numbers, rows, strict=True):
            if len(row) != usual:
                raise UnfitTopography(
                    "path",
                    f"has {len(row)} numbers in line {number} and {usual} in most lines; expected rows of one length. "
                    "Complete or remove the line; missing points may be NaN",
                )
        return np.array(rows)

    def refuse_blocks(self) -> None:
        """Raise UnfitTopography if empty lines or remarks divide the rows into blocks, as several images are written.

        Such lines between all rows divide nothing.
        """
        rows = [row for row, _ in self._gaps]
        if rows and min(np.diff([0, *rows, len(self.values)])) > 1:
            raise UnfitTopography(
                "path",
                f"has {len(rows) + 1} blocks of rows, the second from line {self._gaps[0][1]}; expected one image. "
                "Remove the other blocks or, if all are one image, the empty lines and remarks between them",
            )

    @cached_property
    def instrument(self):
        """The file as SurfaceTopography opens it; None if SurfaceTopography does not know its format."""
        return open_instrument(self.path)


def _damaged():
    return UnfitTopography(
        "path", "is compressed by gzip and damaged or cut off; expected the whole file. Copy or compress it again"
    )


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
    return [] if "\0" in start else start.splitlines()


def _column_count(fields):
    """Count fields, without an empty one behind a delimiter at the end."""
    return len(fields) - (len(fields) > 1 and fields[-1] == "")


def _find_layout(path: Path) -> Layout | None:
    """Find the first line of numbers and how numbers are written; None if the file is not a text with numbers.

    A text of nothing but remarks has no columns. Raises UnfitTopography if it is not clear whether commas are decimal.
    """
    lines = _first_lines(path)
    heading: list[str] = []
    words = not lines
    for number, line in enumerate(lines[:_LONGEST_HEADING]):
        text = strip_remark(line)
        if text:
            notation = Notation.of_line(text)
            if notation.delimiter == "," and are_decimal_between_blanks(text):
                raise UnfitTopography(
                    "path",
                    f"has commas in {text[:40]!r} that may be decimal or stand between numbers; expected decimal "
                    "points. Replace the commas",
                )
            fields = notation.fields(text)
            numbers = [notation.number(field) for field in fields]
            corner = numbers[0] is None and is_scale(numbers[1:])
            if corner or (None not in numbers and not np.isnan(np.array(numbers, dtype=float)).all()):
                if heading:
                    _refuse_damaged_row(heading[-1], len(heading), notation)
                notation = _decide_on_commas(notation, lines[number:], len(fields))
                return Layout(tuple(heading), words, number, notation, _column_count(fields), corner)
            words = True
        heading.append(line)
    return None if words else Layout(tuple(heading), words, len(heading), Notation(None), 0)


def _refuse_damaged_row(line, number, notation):
    """Refuse the last line of a heading if it is a damaged row of numbers, and not a row of column names."""
    fields = notation.fields(strip_remark(line))
    wrong = notation.wrong_fields(fields)
    if not wrong or len(fields) < _FEWEST_FIELDS or 2 * len(wrong) > len(fields):
        return
    # The corner of a row of column numbers may be a name.
    if wrong != [0] or not is_scale([notation.number(field) for field in fields[1:]]):
        raise _not_a_number(fields, wrong[0], number)


def _decide_on_commas(notation, lines, count):
    """Decide from all known lines with `count` fields whether commas are decimal; if unclear, raise UnfitTopography."""
    rows = [notation.fields(text) for line in lines[:_LONGEST_HEADING] if (text := strip_remark(line))]
    rows = [row[: _column_count(row)] for row in rows if len(row) == count]
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


def _find_image(path, layout, data):
    """Find the image with the name `data`, or the first one, in a text that Gwyddion exported."""
    images, last_lines, heading = [], [], []
    with open_text(path) as file:
        for number, line in enumerate(file, 1):
            text = strip_remark(line)
            if not text or number <= layout.first_line:
                heading.append(line.rstrip("\r\n"))
                continue
            width = next((k for k, each in enumerate(heading) if WIDTH.match(each)), None)
            if width is not None:
                name = heading[width - 1].partition(":")[2].strip() if width else ""
                columns = _column_count(layout.notation.fields(text))
                image = replace(layout, heading=tuple(heading), first_line=number - 1, columns=columns, data=name)
                images.append(image)
                last_lines.append(number)
            last_lines[-1] = number
            heading = []
    names = tuple(image.data for image in images)
    if data is not None and data not in names:
        raise UnfitTopography("data", f"is not an image of the file; expected one of: {', '.join(names)}")
    chosen = 0 if data is None else names.index(data)
    name = names[chosen] if len(names) > 1 else ""
    return replace(images[chosen], images=names, data=name, last_line=last_lines[chosen])


def reason_against_table(path: Path) -> str | None:
    """Return why a file that resembles a table of numbers cannot be read; None if the file resembles no table."""
    with path.open("rb") as file:
        start = file.read(8)
    for signature, name in _OTHER_COMPRESSION.items():
        if start.startswith(signature):
            return f"is compressed by {name}; expected gzip, or a file that is not compressed. Decompress it"
    labelled = None
    for number, line in enumerate(_first_lines(path), 1):
        text = strip_remark(line)
        notation = Notation.of_line(text)
        fields = notation.fields(text)
        wrong = notation.wrong_fields(fields)
        words = [k for k in wrong if not LIKE_A_NUMBER.match(fields[k])]
        if len(fields) < 3 or not wrong or 2 * len(words) > len(fields):
            continue
        if wrong != [0]:
            return str(_not_a_number(fields, wrong[0], number))
        if labelled is not None:
            return (
                f"has labels in the first column, such as {labelled[0][0][:40]!r} in line {labelled[1]}; expected "
                "numbers alone. Remove the column"
            )
        labelled = fields, number
    return str(_not_a_number(labelled[0], 0, labelled[1])) if labelled else None
