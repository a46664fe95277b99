"""Read tables of numbers from text files: heading, delimiter, decimal sign, and numbers (with pandas)."""

import itertools
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from icha.support.tables import AMBIGUOUS_COMMA, open_text, split_fields
from icha.surfaces.measured.array_files import open_instrument
from icha.surfaces.measured.settings import UnfitTopography

# Words that mark a missing height, and words that are replaced by "nan" before lines are split: nan of Windows and C,
# words with a blank, and the stars that Fortran writes for numbers that are too wide.
_MISSING = frozenset(
    " - -- --- ? nan -nan +nan na n/a #n/a #na bad none null nil nodata no_data missing masked invalid void undefined "
    "undef #value! #num! #div/0! #null! #ref!".split(" ")
)
_NAN = re.compile(r"[-+]?1\.#(ind|qnan|snan)\d*|[-+]?nan\([^)]*\)|\bno data\b|\*+", re.IGNORECASE)
# A remark begins with #. But Windows writes nan as 1.#IND and 1.#QNAN, and Excel writes errors such as #N/A.
_REMARK = re.compile(r"(?<!1\.)#(?!N/A|NA\b|VALUE!|NUM!|DIV/0!|NULL!|REF!)", re.IGNORECASE)
# The exponent of a number in double precision, as Fortran writes it, such as 1.5D-3.
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[-+]?\d)")
_PLAIN = frozenset("0123456789+-.eE,; \t")
# A number with a point that may separate thousands, and an integer of thousands without separator.
_AMBIGUOUS_POINT = re.compile(r"[-+]?[1-9]\d{0,2}\.\d{3}")
_PLAIN_THOUSANDS = re.compile(r"[-+]?\d{4,}")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
# A number, with any separator of thousands.
_LIKE_A_NUMBER = re.compile(r"[-+]?\d[\d.,' ]*")
# The first line of numbers must lie within the first `_BEGINNING` characters and `_LONGEST_HEADING` lines.
_BEGINNING, _LONGEST_HEADING = 2**20, 1000
# A line is a damaged row, not titles, if it has at least this number of fields, and at least half resemble numbers.
_FEWEST_FIELDS = 8
# Numbers that pandas reads at a time; this bounds the memory for text.
_BATCH = 2**20
# Fewest numbers in a row or column of coordinates.
_FEWEST_COORDINATES = 8
# Steps from number to number count as similar if the largest one is at most this multiple of the smallest one that is
# not zero: equal steps that are rounded to few digits.
_SIMILAR_STEPS = 2.01
# Number that marks a missing height in the text grids of Surfer.
_SURFER_MISSING = "1.70141e+38"


@dataclass(frozen=True, eq=False)
class Layout:
    """Heading and notation of a text file with a table.

    Attributes
    ----------
    heading : lines above the numbers, including remarks; the headings of Surfer and Zygo are translated.
    begin : number of lines above the numbers.
    delimiter : tab, semicolon, comma or blank.
    decimal : decimal sign, a point or a comma.
    fields : number of fields of each row, including an empty field after a delimiter at the end.
    columns : number of columns, without an empty field at the end.
    wrapped : True if a row continues on the next lines, as the heading of a known format states.
    """

    heading: tuple[str, ...]
    begin: int
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
                "cannot be read as a table, because it has no numbers; expected a row of heights, or x y z, in "
                "every line"
            )
        return self.layout

    @cached_property
    def table(self) -> tuple[np.ndarray, np.ndarray, bool]:
        """Numbers in the file, the line number (from 1) of each row, and whether all lines end with a delimiter.

        Numbers have the shape (rows, columns), without an empty column after the delimiters; missing numbers are nan.
        Raises UnfitTopography if the file has no numbers, a field that is not a number, or rows of different lengths.
        """
        layout = self.table_layout
        values, lines, ends = [], [], layout.delimiter != " "
        rows = self._rows()
        while batch := list(itertools.islice(rows, 1 + _BATCH // layout.fields)):
            values.append(_read_numbers(batch, layout.decimal))
            lines.append(np.array([line for line, _ in batch]))
            ends = ends and not any(fields[-1] for _, fields in batch)
        numbers = np.concatenate(values)
        if excess := numbers.size % layout.fields:
            raise UnfitTopography(
                f"has {excess} numbers in the last row, but its heading states {layout.fields}; expected a whole "
                "table. Export the table again"
            )
        return numbers.reshape(-1, layout.fields)[:, : layout.fields - ends], np.concatenate(lines), ends

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield the line number and the fields of each row; raise UnfitTopography if rows have different lengths."""
        layout = self.table_layout
        with open_text(self.path) as file:
            for line, text in enumerate(itertools.islice(file, layout.begin, None), layout.begin + 1):
                text = _clean(text)
                fields = split_fields(text, layout.delimiter)
                # A line of tabs is a row of missing heights if it has as many tabs as the other rows.
                if not text or (text.isspace() and len(fields) != layout.fields):
                    continue
                if len(fields) != layout.fields and not layout.wrapped:
                    raise UnfitTopography(
                        f"has {len(fields)} numbers in line {line} but {layout.fields} in most lines; expected rows of "
                        "one length. Complete or remove the line; missing heights may be NaN"
                    )
                yield line, fields

    def refuse_blocks(self) -> None:
        """Raise UnfitTopography if empty lines or remarks divide the rows into blocks, as in files with several images.

        A file with empty lines or remarks between all rows is accepted.
        """
        _, lines, _ = self.table
        begins = np.flatnonzero(np.diff(lines) > 1) + 1
        if not self.table_layout.wrapped and len(begins) and min(np.diff([0, *begins, len(lines)])) > 1:
            raise UnfitTopography(
                f"has {len(begins) + 1} blocks of rows, the second from line {lines[begins[0]]}; expected one "
                "image. Remove all blocks but one. If the blocks form one image, remove the lines between the "
                "blocks instead"
            )

    @cached_property
    def instrument(self):
        """The file, opened with SurfaceTopography; None if SurfaceTopography does not support the format."""
        return open_instrument(self.path)


def first_lines(path: Path) -> list[str]:
    """Read the lines at the beginning of a text file; return an empty list if the file is not text."""
    with open_text(path) as file:
        start = file.read(_BEGINNING)
    return [] if "\0" in start else start.split("\n")[:_LONGEST_HEADING]


def strip_remark(line: str) -> str:
    """Return a line without remark (#) and outer blanks; tabs remain at the ends, because they may separate fields."""
    return (_REMARK.split(line, maxsplit=1)[0] if "#" in line else line).strip(" \r\n\x1a")


def _clean(line: str) -> str:
    """Return a line without remark, with numbers as pandas reads them."""
    text = strip_remark(line).replace("−", "-")
    # Plain numbers need no regular expression; these would be slow in long lines.
    return text if _PLAIN.issuperset(text) else _FORTRAN.sub("e", _NAN.sub("nan", text))


def _to_numbers(fields: list[str], decimal: str = ".,") -> tuple[np.ndarray, list[int]]:
    """Convert fields to numbers, nan where missing; also return the indices of the fields that are not numbers."""
    import pandas as pd  # slow to import

    # A point must not be read as a decimal sign if the numbers have decimal commas.
    signs = {ord(","): ".", ord("."): "." if "." in decimal else ","}
    texts = [field.translate(signs) for field in fields] if "," in decimal else fields
    numbers = pd.to_numeric(np.array(texts, dtype=object), errors="coerce").astype(float)
    unknown = np.flatnonzero(np.isnan(numbers)).tolist()
    return numbers, [k for k in unknown if fields[k].lower() not in _MISSING]


def _read_numbers(rows, decimal):
    """Convert the fields of rows to numbers; raise UnfitTopography that names the first field that is not a number."""
    numbers, wrong = _to_numbers([field for _, fields in rows for field in fields], decimal)
    if wrong:
        places = [(line, column, field) for line, fields in rows for column, field in enumerate(fields, 1)]
        line, column, field = places[wrong[0]]
        raise UnfitTopography(
            f"has {field[:40]!r} in line {line}, column {column}; expected a number, or NaN where a point is missing. "
            "Correct or remove the line"
        )
    return numbers


def _find_layout(lines: list[str]) -> Layout | None:
    """Find the first line of numbers, and the notation of the numbers; None if the text has no numbers.

    Raises UnfitTopography if commas may be decimal or delimiters.
    """
    heading, start, stated = _known_heading(lines)
    texts = [_clean(line) for line in lines]
    first = next((k for k in range(start, len(texts)) if _find_delimiter(texts[k])), len(texts))
    delimiter = _find_delimiter(texts[first]) if first < len(texts) else None
    # Rows of missing heights, and damaged rows, above the first line of numbers belong to the table.
    width = len(split_fields(texts[first], delimiter)) if delimiter else 0
    begin = first
    for k in range(first - 1, start - 1, -1):
        if texts[k]:
            if not _is_row(texts[k], delimiter or _usual_delimiter(texts[k]), width):
                break
            begin = k
    if begin == len(texts):
        return None
    if delimiter is None:
        first, delimiter = begin, _usual_delimiter(texts[begin])
    rows = [split_fields(text, delimiter) for text in texts[begin:] if text.strip()]
    counts = Counter(map(len, rows))
    fields = max(counts, key=counts.__getitem__)
    wrapped = delimiter == " " and stated not in (None, fields)
    ends = delimiter != " " and fields > 1 and not any(row[-1] for row in rows)
    fields = stated if wrapped else fields
    decimal = _find_decimal_sign(texts[first], rows, delimiter)
    return Layout(tuple(heading or lines[:begin]), begin, delimiter, decimal, fields, fields - ends, wrapped)


def _known_heading(lines):
    """Return a translation of a heading (or None), its number of lines, and the columns that it states (or None).

    Sources: help of Golden Software on the text grids of Surfer 6 (DSAA, columns and rows, then three lines with the
    ranges of x, y and z); description of the ASCII grids of ArcGIS by Esri; the heading of Zygo's text files ends with
    a line #, line 8 contains the size of a pixel in m, and heights are in um.
    """
    first = lines[0].strip() if lines else ""
    if first == "DSAA":
        (columns, rows), x, y = ([float(number) for number in line.split()[:2]] for line in lines[1:4])
        dx, dy = abs(x[1] - x[0]) / (columns - 1), abs(y[1] - y[0]) / (rows - 1)
        grid = f"ncols {columns:.0f}", f"nrows {rows:.0f}", f"dx {dx}", f"dy {dy}", f"nodata_value {_SURFER_MISSING}"
        return grid, 5, int(columns)
    if first.startswith("Zygo "):
        start = next((k for k, line in enumerate(lines, 1) if line.strip() == "#"), 0)
        step = f"Distance of points: {lines[7].split()[6]} m" if start > 7 else ""
        return (first, "Value units: um", step), start, None
    stated = {
        name.lower(): int(count)
        for name, count in re.findall(r"(?im)^\W*(ncols|nrows)\W+(\d+)\s*$", "\n".join(lines[:20]))
    }
    return None, 0, stated["ncols"] if len(stated) == 2 else None


def _find_delimiter(text):
    """Return the delimiter of a line of numbers; None for other lines, and for lines without a number.

    Raises UnfitTopography if fields between tabs contain blanks, or if several kinds of blanks occur.
    """
    text = text.strip()
    for delimiter in "\t;, " if text else "":
        if delimiter not in text and (delimiter != " " or "," in text):
            continue
        numbers, wrong = _to_numbers(split_fields(text, delimiter))
        if not wrong and not np.isnan(numbers).all():
            if delimiter == " " and re.search(r"[^\S ]", text):
                raise UnfitTopography(
                    f"has different blanks in a row, {text[:40]!r}, so blanks may separate thousands or "
                    "columns; expected numbers without blanks, and one delimiter between them"
                )
            return delimiter
    return None


def _usual_delimiter(text):
    return next((each for each in "\t;," if each in text), " ")


def _is_row(text, delimiter, width):
    """Return whether a line above numbers has only missing heights, or is a damaged row: many fields are numbers.

    width : number of fields of the first line of numbers.
    """
    fields = split_fields(text, delimiter)
    _, wrong = _to_numbers(fields)
    if not wrong:
        return len(fields) == width > 1
    words = [k for k in wrong if not _LIKE_A_NUMBER.fullmatch(fields[k])]
    return len(fields) >= _FEWEST_FIELDS and 2 * len(words) <= len(fields)


def _find_decimal_sign(first, rows, delimiter):
    """Find the decimal sign from the `first` line of numbers, and the fields of all rows.

    Raises UnfitTopography if commas may be decimal signs, delimiters, or separators of thousands, or if points may
    separate thousands. A leading zero, or another number of digits, shows that points are decimal signs.
    """
    fields = [field for row in rows for field in row]
    with_point = [field for field in fields if "." in field]
    # A comma between numbers means that the decimal sign is a point.
    ambiguous = delimiter != "," and with_point and all(map(_AMBIGUOUS_POINT.fullmatch, with_point))
    if ambiguous and not any(map(_PLAIN_THOUSANDS.fullmatch, fields)):
        raise UnfitTopography(
            f"has points, as in {with_point[0]!r}, that may separate thousands: each has three digits after it. Remove "
            f"the points if so; if they are decimal signs, add a digit to one number, as in '{with_point[0]}0'"
        )
    with_comma = [field for field in fields if "," in field]
    numbers = re.split(r",?\s+", first.strip())
    if (
        (delimiter in ", " and len(numbers) > 1 and all(map(_DECIMAL_COMMA.fullmatch, numbers)))
        or (with_comma and all(map(AMBIGUOUS_COMMA.fullmatch, with_comma)))
        or (delimiter == "," and not with_comma and _are_halves_of_decimals(rows))
    ):
        raise UnfitTopography(
            f"has commas, as in {(with_comma or [first])[0][:40]!r}, that may be decimal signs, delimiters, or "
            "separate thousands; expected decimal points. Replace or remove the commas"
        )
    return "," if with_comma and not with_point else "."


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
        # The corner may belong to the other axis.
        for part in (slice(1, None), slice(-1)):
            monotonic, similar = _find_monotonic(table[:, part])
            for place, k in (("first", 0), ("last", -1)):
                body = (similar if similar[k] else monotonic)[1:-1]
                if 2 * np.sum(body) < len(body) if similar[k] else monotonic[k] and not np.any(body):
                    raise UnfitTopography(
                        f"has a {place} {name} of numbers, {', '.join(f'{x:g}' for x in table[k][1:4])} …, that seem "
                        f"to be coordinates or numbers of points. Remove the {name} if so, or save all numbers as a "
                        ".npy file if they are heights"
                    )


def _find_monotonic(table):
    """Return masks of the rows that rise or fall, and of those that do so in equal steps, up to rounding."""
    steps = np.diff(table)
    monotonic = (np.all(steps >= 0, axis=1) | np.all(steps <= 0, axis=1)) & np.any(steps, axis=1)
    sizes = np.abs(steps)
    smallest = np.min(sizes, axis=1, where=sizes > 0, initial=np.inf)
    return monotonic, monotonic & (np.max(sizes, axis=1) <= _SIMILAR_STEPS * smallest)
