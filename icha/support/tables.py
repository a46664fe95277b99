"""Read text files of users: encoding, fields, and small tables of spectra and measurements."""

from __future__ import annotations

import codecs
import csv
import gzip
import os
import re
import zlib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from icha.support.input_files import TooLarge, bounded_memory, problem_with_path
from icha.support.rules import POSITIVE

if TYPE_CHECKING:
    import numpy as np

# A number with three digits after a comma. The comma may be a decimal sign, or it may separate thousands.
AMBIGUOUS_COMMA = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}(?!\d)")
# A row of a table: the number of its line in the file, from 1, and its fields.
Row = tuple[int, list[str]]


def open_text(path: Path) -> TextIO:
    """Open a text file, which may be compressed by gzip.

    The encoding is UTF-16 if the text begins with its byte order mark, else UTF-8, or else Windows-1252.
    """
    with path.open("rb") as file:
        compressed = file.read(2) == b"\x1f\x8b"
    opener = gzip.open if compressed else open
    with opener(path, "rb") as file:
        start = file.read(2**16)
    encoding = "utf-8-sig"
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    else:
        try:
            # The last line is left out, because `start` may end within a character.
            start[: start.rfind(b"\n") + 1].decode(encoding)
        except UnicodeDecodeError:
            encoding = "cp1252"
    return opener(path, "rt", encoding=encoding, errors="replace")


def split_fields(line: str, delimiter: str) -> list[str]:
    """Split a line at blanks (delimiter " ") or at another delimiter into fields without quotes and outer blanks."""
    if delimiter == " ":
        fields = line.split()
    elif '"' in line:
        fields = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    else:
        fields = line.split(delimiter)
    return [field.strip(' "\t') for field in fields]


def read_rows(path: str | os.PathLike) -> tuple[list[Row], list[str]]:
    """Read the rows of a table: one row in each line, with one number of fields in all rows.

    Tabs, semicolons, commas or blanks separate the fields. Empty lines and lines that begin with # do not count.

    Returns
    -------
    Rows, and the lines that begin with #, without this sign.

    Raises
    ------
    ValueError
        If the file cannot be read, or if a row has another number of fields than the first row.
    """
    if problem := problem_with_path(path):
        raise ValueError(f"{problem}; expected a text file with a table")
    try:
        with bounded_memory(), open_text(Path(path)) as file:
            lines = [line.strip(" \r\n\f\v\x1a") for line in file]
    except (OSError, EOFError, zlib.error, TooLarge) as error:
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"cannot be read ({reason}); expected a text file with a table") from None
    if any("\0" in line for line in lines):
        raise ValueError("is not a text; expected a text file with a table")
    remarks = [line.lstrip("#").strip() for line in lines if line.startswith("#")]
    texts = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    unquoted = [re.sub(r'"[^"]*"', "", line) for _, line in texts]
    delimiter = next((sign for sign in "\t;," if 2 * sum(sign in line for line in unquoted) > len(texts)), " ")
    rows = [(number, split_fields(line, delimiter)) for number, line in texts]
    # A delimiter at the end of every line does not add a column.
    if delimiter != " " and all(len(row) > 1 and not row[-1] for _, row in rows):
        rows = [(number, row[:-1]) for number, row in rows]
    return rows, remarks


def check_lengths(rows: list[Row], expected: int) -> None:
    """Raise ValueError for the first row that does not have the expected number of fields."""
    for number, row in rows:
        if len(row) != expected:
            raise ValueError(
                f"has {len(row)} fields in line {number}; expected {expected}. Numbers with decimal commas need "
                "semicolons or tabs between them"
            )


def is_number(field: str) -> bool:
    """Return whether a field is a number, with a decimal point or a decimal comma."""
    try:
        _number(field)
    except ValueError:
        return False
    return True


def _number(field):
    return float(field.replace(",", ".").replace("_", "?"))  # Python would read 1_000 as a thousand


def positive_numbers(rows: list[Row], column: int, name: str) -> np.ndarray:
    """Return the numbers in a column, with decimal points or commas; raise ValueError if one is not positive."""
    import numpy as np  # imported here because most commands read no table

    fields = [row[column] for _, row in rows]
    with_comma = [field for field in fields if "," in field]
    if with_comma and all(map(AMBIGUOUS_COMMA.fullmatch, with_comma)):
        raise ValueError(
            f"has numbers such as {with_comma[0]} in column {name}, whose comma may be decimal or separate thousands; "
            "expected decimal points"
        )
    numbers = []
    for (line, _), field in zip(rows, fields, strict=True):
        try:
            numbers.append(POSITIVE.validate("", _number(field)))
        except ValueError:
            raise ValueError(f"column {name}, line {line}: {field[:40]!r}; expected a number greater than 0") from None
    return np.array(numbers)


def read_columns(
    path: str | os.PathLike, columns: Mapping[str, float], ratios: Collection[str] = ()
) -> list[np.ndarray]:
    """Read columns of positive numbers from a table with a line of headings; return one array for each column.

    Parameters
    ----------
    path : path of the file.
    columns : heading of each column to read, with the factor by which the numbers of this column are multiplied.
    ratios : headings of the columns whose products are at most 1.

    Raises
    ------
    ValueError
        If the file cannot be read, a column is missing, a value is not a positive number, or a ratio exceeds 1.
    """
    rows, _ = read_rows(path)
    if len(rows) < 2:
        raise ValueError("contains no values; expected a CSV file with a line of headings and lines of numbers")
    (_, headings), *rows = rows
    check_lengths(rows, len(headings))
    found = []
    for heading, factor in columns.items():
        if headings.count(heading) != 1:
            reason = f"has {headings.count(heading) or 'no'} column{'s' * (heading in headings)} {heading!r}"
            raise ValueError(f"{reason}; expected one of {', '.join(headings)}")
        values = positive_numbers(rows, headings.index(heading), repr(heading)) * factor
        if heading in ratios and values.max() > 1 + 1e-9:
            line, row = rows[int((values > 1 + 1e-9).argmax())]
            raise ValueError(
                f"column {heading!r}, line {line}: {row[headings.index(heading)]!r} is more than 100 %; expected a "
                "fraction of the area. Check the unit of the column"
            )
        found.append(values)
    return found
