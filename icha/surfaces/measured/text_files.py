"""Readers of text: a row of heights per line, or x y z."""

import re
from pathlib import Path

import numpy as np

from icha.support.input_files import require_room
from icha.surfaces.measured.found import Found, metres_of, regular_ticks, with_y_first
from icha.surfaces.measured.instrument_files import read_instrument
from icha.surfaces.measured.settings import LINE_SCAN, Preparation, UnfitTopography

_SEPARATORS = str.maketrans(",;\t", "   ")
# Bytes in which a heading is looked for.
_HEADING = 2**12
# How Gwyddion begins the line with the width of an image that it exports, in the languages of its menus.
_WIDTH = re.compile(r"^#\s*(Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина)\s*[:：]", re.MULTILINE)
# The lines with the units of points that it exports.
_UNITS = {
    "lateral": re.compile(r"^#\s*Lateral units\s*:\s*(\S+)", re.MULTILINE),
    "heights": re.compile(r"^#\s*Value units\s*:\s*(\S+)", re.MULTILINE),
}


def read_matrix(path: Path, how: Preparation) -> Found:
    """A row of heights in every line; with Gwyddion's heading, its size and units, too."""
    if has_gwyddion_heading(path):
        return read_instrument(path, how)
    return Found(with_y_first(read_table(path), how))


def has_gwyddion_heading(path: Path) -> bool:
    """Whether a text begins as Gwyddion exports an image, which SurfaceTopography reads in all languages."""
    return _WIDTH.search(_heading(path)) is not None


def _heading(path):
    with path.open("rb") as file:
        start = file.read(_HEADING)
    return start.decode(_encoding(start), "replace")


def _encoding(start):
    """UTF-8, which a multibyte character at the end may break off, or else what Windows writes in the West."""
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8-sig")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def read_xyz(path: Path, how: Preparation) -> Found:
    """x y z in every line; the lines in any order, and points may be missing. Gwyddion's heading tells the units."""
    table = read_table(path)
    if table.shape[1] != 3:
        raise ValueError(f"{table.shape[1]} numbers in a line, not x y z")
    if len(table) > 1 and any(np.ptp(table[:, axis]) == 0 for axis in (0, 1)):
        raise UnfitTopography("path", LINE_SCAN.format(len(table)))
    (column, nx, dx), (row, ny, dy) = (regular_ticks(table[:, axis], "xy"[axis]) for axis in (0, 1))
    place = row * nx + column
    order = np.argsort(place, kind="stable")
    if np.any(np.diff(place[order]) == 0):
        x, y = table[order[np.flatnonzero(np.diff(place[order]) == 0)[0]], :2]
        raise ValueError(f"the point x = {x:g}, y = {y:g} is given twice")
    require_room(2 * 8 * nx * ny)
    heights = np.full(nx * ny, np.nan)
    heights[place] = table[:, 2]
    heading = _heading(path)
    units = {name: metres_of(found[1]) for name, each in _UNITS.items() if (found := each.search(heading))}
    sides, lateral = (nx * dx, ny * dy), units.get("lateral")
    size = (sides[0] * lateral, sides[1] * lateral) if lateral and how.lateral_unit is None else None
    return Found(heights.reshape(ny, nx), units.get("heights"), size, coordinates=sides)


def read_table(path: Path) -> np.ndarray:
    """The numbers of a text file (rows, columns); blanks, tabs, commas or semicolons between them, # before remarks."""
    with path.open("rb") as file:
        encoding = _encoding(file.read(_HEADING))
    # Beyond the heading there are digits.
    with path.open(encoding=encoding, errors="replace") as file:
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
