"""Read tables of numbers from text files: encoding, heading, delimiter, decimal sign, and numbers (with pandas)."""

import csv
import gzip
import io
import itertools
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TextIO

import numpy as np

from icha.surfaces.measured.array_files import open_instrument
from icha.surfaces.measured.settings import UnfitTopography

# Words that mark a missing height, and words that are written as "nan" before pandas reads the numbers: nan of Windows
# and C, and the stars that Fortran writes for numbers that are too wide.
_WORDS = (
    "- -- --- ? nan -nan +nan na n/a #n/a #na bad none null nil nodata no_data missing masked invalid void undefined "
    "undef #value! #num! #div/0! #null! #ref!"
).split()
_MISSING = frozenset(["", *_WORDS, *map(str.upper, _WORDS), *map(str.capitalize, _WORDS), "NaN", "-NaN", "NoData"])
_NAN = re.compile(r"[-+]?1\.#(ind|qnan|snan)\d*|[-+]?nan\([^)]*\)|\bno data\b|\*+", re.IGNORECASE)
# A remark begins with #. But Windows writes nan as 1.#IND and 1.#QNAN, and Excel writes errors such as #N/A.
_REMARK = re.compile(r"(?<!1\.)#(?!N/A|NA\b|VALUE!|NUM!|DIV/0!|NULL!|REF!)", re.IGNORECASE)
# The exponent of a number in double precision, as Fortran writes it, such as 1.5D-3.
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[-+]?\d)")
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)(e[-+]?\d+)?|[-+]?inf(inity)?", re.IGNORECASE)
_PLAIN = frozenset("0123456789+-.eE,; \t")
# A number with three digits after a comma. The comma may be a decimal sign, or it may separate thousands.
AMBIGUOUS_COMMA = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}(?!\d)")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
# A number, with any separator of thousands.
_LIKE_A_NUMBER = re.compile(r"[-+]?\d[\d.,' ]*")
# The first line of numbers must lie within the first `_BEGINNING` characters and `_LONGEST_HEADING` lines.
_BEGINNING, _LONGEST_HEADING = 2**20, 1000
# A line is a damaged row, not titles, if it has at least this number of fields, and at least half resemble numbers.
_FEWEST_FIELDS = 8
# Lines that pandas reads at a time; this bounds the memory for text.
_BATCH = 2**13
# Fewest numbers in a row or column of coordinates.
_FEWEST_COORDINATES = 8
# Steps from number to number count as similar if the largest one is at most this multiple of the smallest one that is
# not zero: equal steps that are rounded to few digits.
_SIMILAR_STEPS = 2.01


@dataclass(frozen=True, eq=False)
class Layout:
    """Heading and notation of a text file with a table.

    Attributes
    ----------
    heading : lines above the numbers, including remarks.
    delimiter : tab, semicolon, comma or blank.
    decimal : decimal sign, a point or a comma.
    fields : number of fields of each row, including an empty field after a delimiter at the end.
    columns : number of columns, without an empty field at the end.
    wrapped : True if a row continues on the next lines, as the heading of a known format states.
    """

    heading: tuple[str, ...]
    delimiter: str
    decimal: str
    fields: int
    columns: int
    wrapped: bool


@dataclass(eq=False)
class SourceFile:
    """Text file or instrument file of a scan. Each attribute is read from the file once, at its first use."""

    path: Path

    @cached_property
    def layout(self) -> Layout | None:
        """Heading and notation of the file; None if the file is not a text with numbers."""
        return _find_layout(first_lines(self.path))

    @property
    def table_layout(self) -> Layout:
        """Heading and notation; raises UnfitTopography if the file has no numbers."""
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

    @property
    def ends_with_delimiters(self) -> bool:
        """Whether every line ends with a delimiter; `values` does not contain an empty column after it."""
        return self._table[2]

    @cached_property
    def _table(self):
        """Numbers in the file, the line number (from 1) of each row, and whether all lines end with a delimiter."""
        layout, end = self.table_layout, self.table_layout.delimiter
        values, numbers, ends = [], [], end != " "
        rows = self._rows()
        while batch := list(itertools.islice(rows, _BATCH)):
            values.append(_read_numbers(batch, layout))
            numbers.append(np.array([number for number, _ in batch]))
            ends = ends and all(text.endswith(end) for _, text in batch)
        return np.concatenate(values)[:, : layout.fields - ends], np.concatenate(numbers), ends

    def _rows(self) -> Iterator[tuple[int, str]]:
        """Yield the line number and the text of each row; raise UnfitTopography if rows have different lengths."""
        layout, rows = self.table_layout, self._lines()
        if layout.wrapped:
            numbers = ((line, field) for line, text in rows for field in text.split())
            while row := list(itertools.islice(numbers, layout.fields)):
                if len(row) < layout.fields:
                    raise UnfitTopography(
                        "path",
                        f"has {len(row)} numbers in the last row, but its heading states {layout.fields}; expected a "
                        "whole table. Export the table again",
                    )
                yield row[0][0], " ".join(field for _, field in row)
            return
        for line, text in rows:
            count = _count_fields(text, layout.delimiter)
            if count != layout.fields:
                raise UnfitTopography(
                    "path",
                    f"has {count} numbers in line {line} but {layout.fields} in most lines; expected rows of one "
                    "length. Complete or remove the line; missing heights may be NaN",
                )
            yield line, text

    def _lines(self):
        """Yield the line number and the text of each line of numbers."""
        layout = self.table_layout
        with open_text(self.path) as file:
            for line, text in enumerate(itertools.islice(file, len(layout.heading), None), len(layout.heading) + 1):
                text = _clean(text, layout.delimiter)
                # A line of tabs is a row of missing heights if it has as many tabs as the other rows.
                if text and (not text.isspace() or _count_fields(text, layout.delimiter) == layout.fields):
                    yield line, text

    def refuse_blocks(self) -> None:
        """Raise UnfitTopography if empty lines or remarks divide the rows into blocks, as in files with several images.

        A file with empty lines or remarks between all rows is accepted.
        """
        values, lines, _ = self._table
        begins = np.flatnonzero(np.diff(lines) > 1) + 1
        if not self.table_layout.wrapped and len(begins) and min(np.diff([0, *begins, len(values)])) > 1:
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


def open_text(path: Path) -> TextIO:
    """Open a text file with the right encoding; the file may be compressed by gzip."""
    with path.open("rb") as file:
        compressed = file.read(2) == b"\x1f\x8b"
    opener = gzip.open if compressed else open
    with opener(path, "rb") as file:
        start = file.read(2**12)
    return opener(path, "rt", encoding=_guess_encoding(start), errors="replace")


def _guess_encoding(start: bytes) -> str:
    """Guess the encoding: UTF-16 if the text begins with its byte order mark, else UTF-8, else Windows-1252."""
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        # The last line is left out, because `start` may end within a character.
        start[: start.rfind(b"\n") + 1].decode("utf-8-sig")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def first_lines(path: Path) -> list[str]:
    """Read the lines at the beginning of a text file; return an empty list if the file is not text."""
    with open_text(path) as file:
        start = file.read(_BEGINNING)
    return [] if "\0" in start else start.split("\n")[:_LONGEST_HEADING]


def _clean(line: str, delimiter: str = " ") -> str:
    """Return a line without remark (#) and outer blanks, with numbers and words for missing heights as pandas reads.

    Tabs remain at the ends, because they may separate fields.
    """
    text = (_REMARK.split(line, maxsplit=1)[0] if "#" in line else line).strip(" \r\n\x1a")
    text = text.replace("−", "-")
    # Plain numbers need no regular expression; these would be slow in long lines.
    if not _PLAIN.issuperset(text):
        text = _FORTRAN.sub("e", _NAN.sub("nan", text))
    if delimiter != " " and (" " in text or "\t" in text):
        text = re.sub(rf"[ \t]*{delimiter}[ \t]*" if delimiter in ",;" else " *\t *", delimiter, text)
    return text


def strip_remark(line: str) -> str:
    """Return a line without remark (#) and outer blanks."""
    return _REMARK.split(line, maxsplit=1)[0].strip()


def _fields(text, delimiter):
    """Split a line into fields without quotes and outer blanks."""
    if delimiter == " ":
        fields = text.split()
    elif '"' in text:
        fields = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
    else:
        fields = text.split(delimiter)
    return [field.strip(' "\t') for field in fields]


def _count_fields(text, delimiter):
    if delimiter == " " or '"' in text:
        return len(_fields(text, delimiter))
    return text.count(delimiter) + 1


def _is_number(field):
    """Return whether a field is a number or a word for a missing height."""
    return field in _MISSING or _NUMBER.fullmatch(field) is not None


def _read_numbers(rows, layout):
    """Read rows of numbers with pandas; raise UnfitTopography that names the first field that is not a number."""
    import pandas as pd  # slow to import

    try:
        table = "\n".join(text for _, text in rows)
        # pandas would read the word "true" as 1.
        if not ("true" in table.lower() or "false" in table.lower()):
            return pd.read_csv(
                io.BytesIO(table.encode()),
                sep=r"\s+" if layout.delimiter == " " else layout.delimiter,
                decimal=layout.decimal,
                quotechar='"',
                skipinitialspace=True,
                header=None,
                names=range(layout.fields),
                index_col=False,
                dtype=float,
                na_values=list(_MISSING),
                keep_default_na=False,
                skip_blank_lines=False,
                encoding="utf-8",
            ).to_numpy()
    except ValueError:
        pass
    for line, text in rows:
        fields = _fields(text, layout.delimiter)
        for k, field in enumerate(fields):
            if not _is_number(field) or {",": ".", ".": ","}[layout.decimal] in field:
                raise _not_a_number(field, k, line)
    raise UnfitTopography("path", f"has a field that is not a number between lines {rows[0][0]} and {rows[-1][0]}")


def _not_a_number(field, index, line):
    return UnfitTopography(
        "path",
        f"has {field[:40]!r} in line {line}, column {index + 1}; expected a number, or NaN where a point is "
        "missing. Correct or remove the line",
    )


def _find_layout(lines: list[str]) -> Layout | None:
    """Find the first line of numbers, and the notation of the numbers; None if the text has no numbers.

    Raises UnfitTopography if commas may be decimal or delimiters, or if the line above the numbers is a damaged row.
    """
    start, stated = _known_beginning(lines)
    damages = []
    for number, line in enumerate(lines[start:], start):
        if (text := _clean(line)).strip():
            if delimiter := _find_delimiter(text):
                break
            damages.append(_find_damage(text, number + 1))
    else:
        if damage := next(filter(None, damages), None):
            raise damage
        return None
    # The line above the numbers.
    if damages and damages[-1]:
        raise damages[-1]
    texts = [text for line in lines[number:] if (text := _clean(line, delimiter)).strip()]
    counts = Counter(_count_fields(text, delimiter) for text in texts)
    fields = max(counts, key=counts.__getitem__)
    # Rows of missing heights above the first number belong to the table.
    while number > start and fields > 1:
        above = _fields(_clean(lines[number - 1], delimiter), delimiter)
        if len(above) != fields or not all(field in _MISSING for field in above):
            break
        number -= 1
    decimal = _find_decimal_sign([_fields(text, delimiter) for text in texts], delimiter)
    wrapped = delimiter == " " and stated not in (None, fields)
    ends = delimiter != " " and fields > 1 and all(text.endswith(delimiter) for text in texts)
    fields = stated if wrapped else fields
    return Layout(tuple(lines[:number]), delimiter, decimal, fields, fields - ends, wrapped)


def _known_beginning(lines):
    """Return the number of heading lines, and the columns (or None), that the heading of a known format states.

    Sources: help of Golden Software on the text grids of Surfer 6 (DSAA, columns and rows, then three lines with the
    ranges of x, y and z); description of the ASCII grids of ArcGIS by Esri; the heading of Zygo's text files ends with
    a line #.
    """
    first = lines[0].strip() if lines else ""
    if first == "DSAA":
        return 5, int(lines[1].split()[0])
    if first.startswith("Zygo "):
        return next((k for k, line in enumerate(lines, 1) if line.strip() == "#"), 0), None
    stated = {
        name.lower(): int(count)
        for name, count in re.findall(r"(?im)^\W*(ncols|nrows)\W+(\d+)\s*$", "\n".join(lines[:20]))
    }
    return 0, stated["ncols"] if len(stated) == 2 else None


def _find_delimiter(text):
    """Return the delimiter of a line of numbers; None for other lines.

    Raises UnfitTopography if commas may be decimal signs or delimiters.
    """
    numbers = re.split(r",?\s+", text.strip())
    if len(numbers) > 1 and "\t" not in text and all(map(_DECIMAL_COMMA.fullmatch, numbers)):
        raise UnfitTopography(
            "path",
            f"has commas in {text[:40]!r} that may be decimal signs or delimiters; expected decimal points. "
            "Replace the commas",
        )
    for delimiter in "\t;, ":
        fields = _fields(text, delimiter) if delimiter in text or delimiter == " " else [text]
        if len(fields) == 1 and (delimiter != " " or "," in text):
            continue
        if all(map(_is_number, fields)) and not all(field in _MISSING for field in fields):
            return delimiter
    return None


def _find_damage(text, number):
    """Return the error for a damaged row, where most but not all fields are numbers; None for other lines."""
    delimiter = next((each for each in "\t;," if each in text), " ")
    fields = _fields(text, delimiter)
    wrong = [k for k, field in enumerate(fields) if not _is_number(field)]
    words = [k for k in wrong if not _LIKE_A_NUMBER.fullmatch(fields[k])]
    if not wrong or len(fields) < _FEWEST_FIELDS or 2 * len(words) > len(fields):
        return None
    return _not_a_number(fields[wrong[0]], wrong[0], number)


def _find_decimal_sign(rows, delimiter):
    """Find the decimal sign from rows of fields; raise UnfitTopography if it is not clear."""
    fields = [field for row in rows for field in row]
    with_comma = [field for field in fields if "," in field]
    if with_comma and all(map(AMBIGUOUS_COMMA.fullmatch, with_comma)):
        raise UnfitTopography(
            "path",
            f"has numbers such as {with_comma[0]}, whose comma may be decimal or separate thousands; expected decimal "
            "points. Replace or remove the commas",
        )
    if delimiter == "," and not with_comma and _are_halves_of_decimals(rows):
        raise UnfitTopography(
            "path",
            f"has both decimal commas and commas as delimiters, as in {','.join(rows[0][:4])}; expected decimal "
            "points, semicolons as delimiters, or quotes around numbers with decimal commas",
        )
    return "," if with_comma and not any("." in field for field in fields) else "."


def _are_halves_of_decimals(rows):
    """Return whether even columns may be the digits after decimal commas: unsigned, and of the same number.

    Columns of integers may look the same. Evidence is a leading zero, or odd columns that are not like the even ones.
    """
    after = [field for row in rows for field in row[1::2]]
    before = [field for row in rows for field in row[: 2 * (len(row) // 2) : 2]]
    alike = re.compile(rf"\d{{{len(after[0])}}}") if after else None
    if (
        len(rows[0]) < 4
        or not all(map(alike.fullmatch, after))
        or not all(re.fullmatch(r"[-+]?\d+", b) for b in before)
    ):
        return False
    return any(field[0] == "0" < field for field in after if len(field) > 1) or not all(map(alike.fullmatch, before))


# Rows and columns are never left out. But the numbers along an edge of a table are probably coordinates or point
# numbers if they rise or fall in equal steps, and those of most other lines do not; or if no other line is monotonic.


def refuse_coordinates(values: np.ndarray) -> None:
    """Raise UnfitTopography if an outer row or column seems to contain coordinates or point numbers, not heights."""
    for name, table in (("row", values), ("column", values.T)):
        if len(table) < 3 or table.shape[1] < _FEWEST_COORDINATES:
            continue
        for place, line in (("first", table[0]), ("last", table[-1])):
            # The corner may belong to the other axis.
            for part in (slice(1, None), slice(-1)):
                if _seems_an_axis(line[part], table[1:-1, part]):
                    raise UnfitTopography(
                        "path",
                        f"has a {place} {name} of numbers, {line[1]:g}, {line[2]:g}, {line[3]:g} …, that seem to be "
                        f"coordinates or numbers of points. Remove the {name} if so, or save all numbers as a .npy "
                        "file if they are heights",
                    )


def _seems_an_axis(line, body):
    """Return whether a line is monotonic, with similar steps or unlike all lines of the body of a table."""
    if _has_similar_steps(line):
        return 2 * sum(map(_has_similar_steps, body)) < len(body)
    return _is_monotonic(line) and not any(map(_is_monotonic, body))


def _is_monotonic(line):
    steps = np.diff(line)
    return bool((np.all(steps >= 0) or np.all(steps <= 0)) and np.any(steps))


def _has_similar_steps(line):
    """Return whether a line rises or falls in equal steps, up to rounding to few digits."""
    steps = np.abs(np.diff(line))
    return _is_monotonic(line) and np.max(steps) <= _SIMILAR_STEPS * np.min(steps[steps > 0])
