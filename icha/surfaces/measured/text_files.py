"""Read text files with a row of heights, a point x y z, or a wave in every line; interpret the heading of the file."""

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from icha.support import formatting
from icha.support.input_files import require_room
from icha.support.rules import GRID
from icha.surfaces.measured.array_files import is_instrument_text, read_instrument
from icha.surfaces.measured.settings import (
    LINE_SCAN,
    FileContent,
    Preparation,
    UnfitTopography,
    grid_indices,
    metres_of,
    put_y_first,
)
from icha.surfaces.measured.text_lines import AMBIGUOUS_COMMA, strip_remark
from icha.surfaces.measured.text_tables import SourceFile, drop_coordinates

# Fewest columns of a table with a row of heights in every line.
_FEWEST_COLUMNS = 8
# Title of a column: its name and, in brackets, its unit.
_TITLE = re.compile(r"([a-z]+)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?", re.IGNORECASE)
_NAMES_OF_Z = ("z", "h", "height")
# Relative error of numbers with seven digits, or of single precision.
_FEW_DIGITS = 1e-6
# Bytes per node for the spectrum, the conjugate spectrum, their difference, the heights and the masks of waves.
_BYTES_OF_NODE = 64
# Opposite waves count as conjugate if the error, divided by the largest amplitude, is at most this value.
_CONJUGATE = 1e-4
# Text images from Gwyddion have a line with the width of the image, and then a line with the height. The pattern
# contains the first word of the line with the width, in the languages of Gwyddion.
_WIDTH = re.compile(r"^#?\s*(Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина)\s*[:：]\s*(.*)$")
_NUMBER = r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
# One length or two, such as 12 µm x 12 µm.
_LENGTHS = re.compile(rf"{_NUMBER}\s*(\S+?)?(?:\s*[x×*]\s*{_NUMBER}\s*(\S+)?)?$")
# A line of the heading: a name, then a colon, an equals sign, a delimiter or blanks, then a value.
_ENTRY = re.compile(r"^[#%/\s\"']*([A-Za-z][A-Za-z _./()-]*?)\s*(?:[:=,;\t]\s*|\s+(?=[-+]?\d))(.+?)[\s\"']*$")
# Names of entries in a heading, in small letters and without punctuation.
_SIZES = ("size", "scan size", "scan range", "scan area", "field of view")
_PIXELS = ("pixel", "pixel size", "pixel spacing", "spacing", "point spacing", "cellsize", "cell size")
_UNITS = ("unit", "units", "z unit", "z units", "value unit", "value units", "height unit", "height units", "data unit")
_COUNTS = {
    "rows": ("nrows", "rows", "lines", "number of rows", "number of lines"),
    "columns": ("ncols", "cols", "columns", "samples", "number of columns"),
}
_MISSING = ("nodata value", "nodata", "no data value", "missing value", "bad value", "missing data value")
# Number for a missing height in ESRI grids, if the heading does not define another number.
_ESRI_MISSING = "-9999"


@dataclass(frozen=True)
class _Heading:
    """Units, size and missing heights from the heading of a text file; None for each value that is not in the heading.

    Attributes
    ----------
    height_unit, lateral_unit : units of heights and of coordinates, m.
    size : sides (x, y) of the scan, m.
    coordinates : sides (x, y) of the scan in an unknown unit.
    missing : numbers that mark a missing height.
    """

    height_unit: float | None
    lateral_unit: float | None
    size: tuple[float, float] | None
    coordinates: tuple[float, float] | None
    missing: tuple[float, ...]


def format_of_text(file: SourceFile) -> str:
    """Find the format of a text file from its columns; "instrument" if it has no numbers or is from an instrument."""
    layout = file.layout
    if layout is not None and _titles(layout):
        return "xyz"
    # Headings from instruments contain lines that are not remarks.
    if layout is None or (any(map(strip_remark, layout.heading)) and is_instrument_text(file)):
        return "instrument"
    return "xyz" if 3 <= layout.columns < _FEWEST_COLUMNS and not _image_sides(layout.heading) else "matrix"


def read_matrix(file: SourceFile, settings: Preparation) -> FileContent:
    """Read a text file with a row of heights in every line; units, size and missing heights come from its heading."""
    values, layout = file.values, file.table_layout
    file.refuse_blocks()
    heights, steps, remark = drop_coordinates(values)
    _check_counts(layout.heading, (values.shape, heights.shape))
    if layout.heading and not _image_sides(layout.heading) and (known := _as_instrument_file(file, settings)):
        return known
    rows, columns = heights.shape
    heading = _read_heading(layout.heading, heights.shape, layout.notation.decimal_comma, settings)
    return FileContent(
        put_y_first(_mark_missing(heights, heading), settings),
        heading.height_unit,
        heading.size,
        heading.coordinates or (steps and (columns * steps[0], rows * steps[1])),
        remark=remark,
    )


def _as_instrument_file(file, settings):
    """Read a text with SurfaceTopography; None if no unit is found, or if the heights disagree with `file.values`."""
    try:
        found = read_instrument(file, settings)
    except Exception:  # SurfaceTopography raises many types of errors for texts of other formats
        return None
    if found.unit is None or found.heights.shape != file.values.shape or np.isnan(file.values).any():
        return None
    largest = np.max(np.abs(found.heights))
    scale = largest / np.max(np.abs(file.values))
    return found if np.allclose(found.heights, scale * file.values, rtol=1e-9, atol=1e-9 * largest) else None


def read_xyz(file: SourceFile, settings: Preparation) -> FileContent:
    """Read a text file with a point x y z in every line; points may be in any order or missing."""
    layout = file.table_layout
    titles = _titles(layout)
    columns = _find_columns(file.values.shape[1], settings, [name for name, _ in titles])
    points = file.values[:, [column - 1 for column in columns]]
    if len(points) > 1 and any(np.ptp(points[:, axis]) == 0 for axis in (0, 1)):
        raise UnfitTopography("path", LINE_SCAN.format(len(points)))
    scattered = ""
    try:
        (column, nx, dx), (row, ny, dy) = (grid_indices(points[:, axis], "xy"[axis]) for axis in (0, 1))
    except UnfitTopography:
        if settings.scattered != "interpolate":
            raise
        points, scattered = _interpolate(points)
        (column, nx, dx), (row, ny, dy) = (grid_indices(points[:, axis], "xy"[axis]) for axis in (0, 1))
    node = row * nx + column
    order = np.argsort(node, kind="stable")
    repeated = np.flatnonzero(np.diff(node[order]) == 0)
    if len(repeated):
        x, y = points[order[repeated[0]], :2]
        raise UnfitTopography("path", f"contains the point x = {x:g}, y = {y:g} twice; expected every point once")
    require_room(2 * 8 * nx * ny)
    heading = _read_heading(layout.heading, points.shape, layout.notation.decimal_comma, settings)
    heights = np.full(nx * ny, np.nan)
    heights[node] = _mark_missing(points[:, 2], heading)
    units = [titles[column - 1][1] if titles else None for column in columns]
    x_unit, y_unit = units[0] or heading.lateral_unit, units[1] or heading.lateral_unit
    remark = "columns x {}, y {}, z {} by their names".format(*columns)
    return FileContent(
        heights.reshape(ny, nx),
        units[2] or heading.height_unit,
        (nx * dx * x_unit, ny * dy * y_unit) if x_unit and y_unit and settings.lateral_unit is None else None,
        (nx * dx, ny * dy),
        remark="; ".join(filter(None, (remark if titles and columns != sorted(columns) else "", scattered))),
    )


def _interpolate(points):
    """Interpolate scattered points (x, y, z) onto a square grid; return the new points, and a remark.

    The grid has as many nodes per area as the points. The interpolation is linear on Delaunay's triangles. Nodes
    outside the convex hull of the points have no height.
    """
    # Slow to import, and rarely needed.
    from scipy.interpolate import LinearNDInterpolator

    known = points[np.isfinite(points).all(axis=1)]
    low, high = known[:, :2].min(axis=0), known[:, :2].max(axis=0)
    step = math.sqrt(float(np.prod(high - low)) / len(known))
    nx, ny = (int(length / step) + 1 for length in high - low)
    require_room(4 * 8 * nx * ny)
    y, x = np.meshgrid(low[1] + step * np.arange(ny), low[0] + step * np.arange(nx), indexing="ij")
    z = LinearNDInterpolator(known[:, :2], known[:, 2], rescale=True)(x, y)
    empty = formatting.share(int(np.count_nonzero(np.isnan(z))), z.size)
    remark = f"{len(known)} scattered points interpolated onto {nx} x {ny} nodes, {empty} of which have no height"
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), remark


def _titles(layout):
    """Read the titles of the columns from the last line above the numbers.

    Returns
    -------
    Name and unit (m, or None) of every column. The list is empty unless x, y and z each occur exactly once.
    """
    if not layout.heading:
        return []
    delimiters = r"[,;\t]" if layout.notation.delimiter else r"\s+(?![\[(])"
    fields = re.split(delimiters, layout.heading[-1].strip(' \t\r\n#%"'))
    found = [_TITLE.fullmatch(field.strip(" \"'")) for field in fields]
    names = [match[1].lower() if match else "" for match in found]
    names = ["z" if name in _NAMES_OF_Z else name for name in names]
    if len(names) != layout.columns or any(names.count(axis) != 1 for axis in "xyz"):
        return []
    return [(name, metres_of(match[2] or "") if match else None) for name, match in zip(names, found, strict=True)]


def _find_columns(count, settings, names):
    """Return the numbers (from 1) of the columns x, y and z in a table with `count` columns."""
    if settings.columns is not None:
        if max(settings.columns) > count:
            raise UnfitTopography("columns", f"is larger than the number of columns; expected 1 to {count}")
        return list(settings.columns)
    if names:
        return [names.index(axis) + 1 for axis in "xyz"]
    if count != 3:
        waves = ". For wave vectors and amplitudes use `format: fourier`" if count == 4 else ""
        raise UnfitTopography(
            "columns",
            f"is missing, and lines have {count} numbers; expected the columns x, y and z, such as [1, 2, 3]{waves}",
        )
    return [1, 2, 3]


def _mark_missing(heights, heading):
    """Replace numbers by nan if the heading defines them as missing heights."""
    for number in heading.missing:
        heights = np.where(np.isclose(heights, number, rtol=_FEW_DIGITS, atol=0), np.nan, heights)
    return heights


def _read_heading(lines: Sequence[str], shape: tuple[int, int], decimal_comma: bool, settings: Preparation) -> _Heading:
    """Read units, size and missing heights from the heading of a table with the given shape (rows, columns).

    Raises UnfitTopography if the size in the heading has an ambiguous comma and the settings have no size.
    """
    entries, sides = _entries(lines), _image_sides(lines)
    if {"ncols", "nrows", "cellsize"} <= entries.keys():
        entries.setdefault(_MISSING[0], _ESRI_MISSING)

    def values(names):
        return [entries[name] for name in names if name in entries]

    sizes, pixels = values(_SIZES), values(_PIXELS)
    commas = [text for text in (*sizes, *pixels, *sides) if AMBIGUOUS_COMMA.match(text)]
    if commas and not decimal_comma and settings.size is None:
        raise UnfitTopography(
            "size",
            f"is {commas[0]!r} in the file; the comma may be decimal or separate thousands. Give the size in this key",
        )
    size, coordinates = _size([*([" x ".join(sides)] if sides else []), *sizes], pixels, shape)
    return _Heading(
        height_unit=next(filter(None, map(metres_of, values(_UNITS))), None),
        lateral_unit=metres_of(entries.get("lateral units", "")),
        size=size,
        coordinates=coordinates,
        missing=tuple(_number(found[1]) for found in map(_LENGTHS.match, values(_MISSING)) if found),
    )


def _image_sides(lines: Sequence[str]) -> list[str]:
    """Return width and height, as text, from the heading of an image that Gwyddion exported; else an empty list."""
    for line, following in itertools.pairwise(lines):
        if (found := _WIDTH.match(line)) and ":" in following:
            return [found[2].strip(), following.partition(":")[2].strip()]
    return []


def _check_counts(lines: Sequence[str], shapes: Sequence[tuple[int, int]]) -> None:
    """Raise UnfitTopography unless one of the shapes has the rows and columns that the heading states."""
    entries = _entries(lines)
    for axis, (what, names) in enumerate(_COUNTS.items()):
        counts = [int(entries[name]) for name in names if entries.get(name, "").isdecimal()]
        if counts and counts[0] not in [shape[axis] for shape in shapes]:
            raise UnfitTopography(
                "path",
                f"has {shapes[-1][axis]} {what} of numbers, but its heading states {counts[0]}; expected a whole "
                "table. Export the table again, or correct the heading",
            )


def _entries(lines):
    """Return the names (in small letters) and the values that a heading contains."""
    entries = {}
    for line in lines:
        if found := _ENTRY.match(line):
            entries.setdefault(re.sub(r"[\s_.-]+", " ", found[1].lower()).strip(), found[2].strip())
    return entries


def _size(sizes, pixels, shape):
    """Return the sides (x, y) in m, and the sides in an unknown unit; unavailable sides are None."""
    rows, columns = shape
    for texts, (nx, ny) in ((sizes, (1, 1)), (pixels, (columns, rows))):
        for x, y, in_metres in filter(None, map(_lengths, texts)):
            if in_metres:
                return (x * nx, y * ny), None
            if texts is pixels:
                return None, (x * nx, y * ny)
    return None, None


def _lengths(text):
    """Return lengths x and y from a text, and True if they are in m, else False; None if the text has no lengths."""
    if not (found := _LENGTHS.match(text)):
        return None
    x, y, units = _number(found[1]), _number(found[3] or found[1]), (found[2] or found[4], found[4] or found[2])
    if units == (None, None):
        return x, y, False
    x_unit, y_unit = map(metres_of, units)
    return (x * x_unit, y * y_unit, True) if x_unit and y_unit else None


def _number(text):
    return float(text.replace(",", "."))


def read_fourier(file: SourceFile, settings: Preparation) -> FileContent:
    """Read a text file with a wave in every line, and sum the waves: h = sum h_q exp(i q.r).

    If the wave -q is missing, its amplitude is the conjugate of the amplitude of q.
    """
    table = file.values
    if table.shape[1] != 4 or not np.all(np.isfinite(table)):
        raise _not_waves("expected four numbers in each line: qx qy Re Im")
    k = _wave_numbers(table[:, :2], settings)
    period = 2 * np.pi * np.max(np.abs(k)) / np.max(np.abs(table[:, :2]))
    modes = table[:, 2] + 1j * table[:, 3]
    if len(np.unique(k, axis=0)) < len(k):
        raise _not_waves("a wave vector is given twice; expected every wave vector once")
    highest = int(np.max(np.abs(k)))
    n = settings.grid or 2 ** math.ceil(math.log2(max(4 * highest, 8)))
    if 2 * highest >= n:
        raise UnfitTopography(
            "grid",
            f"is too coarse for the shortest wave, period/{highest}; expected at least {2 * highest + 2}, better "
            f"{4 * highest} or more",
        )
    require_room(_BYTES_OF_NODE * n**2)
    spectrum, present = np.zeros((n, n), dtype=complex), np.zeros((n, n), dtype=bool)
    spectrum[k[:, 1], k[:, 0]] = modes
    present[k[:, 1], k[:, 0]] = True
    opposite = np.ix_(-np.arange(n) % n, -np.arange(n) % n)
    conjugate, opposite_present = np.conj(spectrum[opposite]), present[opposite]
    differences = np.abs(spectrum - conjugate)[present & opposite_present]
    if np.max(differences, initial=0.0) > _CONJUGATE * np.max(np.abs(modes)):
        raise _not_waves("the heights would be complex; expected conjugate amplitudes of opposite wave vectors")
    spectrum = np.where(opposite_present & ~present, conjugate, spectrum)
    heights = scipy.fft.ifft2(spectrum, norm="forward", workers=1).real
    return FileContent(heights, coordinates=(period, period))


def _not_waves(problem):
    return UnfitTopography("path", f"cannot be read as fourier: {problem}")


def _wave_numbers(q, settings):
    """Return integer wave vectors, (n, 2) array, in units of 2 pi/period; integers in the file have this unit."""
    largest = np.max(np.abs(q))
    if settings.size is not None and settings.size[0] != settings.size[1]:
        raise UnfitTopography("size", "has different sides, but a Fourier series needs a square; expected one length")
    if np.all(q == np.rint(q)):
        if settings.size is None:
            raise UnfitTopography(
                "size",
                "is missing, but integer wave vectors are multiples of 2 pi/L; expected the period L, such as '0.1 mm'",
            )
        k = q
    else:
        unit = np.min(np.abs(q)[np.abs(q) > 1e-9 * largest])
        # The smallest wave number has few digits in the file. Therefore the unit is computed from the largest one.
        k = np.rint(q * (np.max(np.abs(np.rint(q / unit))) / largest))
        if np.max(np.abs(q * (np.max(np.abs(k)) / largest) - k)) > 0.01:
            raise _not_waves("expected wave vectors that are multiples of the smallest one")
    if not 0 < np.max(np.abs(k)) <= GRID.most / 2:
        raise _not_waves(f"expected no wave shorter than the period/{GRID.most // 2}")
    return k.astype(int)
