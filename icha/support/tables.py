"""Read text files of users: encoding, fields, and small tables of spectra and measurements."""

from __future__ import annotations

import codecs
import csv
import gzip
import math
import os
import re
import zlib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from icha.support.input_files import TooLarge, bounded_memory, problem_with_path
from icha.support.rules import NUMBER, POSITIVE, FloatRange

if TYPE_CHECKING:
    import numpy as np

# A number with three digits after a comma. The comma may be a decimal sign, or it may separate thousands.
AMBIGUOUS_COMMA = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}(?!\d)")
# A number with one or several groups of three digits, such as 1.200 or 1,200,000.
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(?:(?:\.\d{3})+|(?:,\d{3})+)")
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
    """Split a line at blanks (delimiter " ") or at another delimiter into fields without outer quotes and blanks."""
    if delimiter == " ":
        fields = line.split()
    elif '"' in line:
        fields = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    else:
        fields = line.split(delimiter)
    if '"' in line:
        fields = [re.sub(r'^\s*"([^"]*)"\s*$', r"\1", field) for field in fields]
    return [field.strip(" \t") for field in fields]


def read_rows(path: str | os.PathLike) -> tuple[list[Row], list[str]]:
    """Read the rows of a table: one row in each line, with one number of fields in all rows.

    Tabs, semicolons, commas or blanks separate the fields. Empty lines and lines that begin with # do not count. Return
    the rows, and the lines that begin with #, without this sign; raise ValueError if the file cannot be read.
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


def read_table(path: str | os.PathLike) -> tuple[list[str], list[Row]]:
    """Read a table with a line of headings; return the headings and the rows below.

    Raise ValueError if the file cannot be read, or if a row does not have as many fields as there are headings.
    """
    rows, _ = read_rows(path)
    if len(rows) < 2:
        raise ValueError("contains no values; expected a CSV file with a line of headings and lines of numbers")
    (_, headings), *rows = rows
    check_lengths(rows, len(headings))
    return headings, rows


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
    for decimal in ".,":
        try:
            _number(field, decimal)
        except ValueError:
            continue
        return True
    return False


def _number(field, decimal):
    """Convert a field with a known decimal sign; the other sign may separate groups of three digits."""
    whole, sign, digits = field.partition(decimal)
    if _GROUPED.fullmatch(whole):
        whole = re.sub("[.,]", "", whole)
    return float(f"{whole}{sign and '.'}{digits}".replace(",", "?").replace("_", "?"))  # Python would read 1_000


def _decimal_sign(fields):
    """Return the decimal sign of all fields of a table; raise ValueError if several signs are possible.

    A sign is decimal if it is the last of two different signs, or if it occurs once in a number that is not of the form
    1.200, where the sign may separate thousands.
    """
    signed = [field for field in fields if re.search("[.,]", field) and is_number(field)]
    grouped = list(filter(_GROUPED.fullmatch, signed))
    shown = {max(".,", key=field.rfind): field for field in signed if field not in grouped}
    # A sign that occurs twice separates thousands, so the other sign is decimal.
    shown |= {",."[field[-4] == ","]: field for field in grouped if len(field) > len("+100.000")}
    if len(shown) == 2:
        raise ValueError(
            f"has numbers such as {' and '.join(shown.values())} with different decimal signs; expected "
            "decimal points in all columns"
        )
    if shown or not signed:
        return next(iter(shown), ".")
    # Whole numbers below 1000 do not show whether 1.200 has a separator of thousands.
    whole = [field for field in fields if re.fullmatch(r"[-+]?\d+", field)]
    with_comma = [field for field in signed if "," in field]
    if with_comma or (whole and all(len(field.lstrip("+-")) < 4 for field in whole)):
        raise ValueError(
            f"has numbers such as {(with_comma or signed)[0]}, whose {'comma' if with_comma else 'point'} may be "
            "decimal or separate thousands; expected decimal points without separators of thousands. Write 1200, or "
            "1.2000"
        )
    return "."


def numbers_of(
    rows: list[Row], columns: Mapping[int, str], rule: FloatRange = POSITIVE, signed: Collection[int] = ()
) -> list[np.ndarray]:
    """Return the numbers in some columns; raise ValueError if one is not within the bounds of `rule`.

    The numbers of all these columns have the same decimal sign, a point or a comma. `columns` has the name of each
    column for messages, by its index from 0; `signed` are columns of finite numbers without bounds.
    """
    import numpy as np  # imported here because most commands read no table

    decimal = _decimal_sign([row[column] for _, row in rows for column in columns])
    found = []
    for column, name in columns.items():
        numbers, bounds = [], NUMBER if column in signed else rule
        for line, row in rows:
            try:
                numbers.append(bounds.validate("", _number(row[column], decimal)))
            except ValueError:
                text = f"column {name}, line {line}: {row[column][:40]!r}; expected {bounds.expected}. Correct or "
                text += "remove the line"
                raise ValueError(text) from None
        found.append(np.array(numbers))
    return found


def read_columns(
    path: str | os.PathLike,
    columns: Mapping[str, float],
    limits: Mapping[str, tuple[float, str]] | None = None,
    signed: Collection[str] = (),
) -> list[np.ndarray]:
    """Read columns of positive numbers from a table with a line of headings; return one array for each column.

    Raise ValueError if the file cannot be read, a column is missing, or a value is not positive or exceeds its limit.

    Parameters
    ----------
    columns : heading of each column to read, with the factor by which the numbers of this column are multiplied.
    limits : largest product in a column, and a text for messages after "is more than", by heading.
    signed : headings of columns whose numbers may be zero or negative.
    """
    headings, rows = read_table(path)
    for heading in columns:
        if headings.count(heading) != 1:
            reason = f"has {headings.count(heading) or 'no'} column{'s' * (heading in headings)} {heading!r}"
            raise ValueError(f"{reason}; expected one of {', '.join(headings)}")
    named = {headings.index(heading): repr(heading) for heading in columns}
    found = numbers_of(rows, named, signed={headings.index(heading) for heading in signed})
    found = [values * factor for values, factor in zip(found, columns.values(), strict=True)]
    for heading, values in zip(columns, found, strict=True):
        most, text = (limits or {}).get(heading, (math.inf, ""))
        if values.max() > most * (1 + 1e-9):
            line, row = rows[int(values.argmax())]
            field, number = row[headings.index(heading)], f"{values.max() / columns[heading]:.6g}"
            shown = repr(field) if field == number else f"{field!r} (the number {number})"
            raise ValueError(f"column {heading!r}, line {line}: {shown} is more than {text}")
    return found
