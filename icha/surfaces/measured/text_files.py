"""Readers of text: a row of heights per line, x y z, or the waves of a Fourier series; and what a heading says."""

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from icha.support.input_files import require_room
from icha.support.rules import GRID
from icha.surfaces.measured.array_files import is_instrument_text, read_instrument
from icha.surfaces.measured.settings import (
    LINE_SCAN,
    Found,
    Preparation,
    UnfitTopography,
    metres_of,
    regular_ticks,
    with_y_first,
)
from icha.surfaces.measured.text_tables import AMBIGUOUS_COMMA, WIDTH, SourceFile, without_scales

# A surface has at least so many columns of heights.
_FEWEST_COLUMNS = 8
_VALUE = r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
_LENGTH = re.compile(rf"{_VALUE}\s*(\S+)?$")
_TWO_LENGTHS = re.compile(rf"{_VALUE}\s*(\S+)?\s*[x×*]\s*{_VALUE}\s*(\S+)?$")
# A line of a heading: a name, a colon, an equals sign, a delimiter or blanks, and a value.
_LINE = re.compile(r"^[#%/\s\"']*([A-Za-z][A-Za-z _./()-]*?)\s*(?:[:=,;\t]\s*|\s+(?=[-+]?\d))(.+?)[\s\"']*$")
# Title of a column: its name and, in brackets, its unit.
_TITLE = re.compile(r"([a-z]+)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?", re.IGNORECASE)
_NAMES_OF_Z = ("z", "h", "height")
# Names in small letters, without punctuation.
_SIZES = ("size", "scan size", "scan range", "scan area", "field of view")
_PIXELS = ("pixel", "pixel size", "pixel spacing", "spacing", "point spacing", "cellsize", "cell size")
_UNITS = ("unit", "units", "z unit", "z units", "value unit", "value units", "height unit", "height units", "data unit")
_ROWS = ("nrows", "rows", "lines", "number of rows", "number of lines")
_COLUMNS = ("ncols", "cols", "columns", "samples", "number of columns")
# ESRI's grids have this one if their headings give no other.
_ESRI_MISSING = "-9999"
# Numbers that are written with seven digits, or were of single precision, agree to this part.
_FEW_DIGITS = 1e-6
_MISSING = ("nodata value", "nodata", "no data value", "missing value", "bad value", "missing data value")
# The spectrum, its conjugate, their difference, the heights, and what is where.
_BYTES_OF_NODE = 64


def read_matrix(file: SourceFile, how: Preparation) -> Found:
    """Read a row of heights in every line, and what a heading says of units, size and missing heights."""
    values, layout = file.values, file.table_layout
    file.refuse_blocks()
    heights, steps, remark = without_scales(values)
    _check_counts(layout.heading, (values.shape, heights.shape))
    if layout.heading and (known := _as_instrument_file(file, how)):
        return known
    rows, columns = heights.shape
    heading = read_heading(layout.heading, heights.shape, layout.decimal_comma)
    if heading.ambiguous and how.size is None:
        raise UnfitTopography(
            "size",
            f"is {heading.ambiguous!r} in the file, where the comma may be decimal or separate thousands; allowed: "
            "give it here",
        )
    coordinates = heading.coordinates or (steps and (columns * steps[0], rows * steps[1]))
    heights = with_y_first(_without_missing(heights, heading), how)
    known = bool(layout.images)
    return Found(heights, heading.height_unit, heading.size, coordinates, "", remark, layout.data, known)


def _check_counts(lines, shapes):
    """Refuse a table which has other numbers of rows and columns than its heading says."""
    said = _said(lines)
    for axis, (names, what) in enumerate(((_ROWS, "rows"), (_COLUMNS, "columns"))):
        counts = [int(said[name]) for name in names if said.get(name, "").isdecimal()]
        if counts and counts[0] not in [shape[axis] for shape in shapes]:
            raise UnfitTopography(
                "path",
                f"has {shapes[-1][axis]} {what} of numbers and {counts[0]} by its heading, as if cut off or damaged; "
                "allowed: a whole table. Export it again, or correct the heading",
            )


def _as_instrument_file(file, how):
    """What SurfaceTopography, which knows many headings, finds; None if its heights are not all of the numbers."""
    try:
        found = read_instrument(file, how)
    except Exception:  # whatever it raises at texts of other kinds
        return None
    if file.layout.images:
        return None
    if found.unit is None or found.heights.shape != file.values.shape or np.isnan(file.values).any():
        return None
    scale = np.max(np.abs(found.heights)) / np.max(np.abs(file.values))
    same = np.allclose(found.heights, scale * file.values, rtol=1e-9, atol=1e-9 * np.max(np.abs(found.heights)))
    return found if same else None


def read_xyz(file: SourceFile, how: Preparation) -> Found:
    """Read x y z in every line, in any order; points may be missing. A heading may give the units."""
    layout = file.table_layout
    titles = _titles(layout, how.columns)
    points = _columns_of_points(file.values, how, titles)
    heading = read_heading(layout.heading, points.shape, layout.decimal_comma)
    if len(points) > 1 and any(np.ptp(points[:, axis]) == 0 for axis in (0, 1)):
        raise UnfitTopography("path", LINE_SCAN.format(len(points)))
    (column, nx, dx), (row, ny, dy) = (_ticks(points[:, axis], "xy"[axis]) for axis in (0, 1))
    place = row * nx + column
    order = np.argsort(place, kind="stable")
    if np.any(np.diff(place[order]) == 0):
        x, y = points[order[np.flatnonzero(np.diff(place[order]) == 0)[0]], :2]
        raise ValueError(f"the point x = {x:g}, y = {y:g} is given twice")
    require_room(2 * 8 * nx * ny)
    heights = np.full(nx * ny, np.nan)
    heights[place] = _without_missing(points[:, 2], heading)
    sides, units = (nx * dx, ny * dy), [titles[axis].unit if axis in titles else None for axis in "xyz"]
    along_x, along_y = (unit or heading.lateral_unit for unit in units[:2])
    size = None
    if along_x and along_y and how.lateral_unit is None:
        size = sides[0] * along_x, sides[1] * along_y
    named = titles and sorted(titles, key=lambda axis: titles[axis].column) != ["x", "y", "z"]
    remark = f"columns {', '.join(f'{axis} {titles[axis].column}' for axis in 'xyz')} by their names" if named else ""
    known = _said(layout.heading).get("channel") == how.data
    unit = units[2] or heading.height_unit
    return Found(heights.reshape(ny, nx), unit, size, sides, remark=remark, data_known=known)


@dataclass(frozen=True)
class _Title:
    """What the line above a column says: number of the column, from 1, and metres of its unit, None if it has none."""

    column: int
    unit: float | None


def _titles(layout, columns=None):
    """The titles of the columns x, y and z, by these names; none if a name is not there, or if others are asked for."""
    if not layout.heading:
        return {}
    fields = re.split(r"[,;\t]" if layout.delimiter else r"\s+(?![\[(])", layout.heading[-1].strip(' \t\r\n#%"'))
    found = [_TITLE.fullmatch(field.strip(" \"'")) for field in fields]
    names = [match[1].lower() if match else "" for match in found]
    names = ["z" if name in _NAMES_OF_Z else name for name in names]
    if len(names) != layout.columns or any(names.count(axis) != 1 for axis in "xyz"):
        return {}
    titles = {axis: _Title(names.index(axis) + 1, metres_of(found[names.index(axis)][2] or "")) for axis in "xyz"}
    meant = columns is None or list(columns) == [titles[axis].column for axis in "xyz"]
    return titles if meant else {}


def _columns_of_points(values, how, titles):
    """The columns x, y and z (k, 3) of a table."""
    count = values.shape[1]
    columns = how.columns or tuple(titles[axis].column for axis in titles) or (1, 2, 3)
    if max(columns) > count:
        raise UnfitTopography("columns", f"exceeds the {count} numbers of a line; allowed: 1 to {count}")
    if how.columns is None and not titles and count != 3:
        if not 3 < count < _FEWEST_COLUMNS:
            raise ValueError(f"{count} numbers in a line, not x y z")
        other = ", and no Fourier series, whose opposite waves have conjugate amplitudes" if count == 4 else ""
        raise UnfitTopography(
            "columns",
            f"is missing, and a line has {count} numbers{other}; allowed: which are x, y and z, such as [1, 2, 3]",
        )
    return values[:, [column - 1 for column in columns]]


def _ticks(values, axis):
    """Index of every coordinate on a regular scale, number and distance of the ticks."""
    try:
        return regular_ticks(values, axis)
    except ValueError as error:
        raise UnfitTopography(
            "path",
            f"holds points that are not on a regular grid ({error}); allowed: rows and columns of points. Interpolate "
            "them onto a grid in the program of the instrument, such as Gwyddion",
        ) from None


def _without_missing(heights, heading):
    """Heights with nan in the place of the numbers that, by the heading, stand for missing ones."""
    for number in heading.missing:
        heights = np.where(np.isclose(heights, number, rtol=_FEW_DIGITS, atol=0), np.nan, heights)
    return heights


def format_of_text(file: SourceFile) -> str | None:
    """Format of a text file, by its columns; None if it is no table of numbers, or a format of an instrument."""
    layout = file.layout
    if layout is not None and _titles(layout):
        return "xyz"
    if layout is None or (layout.words and is_instrument_text(file)):
        return None
    if any(map(WIDTH.match, layout.heading)):
        return "matrix"
    if layout.columns == 4 and looks_like_fourier(file.values):
        return "fourier"
    return "xyz" if 3 <= layout.columns < _FEWEST_COLUMNS else "matrix"


def looks_like_fourier(values: np.ndarray) -> bool:
    """Whether lines of four numbers can be wave vectors and amplitudes.

    Some wave numbers are negative, unless the waves are few, which fill no grid of coordinates. Where two wave vectors
    are opposite, their amplitudes must be conjugate; heights of opposite points are not.
    """
    waves, modes = values[:, :2], values[:, 2] + 1j * values[:, 3]
    if not np.all(np.isfinite(values)):
        return False
    if np.all(waves >= 0):
        return 2 * len(waves) < len(np.unique(waves[:, 0])) * len(np.unique(waves[:, 1])) or len(waves) < 16
    at = {tuple(wave): mode for wave, mode in zip(waves.tolist(), modes.tolist(), strict=True)}
    pairs = [(mode, at[-x, -y]) for (x, y), mode in at.items() if (-x, -y) in at]
    differences = [abs(mode - opposite.conjugate()) for mode, opposite in pairs]
    return max(differences, default=0.0) <= 1e-4 * np.max(np.abs(modes), initial=1e-300)


@dataclass(frozen=True)
class Heading:
    """What a heading says.

    height_unit, lateral_unit : metres, None if it does not say.
    size : (x, y) of the scan, m, None if it does not say.
    coordinates : (x, y) of the scan in a unit that the heading does not say, None if it does not say it either.
    missing : numbers that stand for a missing height.
    ambiguous : a size with a comma that may be decimal or not, empty if there is none.
    """

    height_unit: float | None = None
    lateral_unit: float | None = None
    size: tuple[float, float] | None = None
    coordinates: tuple[float, float] | None = None
    missing: tuple[float, ...] = ()
    ambiguous: str = ""


def _said(lines):
    """Values of the lines of a heading, by their names in small letters."""
    said = {}
    for line in lines:
        if found := _LINE.match(line):
            said.setdefault(re.sub(r"[\s_.-]+", " ", found[1].lower()).strip(), found[2].strip())
    return said


def read_heading(lines: Sequence[str], shape: tuple[int, int], decimal_comma: bool = False) -> Heading:
    """Read the heading of a table of a shape (rows, columns), whose numbers have decimal commas or not."""
    said = _said(lines)
    if {"ncols", "nrows", "cellsize"} <= said.keys():
        said.setdefault(_MISSING[0], _ESRI_MISSING)
    units = [metres_of(said[name]) for name in _UNITS if name in said]
    missing = [_value(found[1]) for name in _MISSING if name in said and (found := _LENGTH.match(said[name]))]
    size, coordinates = _sizes(lines, said, shape)
    lateral = metres_of(said["lateral units"]) if "lateral units" in said else None
    lengths = [said[name] for name in (*_SIZES, *_PIXELS) if name in said]
    for line, following in itertools.pairwise(lines):
        if WIDTH.match(line):
            lengths += [each.partition(":")[2].strip() for each in (line, following)]
    unclear = [text for text in lengths if not decimal_comma and AMBIGUOUS_COMMA.match(text)]
    unit = next((unit for unit in units if unit), None)
    return Heading(unit, lateral, size, coordinates, tuple(missing), unclear[0] if unclear else "")


def _sizes(lines, said, shape):
    """Size in m, and in units that are not said; None where they are not known."""
    rows, columns = shape
    for line, following in itertools.pairwise(lines):
        if (found := WIDTH.match(line)) and ":" in following:
            sides = [_length(found[2].strip()), _length(following.split(":", 1)[1].strip())]
            if all(side and side[1] for side in sides):
                return tuple(side[0] for side in sides), None
    for names, factors in ((_SIZES, (1, 1)), (_PIXELS, (columns, rows))):
        for text in (said[name] for name in names if name in said):
            if two := _TWO_LENGTHS.match(text):
                sides = [_length(f"{value} {two[4] or ''}".strip()) for value in (two[1], two[3])]
            else:
                sides = [_length(text)] * 2
            if all(sides):
                lengths = tuple(side[0] * factor for side, factor in zip(sides, factors, strict=True))
                if sides[0][1]:
                    return lengths, None
                if names is _PIXELS:
                    return None, lengths
    return None, None


def _length(text):
    """Value of a length, in m if its unit is said, and whether it is; None if it is no length."""
    if not (found := _LENGTH.match(text)):
        return None
    unit = metres_of(found[2]) if found[2] else None
    return None if found[2] and unit is None else (_value(found[1]) * (unit or 1.0), unit is not None)


def _value(text):
    return float(text.replace(",", "."))


def read_fourier(file: SourceFile, how: Preparation) -> Found:
    """qx qy Re Im in every line: h = sum h_q exp(i q.r) over all q; opposite ones, if left out, are the conjugates."""
    table = file.values
    if table.shape[1] != 4:
        raise ValueError(f"{table.shape[1]} numbers in a line, not qx qy Re Im")
    k = _wave_numbers(table[:, :2], how)
    period = 2 * np.pi * np.max(np.abs(k)) / np.max(np.abs(table[:, :2]))
    modes = table[:, 2] + 1j * table[:, 3]
    if not np.all(np.isfinite(modes)):
        raise ValueError("some amplitudes are not finite")
    highest = int(np.max(np.abs(k)))
    n = how.grid or 2 ** math.ceil(math.log2(max(4 * highest, 8)))
    if 2 * highest >= n:
        raise UnfitTopography(
            "grid",
            f"is too coarse for waves {highest} times as short as the period; allowed: at "
            f"least {2 * highest + 2}, advisable: {4 * highest} or more",
        )
    require_room(_BYTES_OF_NODE * n**2)
    spectrum = np.zeros((n, n), dtype=complex)
    order = np.lexsort((k[:, 0], k[:, 1]))
    k, modes = k[order], modes[order]
    if np.any(np.all(np.diff(k, axis=0) == 0, axis=1)):
        raise ValueError("a wave vector is given twice")
    spectrum[k[:, 1], k[:, 0]] = modes
    present = np.zeros((n, n), dtype=bool)
    present[k[:, 1], k[:, 0]] = True
    opposite = -np.arange(n) % n
    alone = present & ~present[np.ix_(opposite, opposite)]
    conjugate = np.conj(spectrum[np.ix_(opposite, opposite)])
    both = present & ~alone
    if np.max(np.abs(spectrum - conjugate)[both], initial=0.0) > 1e-4 * np.max(np.abs(modes)):
        raise ValueError("opposite wave vectors have amplitudes that are not conjugate: the heights would be complex")
    spectrum[alone[np.ix_(opposite, opposite)]] = conjugate[alone[np.ix_(opposite, opposite)]]
    heights = scipy.fft.ifft2(spectrum, norm="forward", workers=1).real
    return Found(heights, coordinates=(period, period), data_known=False)


def _require_few(highest):
    """Refuse waves that no grid has."""
    if highest > GRID.most / 2:
        raise ValueError(f"waves {highest:g} times as short as the period, but a grid has at most {GRID.most} nodes")


def _wave_numbers(q, how):
    """Wave vectors (n, 2) as multiples of 2 pi over the period: as they are written if they are integers."""
    largest = np.max(np.abs(q))
    if not largest > 0 or not np.all(np.isfinite(q)):
        raise ValueError("no wave vectors, or some that are not finite")
    if how.size is not None and how.size[0] != how.size[1]:
        raise UnfitTopography("size", "has two sides that differ, for a Fourier series; allowed: one length")
    if np.all(q == np.rint(q)):
        _require_few(largest)
        if how.size is None:
            raise UnfitTopography(
                "size",
                "is missing, and the wave vectors are integers, multiples of 2 pi/L; allowed: L, such as '0.1 mm'",
            )
        return q.astype(int)
    unit = np.min(np.abs(q)[np.abs(q) > 1e-9 * largest])
    k = np.rint(q / unit)
    # The longest wave fixes the unit only to the digits that it is written with: the shortest one knows it better.
    k = np.rint(q * (np.max(np.abs(k)) / largest))
    if np.max(np.abs(q * (np.max(np.abs(k)) / largest) - k)) > 0.01:
        raise ValueError("the wave vectors are no multiples of the smallest one")
    _require_few(np.max(np.abs(k)))
    return k.astype(int)
