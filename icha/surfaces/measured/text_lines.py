"""Read lines of text files: encoding and compression, remarks, fields of a line, numbers in fields."""

import csv
import gzip
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

# Words, in small letters, that mark a missing height.
_MISSING = frozenset(
    "- -- --- * ** *** **** ? nan na n/a #n/a #na bad none null nil nodata no_data missing masked invalid void "
    "undefined undef #value! #num! #div/0! #null! #ref!".split()
) | {"", "no data"}
_NO_DATA = re.compile(r"\bno data\b", re.IGNORECASE)
# A remark begins with #. But Windows writes nan as 1.#IND and 1.#QNAN, and Excel writes errors such as #N/A.
_REMARK = re.compile(r"(?<!1\.)#(?!N/A|NA\b|VALUE!|NUM!|DIV/0!|NULL!|REF!)", re.IGNORECASE)
_NAN = re.compile(r"[-+]?(1\.#(ind|qnan|snan)\d*|nan\(.*\))|\*+", re.IGNORECASE)
# A number in double precision, as Fortran writes it, such as 1.5D-3.
_FORTRAN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[dD][-+]?\d+")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?$")
# A number with three digits after a comma. The comma may be a decimal sign, or it may separate thousands.
AMBIGUOUS_COMMA = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
_QUOTED = re.compile(r"\"[^\"]*\"")
# A number, with any separator of thousands.
LIKE_A_NUMBER = re.compile(r"[-+]?\d[\d.,' ]*$")


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


def strip_remark(line: str) -> str:
    """Return a line without remark (#) and outer blanks; tabs remain, because they may separate fields."""
    text = _REMARK.split(line, maxsplit=1)[0] if "#" in line else line
    return "" if text.isspace() else text.strip(" \r\n\x1a")


@dataclass(frozen=True)
class Notation:
    """Notation of the numbers in a line: delimiter between numbers and decimal sign.

    Attributes
    ----------
    delimiter : tab, semicolon or comma; None for blanks.
    decimal_comma : True if numbers have decimal commas.
    """

    delimiter: str | None
    decimal_comma: bool = False

    @classmethod
    def of_line(cls, text: str) -> "Notation":
        """Guess the notation of the numbers in a single line."""
        unquoted = _QUOTED.sub("q", text).strip()
        notation = cls(next((each for each in "\t;," if each in unquoted), None))
        return cls(notation.delimiter, has_decimal_commas(notation.fields(text)))

    def fields(self, text: str) -> list[str]:
        """Split a line into fields; remove blanks and quotes around fields, and write minus signs in ASCII."""
        text = text.replace("−", "-")
        if self.delimiter is None:
            fields = _NO_DATA.sub("nan", text).split()
        elif '"' in text:
            fields = next(csv.reader([text], delimiter=self.delimiter, skipinitialspace=True))
        else:
            fields = text.split(self.delimiter)
        return [field.strip().strip("\"'").strip() for field in fields]

    def number(self, field: str) -> float | None:
        """Read the number in a field; nan if the field marks a missing height, None for other text."""
        text = field.replace(",", ".") if self.decimal_comma else field
        try:
            return float(text.replace("_", "?"))  # Python would read 1_000 as a thousand
        except ValueError:
            if _FORTRAN.fullmatch(text):
                return float(text.lower().replace("d", "e"))
            return np.nan if field.lower() in _MISSING or _NAN.fullmatch(field) else None

    def numbers(self, text: str) -> list[float | None]:
        """Read the numbers in the fields of a line; faster than `number` if all fields are plain numbers."""
        try:
            return [*map(float, text.replace("_", "?").split(self.delimiter))]
        except ValueError:
            return [self.number(field) for field in self.fields(text)]


def has_decimal_commas(fields: Iterable[str]) -> bool:
    """Return whether at least one field has a decimal comma and no field has a decimal point."""
    return any(map(_DECIMAL_COMMA.match, fields)) and not any("." in field for field in fields)


def are_decimal_between_blanks(text: str) -> bool:
    """Return whether a line has several numbers with decimal commas, separated by blanks and perhaps commas."""
    fields = re.split(r",?\s+", text.strip())
    return len(fields) > 1 and all(map(_DECIMAL_COMMA.match, fields))


def are_halves_of_decimals(rows: list[list[str]]) -> bool:
    """Return whether odd columns are the digits before decimal commas, and even columns the digits after them.

    Digits after a comma have no sign, and their number is the same in all rows. Columns of integers may look the same.
    So the function needs evidence: a leading zero after a comma, or another number of digits before the comma.
    """
    # A row with an empty last field is shorter; such rows do not count.
    width = max(map(len, rows))
    rows = [row for row in rows if len(row) == width]
    if width < 6 or width % 2:
        return False
    columns = list(zip(*rows, strict=True))
    evidence = False
    for k, (before, after) in enumerate(zip(columns[::2], columns[1::2], strict=True)):
        digits = len(after[0])
        if not all(field.isdecimal() and len(field) == digits for field in after):
            return False
        if not all(re.fullmatch(r"[-+]?\d+", field) for field in before):
            return False
        evidence |= digits > 1 and any(field[0] == "0" for field in after)
        # The first column may number the rows.
        evidence |= k > 0 and any(len(field) != digits for field in before)
    return evidence
