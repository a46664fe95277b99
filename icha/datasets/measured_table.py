"""Tables of measurements: columns of CSV files."""

import csv
from pathlib import Path

import numpy as np

from icha.support.input_files import TooLarge, bounded_memory, flaw_of_path


def read_columns(path: str | Path, columns: dict[str, float]) -> list[np.ndarray]:
    """Read columns of a CSV file, in the file's own order.

    Parameters
    ----------
    path : the file, with a line of headings.
    columns : headings of the wanted columns, and the factors that their numbers are multiplied with.

    Raises
    ------
    ValueError
        If the file cannot be read, or a column is missing or holds anything but positive numbers.
    """
    if flaw := flaw_of_path(path):
        raise ValueError(f"{flaw}; allowed: a CSV file")
    try:
        with bounded_memory(), Path(path).open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file, skipinitialspace=True))
    except (OSError, UnicodeDecodeError, csv.Error, TooLarge) as error:
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"cannot be read ({reason}); allowed: a CSV file") from None
    if not rows:
        raise ValueError("holds no values; allowed: a CSV file with a line of headings and at least one of numbers")
    found = []
    for heading, factor in columns.items():
        if heading not in rows[0]:
            raise ValueError(f"has no column {heading!r}; allowed: {', '.join(map(str, rows[0]))}")
        values = [_positive(row[heading], f"column {heading!r}, row {n}") for n, row in enumerate(rows, start=1)]
        found.append(np.array(values) * factor)
    return found


def _positive(text, where: str) -> float:
    try:
        value = float(text)
    except (TypeError, ValueError):
        value = np.nan
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{where}: {text!r}; allowed: numbers greater than 0")
    return value
