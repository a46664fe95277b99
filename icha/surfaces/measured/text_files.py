"""Readers of text: a row of heights per line, or x y z."""

import re
from pathlib import Path

import numpy as np

from icha.surfaces.measured.found import Found, regular_ticks, with_y_first
from icha.surfaces.measured.settings import Preparation, UnfitTopography

_SEPARATORS = str.maketrans(",;\t", "   ")


def read_matrix(path: Path, how: Preparation) -> Found:
    """A row of heights in every line."""
    return Found(with_y_first(read_table(path), how))


def read_xyz(path: Path, how: Preparation) -> Found:
    """x y z in every line; the lines in any order, and points may be missing."""
    table = read_table(path)
    if table.shape[1] != 3:
        raise ValueError(f"{table.shape[1]} numbers in a line, not x y z")
    (column, nx, dx), (row, ny, dy) = (regular_ticks(table[:, axis], "xy"[axis]) for axis in (0, 1))
    place = row * nx + column
    order = np.argsort(place, kind="stable")
    if np.any(np.diff(place[order]) == 0):
        x, y = table[order[np.flatnonzero(np.diff(place[order]) == 0)[0]], :2]
        raise ValueError(f"the point x = {x:g}, y = {y:g} is given twice")
    heights = np.full(nx * ny, np.nan)
    heights[place] = table[:, 2]
    return Found(heights.reshape(ny, nx), coordinates=(nx * dx, ny * dy))


def read_table(path: Path) -> np.ndarray:
    """The numbers of a text file (rows, columns); blanks, tabs, commas or semicolons between them, # before remarks."""
    with path.open(encoding="utf-8-sig") as file:
        first = next((text for line in file if (text := line.split("#")[0].strip())), None)
        if first is None:
            raise UnfitTopography("path", "holds no numbers, only remarks and blanks; allowed: a file of heights")
        fields = [field.strip() for field in re.split(r"[;\s]+", first)]
        if len(fields) > 1 and any("," in field.strip(",") for field in fields):
            raise ValueError(f"it is not clear whether the commas of {first[:40]!r} are decimal; write points")
        file.seek(0)
        return np.loadtxt((line.translate(_SEPARATORS) for line in file), ndmin=2, comments="#")


def columns_of_text(path: Path) -> int | None:
    """Numbers in the first line that is no comment, 0 if there is no such line; None if it holds anything else."""
    with path.open("rb") as file:
        start = file.read(2**24)
    try:
        for line in start.decode("utf-8-sig", "replace").splitlines():
            if text := line.split("#")[0].strip():
                return len([float(word) for word in _words(text)])
    except ValueError:
        return None
    return 0


def _words(text):
    return text.translate(_SEPARATORS).split()
