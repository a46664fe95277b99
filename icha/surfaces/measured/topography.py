"""Measured topographies: reading what instruments and people write, and preparing it for the model.

A measurement becomes a surface in this order: heights and lengths in metres, the side that touches first up, a square
cut out, the trend removed, missing points filled, edges made what the boundary asks for, and the grid changed.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import scipy.fft
import scipy.sparse
import scipy.sparse.linalg

from icha.support.validation import flaw_of_heights
from icha.surfaces.surface import FREE, PERIODIC, Surface

# How the edges of a measurement are treated; `FREE` is the one that does not end in a periodic surface.
WINDOW, MIRROR = "window", "mirror"
# Points along a side that a text of coordinates may have.
_MOST_NODES = 32768
# Rounding of the quotient of two lengths must not cost a pixel.
_ROUNDING = 1e-9
# Relative difference of the two sides of a square of whole pixels that are not square.
_SQUARE = 1e-3
# Heights that differ by less than this part of the largest one, once their trend is removed, are rounding.
_FLAT = 1e-13
# Letters of what a library says about a file that it cannot read.
_LONGEST_REASON = 160


class UnfitTopography(ValueError):
    """A file that is no topography or cannot be prepared as asked; `key`: the setting that is at fault."""

    def __init__(self, key: str, message: str):
        """Keep the key and the message, which says why and what is allowed."""
        super().__init__(message)
        self.key = key


@dataclass(frozen=True)
class Preparation:
    """What the numbers of a file mean and how they become a surface.

    Parameters
    ----------
    format : a name of `READERS`, or "auto".
    boundary : "periodic", "window", "mirror" or "free".
    data : name of variable, dataset or channel; None: the only one, or the file's own default.
    first_axis : "y" or "x", the first axis of arrays whose dimensions have no names.
    height_unit, lateral_unit : metres; None: as the file says, and the lateral one else that of height.
    size : (x, y) of the whole scan, m; None: as the file says.
    touches_first : "high" or "low" numbers.
    missing : "refuse" or "fill".
    crop : x, y, side (m) of the square; None: the largest, in the middle.
    detrend : "none", "tilt" or "curvature".
    taper : of a window, part of the side on which it falls at either edge.
    grid : nodes along a side of the result; None: as the scan.
    """

    format: str
    boundary: str
    data: str | None = None
    first_axis: str = "y"
    height_unit: float | None = None
    lateral_unit: float | None = None
    size: tuple[float, float] | None = None
    touches_first: str = "high"
    missing: str = "refuse"
    crop: Mapping[str, float] | None = None
    detrend: str = "none"
    taper: float | None = None
    grid: int | None = None


@dataclass(frozen=True, eq=False)
class PreparedTopography:
    """A surface at its own heights, and what was done to the file to get it."""

    surface: Surface
    source_file: str
    source_sha256: str
    description: str

    @property
    def rms_slope(self) -> float:
        """Root mean square slope of the surface as prepared."""
        return self.surface.rms_slope


@dataclass(frozen=True)
class TopographyFacts:
    """What the plan of a campaign needs to know of a measured surface: side (m) and nodes, slope and boundary."""

    grid: int
    period: float
    rms_slope: float
    boundary: str


def topography_facts(path: str | os.PathLike, preparation: Mapping) -> TopographyFacts:
    """Facts of the prepared surface; arguments and errors as `prepared_topography`. Known ones cost nothing."""
    stat = _existing(path).stat()
    return _facts(os.fspath(path), stat.st_mtime_ns, stat.st_size, json.dumps(preparation, sort_keys=True))


@lru_cache(maxsize=256)
def _facts(path, modified, size, preparation):
    surface = prepared_topography(path, json.loads(preparation)).surface
    return TopographyFacts(surface.grid, surface.period, surface.rms_slope, surface.boundary)


def prepared_topography(path: str | os.PathLike, preparation: Mapping) -> PreparedTopography:
    """Read a topography and make the surface that the settings describe.

    Parameters
    ----------
    path : the file.
    preparation : arguments of `Preparation`, as `MeasuredSurface.preparation` gives them.

    Raises
    ------
    UnfitTopography
        A ValueError that says which setting (`key`) does not fit the file, why, and what is allowed.
    """
    path, how = _existing(path), Preparation(**preparation)
    scan = read_scan(path, how)
    steps = [scan.description]
    if how.touches_first == "low":
        scan = replace(scan, heights=-scan.heights)
    steps.append(f"{how.touches_first} numbers touch first")
    part, said = _cropped(scan, how)
    steps += said
    left = part
    for step in (_detrended, _filled):
        left, said = step(left, how)
        steps += said
    _check_roughness(left, part, how)
    surface, said = _bounded(left, how)
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return PreparedTopography(surface, path.name, digest, "; ".join([*steps, *said]))


_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: ""}


def in_words(metres: float) -> str:
    """A length with a unit as configurations write it, such as `2.5 um`."""
    power = 3 * math.floor(math.log10(abs(metres)) / 3 + 1e-9) if metres else 0
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return f"{metres * 10.0**-power:.6g} {_PREFIXES[power]}m"


def _existing(path):
    path = Path(path)
    if not path.is_file():
        raise UnfitTopography("path", "no such file; allowed: a file of heights")
    return path


# --- reading -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Scan:
    """What a file says in metres: heights (ny, nx), nan where missing, first axis y, and the size (x, y) of it all.

    coordinate_unit: metres, where the size follows from coordinates whose unit the file does not tell.
    """

    heights: np.ndarray
    size: tuple[float, float]
    description: str = ""
    coordinate_unit: float | None = None

    @property
    def pixel(self) -> tuple[float, float]:
        """Distance of neighbouring nodes along x and along y, m."""
        rows, columns = self.heights.shape
        return self.size[0] / columns, self.size[1] / rows

    @property
    def remark_on_unit(self) -> str:
        """What is to be added where a length of the scan is at fault."""
        if self.coordinate_unit is None:
            return ""
        return f"; the coordinates are taken to be in units of {in_words(self.coordinate_unit)}, see `lateral_unit`"


@dataclass(frozen=True, eq=False)
class _Found:
    """What a reader finds: heights (ny, nx) in its own unit, nan where missing; unit and size in m, if it knows them.

    coordinates: size (x, y) in units of length that the file does not tell.
    """

    heights: np.ndarray
    unit: float | None = None
    size: tuple[float, float] | None = None
    coordinates: tuple[float, float] | None = None


def read_scan(path: Path, how: Preparation) -> Scan:
    """Read a file of any of the formats; errors as `prepared_topography`."""
    if not path.stat().st_size:
        raise UnfitTopography("path", "is empty; allowed: a file of heights")
    name = _format_of(path) if how.format == "auto" else how.format
    try:
        found = READERS[name](path, how)
    except UnfitTopography:
        raise
    except Exception as error:  # whatever the libraries raise for files that are damaged or of another kind
        reason = " ".join(str(error).replace(str(path), path.name).split()) or type(error).__name__
        if len(reason) > _LONGEST_REASON:
            reason = f"{reason[: _LONGEST_REASON - 1]}…"
        raise UnfitTopography(
            "path", f"cannot be read as {name} ({reason}); allowed: a file that is, or another `format`"
        ) from None
    heights = np.asarray(found.heights)
    if heights.dtype.kind not in "iuf":
        raise UnfitTopography("path", f"holds {heights.dtype}, not real numbers; allowed: heights")
    if heights.ndim != 2:
        raise UnfitTopography("path", f"holds an array of shape {heights.shape}; allowed: rows and columns of heights")
    if not heights.size:
        raise UnfitTopography(
            "path", f"holds an array of shape {heights.shape}, no heights; allowed: a file of heights"
        )
    unit = how.height_unit or found.unit
    if unit is None:
        raise UnfitTopography("height_unit", "is missing, and the file does not say it; allowed: such as 'um'")
    size, coordinate_unit = how.size or found.size, None
    if size is None and found.coordinates is not None:
        coordinate_unit = how.lateral_unit or unit
        size = tuple(each * coordinate_unit for each in found.coordinates)
    if size is None:
        raise UnfitTopography("size", "is missing, and the file does not say it; allowed: a length, such as '90 um'")
    rows, columns = heights.shape
    scan = Scan(heights.astype(float) * unit, tuple(size), "", coordinate_unit)
    if not all(np.isfinite(each) and each > 0 for each in size):
        raise UnfitTopography(
            "size", f"is {size[0]:g} m by {size[1]:g} m in the file{scan.remark_on_unit}; allowed: give it here"
        )
    said = f"{name}, {columns} x {rows} points over {size[0]:.6g} m x {size[1]:.6g} m, heights in {unit:.6g} m"
    return replace(scan, description=said)


def _format_of(path):
    suffix = path.suffix.lower()
    known = {".npy": "npy", ".nc": "netcdf", ".nc4": "netcdf", ".h5": "hdf5", ".hdf5": "hdf5", ".xyz": "xyz"}
    if suffix in known:
        return known[suffix]
    columns = _columns_of_text(path)
    return {None: "instrument", 3: "xyz", 4: "fourier"}.get(columns, "matrix")


def _columns_of_text(path):
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


_SEPARATORS = str.maketrans(",;\t", "   ")


def _words(text):
    return text.translate(_SEPARATORS).split()


def _table(path):
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


def _rows_are_lines_along_x(heights, how):
    return heights.T if how.first_axis == "x" else heights


def _read_matrix(path, how):
    return _Found(_rows_are_lines_along_x(_table(path), how))


def _read_npy(path, how):
    return _Found(_rows_are_lines_along_x(np.load(path, allow_pickle=False), how))


def _read_xyz(path, how):
    """x y z in every line; the lines in any order, and points may be missing."""
    table = _table(path)
    if table.shape[1] != 3:
        raise ValueError(f"{table.shape[1]} numbers in a line, not x y z")
    (column, nx, dx), (row, ny, dy) = (_ticks(table[:, axis], "xy"[axis]) for axis in (0, 1))
    place = row * nx + column
    order = np.argsort(place, kind="stable")
    if np.any(np.diff(place[order]) == 0):
        x, y = table[order[np.flatnonzero(np.diff(place[order]) == 0)[0]], :2]
        raise ValueError(f"the point x = {x:g}, y = {y:g} is given twice")
    heights = np.full(nx * ny, np.nan)
    heights[place] = table[:, 2]
    return _Found(heights.reshape(ny, nx), coordinates=(nx * dx, ny * dy))


def _ticks(values, axis):
    """Index (n,) of every coordinate on a regular scale, and the number and distance of its ticks."""
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{axis} is not finite everywhere")
    there = np.unique(values)
    low, high = there[0], there[-1]
    # Rounding of what was written as text is no step.
    steps = np.diff(there)
    steps = steps[steps > 1e-6 * (high - low)]
    if not len(steps):
        raise ValueError(f"{axis} is the same everywhere")
    usual = np.median(steps)
    # Where every tick is there, counting them is safer than trusting the digits of one step.
    count = len(steps) + 1 if np.max(steps) < 1.5 * usual else int(np.rint((high - low) / usual)) + 1
    if count > _MOST_NODES:
        raise ValueError(f"{axis} is not on a regular grid of at most {_MOST_NODES} points")
    step = (high - low) / (count - 1)
    index = np.rint((values - low) / step).astype(int)
    if np.max(np.abs(values - low - index * step)) > 0.05 * step:
        raise ValueError(f"{axis} is not on a regular grid")
    return index, count, step


def _read_fourier(path, how):
    """qx qy Re Im in every line: h = sum h_q exp(i q.r) over all q; opposite ones, if left out, are the conjugates."""
    table = _table(path)
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
    return _Found(heights, coordinates=(period, period))


def _wave_numbers(q, how):
    """Wave vectors (n, 2) as multiples of 2 pi over the period: as they are written if they are integers."""
    largest = np.max(np.abs(q))
    if not largest > 0 or not np.all(np.isfinite(q)):
        raise ValueError("no wave vectors, or some that are not finite")
    if how.size is not None and how.size[0] != how.size[1]:
        raise UnfitTopography("size", "has two sides that differ, for a Fourier series; allowed: one length")
    if np.all(q == np.rint(q)):
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
    return k.astype(int)


def _read_netcdf(path, how):
    """The variable `data`, `height`, `heights`, `z` or the only one of two dimensions, with its units and axes."""
    import netCDF4

    with netCDF4.Dataset(path) as file:
        plane = [name for name, variable in file.variables.items() if variable.ndim == 2]
        chosen = file[_chosen(how.data, plane, ("height", "heights", "z"), "variable")]
        if chosen.ndim != 2:
            raise UnfitTopography(
                "data", f"has {chosen.ndim} dimensions; allowed: {', '.join(plane) or 'none is there'}"
            )
        heights = np.ma.filled(chosen[...].astype(float), np.nan)
        names = [name.lower() for name in chosen.dimensions]
        turned = names[0] == "x" if set(names) == {"x", "y"} else how.first_axis == "x"
        sides = []
        for axis, name in enumerate(chosen.dimensions):
            side, backwards = _side(file.variables.get(name), heights.shape[axis])
            sides.append(side)
            if backwards:
                heights = np.flip(heights, axis)
        unit = _unit_of(chosen.__dict__)
    along_y, along_x = sides[::-1] if turned else sides
    size = (along_x, along_y) if along_x and along_y else None
    return _Found(heights.T if turned else heights, unit, size)


def _side(coordinate, count):
    """Length of a side in m, None if the file does not say it, and whether its coordinate falls."""
    if coordinate is None or coordinate.ndim != 1:
        return None, False
    about, unit = coordinate.__dict__, _unit_of(coordinate.__dict__)
    values = np.ma.filled(coordinate[...].astype(float), np.nan)
    if unit is not None and "length" in about:
        return float(about["length"]) * unit, False
    if count < 2:
        return None, False
    _, ticks, step = _ticks(values, coordinate.name)
    if ticks != count:
        raise ValueError(f"{coordinate.name} is not on a regular grid")
    return (count * step * unit if unit is not None else None), values[0] > values[-1]


def _chosen(asked, there, usual, what):
    if asked is not None:
        if asked not in there:
            raise UnfitTopography("data", f"is no {what} of the file; allowed: {', '.join(there) or 'none is there'}")
        return asked
    found = [name for name in usual if name in there] or there
    if not found or (len(found) > 1 and found is there):
        many = (
            f"is missing, and the file has {len(there)}"
            if there
            else f"is missing, and the file has no {what} of two dimensions"
        )
        raise UnfitTopography("data", f"{many}; allowed: {', '.join(there) or 'another file'}")
    return found[0]


def _unit_of(attributes):
    """Metres of the unit that a variable's attributes name; None if they do not, or not of a length."""
    text = attributes.get("units", attributes.get("unit"))
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    return None if text is None else _metres(text)


def _metres(unit):
    from icha.support.units import conversion_factor

    try:
        return float(conversion_factor(str(unit), "m"))
    except ValueError:
        return None


def _read_hdf5(path, how):
    """The dataset `data`, or the only one of two dimensions; its attribute `units` or `unit`, if there is one."""
    import h5py

    with h5py.File(path) as file:
        plane = []
        file.visititems(
            lambda name, node: (
                plane.append(name)
                if isinstance(node, h5py.Dataset) and node.ndim == 2 and node.dtype.kind in "iuf"
                else None
            )
        )
        asked = how.data.strip("/") if how.data else None
        chosen = file[_chosen(asked, sorted(plane), (), "dataset")]
        return _Found(_rows_are_lines_along_x(chosen[...], how), _unit_of(dict(chosen.attrs)))


def _read_instrument(path, how):
    """Whatever SurfaceTopography reads. Its arrays have x as first axis."""
    from SurfaceTopography import open_topography
    from SurfaceTopography.Exceptions import CannotDetectFileFormat

    try:
        opened = open_topography(str(path))
    except CannotDetectFileFormat:  # its message lists what every reader says
        raise ValueError("none of the formats that SurfaceTopography knows") from None
    with opened as file:
        names = [channel.name for channel in file.channels]
        if how.data is None:
            channel = file.default_channel
        else:
            channel = file.channels[names.index(_chosen(how.data, names, (), "channel"))]
        if channel.dim != 2:
            raise UnfitTopography("data", f"is a line scan; allowed: an areal one, of {', '.join(names)}")
        said = channel.physical_sizes
        topography = channel.topography(**({"physical_sizes": (1.0, 1.0)} if said is None else {}))
        heights = np.ma.filled(np.ma.asarray(topography.heights()).astype(float), np.nan).T
        unit = None if topography.unit is None else _metres(topography.unit)
        sides = None if said is None else tuple(float(side) for side in topography.physical_sizes)
    if sides is not None and (lateral := how.lateral_unit or unit) is not None:
        return _Found(heights, unit, tuple(side * lateral for side in sides))
    return _Found(heights, unit, coordinates=sides)


READERS = {
    "npy": _read_npy,
    "netcdf": _read_netcdf,
    "matrix": _read_matrix,
    "xyz": _read_xyz,
    "hdf5": _read_hdf5,
    "fourier": _read_fourier,
    "instrument": _read_instrument,
}


# --- preparing -----------------------------------------------------------------------------------------------


def _cropped(scan, how):
    """The square of whole pixels that the settings ask for, and what is to be said about it."""
    rows, columns = scan.heights.shape
    dx, dy = scan.pixel
    if how.crop is None:
        side = min(scan.size)
        nx, ny = (int(side / each * (1 + _ROUNDING)) for each in (dx, dy))
        first_x, first_y = (columns - nx) // 2, (rows - ny) // 2
    else:
        x, y, side = (how.crop[name] for name in ("x", "y", "side"))
        first_x, first_y = round(x / dx), round(y / dy)
        nx, ny = round(side / dx), round(side / dy)
        if first_x + nx > columns or first_y + ny > rows:
            raise UnfitTopography(
                "crop",
                f"ends at x = {in_words(x + side)}, y = {in_words(y + side)}, outside of the scan"
                f"{scan.remark_on_unit}; allowed: up to x = {in_words(scan.size[0])}, y = {in_words(scan.size[1])}",
            )
    if nx < 8 or ny < 8:
        raise UnfitTopography(
            "crop" if how.crop else "path",
            f"leaves {nx} x {ny} points{scan.remark_on_unit}; allowed: at least 8 x 8 of them",
        )
    if how.boundary == PERIODIC and (nx, ny) != (columns, rows):
        raise UnfitTopography(
            "boundary",
            f"needs a square, and the scan is {in_words(scan.size[0])} x {in_words(scan.size[1])}; allowed: a square "
            "one, or another boundary",
        )
    if abs(nx * dx / (ny * dy) - 1) > _SQUARE:
        raise UnfitTopography(
            "crop",
            f"leaves {nx} x {ny} pixels of {in_words(dx)} x {in_words(dy)}, which are no square; allowed: x, y and a "
            "side of whole pixels both ways",
        )
    if nx != ny and how.grid is None:
        raise UnfitTopography(
            "grid",
            f"is missing, and the pixels of {in_words(dx)} x {in_words(dy)} are not square; allowed: the nodes along a "
            f"side to which {nx} x {ny} points are resampled",
        )
    part = scan.heights[first_y : first_y + ny, first_x : first_x + nx]
    said = [] if part.shape == scan.heights.shape else [f"cut to {nx} x {ny} points from ({first_x}, {first_y})"]
    return Scan(part, (nx * dx, ny * dy)), said


def _detrended(scan, how):
    """Without the plane or paraboloid that fits the known heights best."""
    known = np.isfinite(scan.heights)
    if not known.any():
        raise UnfitTopography("path", "holds no height at all in the part that is used; allowed: another part or file")
    degree = {"none": 0, "tilt": 1, "curvature": 2}[how.detrend]
    if degree == 0:
        return scan, []
    rows, columns = scan.heights.shape
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    y, x = (np.vander(np.linspace(-1, 1, n), 2 * degree + 1, increasing=True) for n in (rows, columns))
    # Sums over the known points of all products of powers, without a table of all points.
    moments = y.T @ known.astype(float) @ x
    weighted = y.T @ np.where(known, scan.heights, 0.0) @ x
    matrix = np.array([[moments[i + k, j + m] for k, m in powers] for i, j in powers])
    right = np.array([weighted[i, j] for i, j in powers])
    coefficients = np.zeros((degree + 1, degree + 1))
    coefficients[tuple(np.transpose(powers))] = np.linalg.lstsq(matrix, right, rcond=None)[0]
    trend = y[:, : degree + 1] @ coefficients @ x[:, : degree + 1].T
    return replace(scan, heights=scan.heights - trend), [f"{how.detrend} removed"]


def _check_roughness(left, part, how):
    """Raise unless the heights that are left of a part of the scan are more than the rounding of those that it had."""
    if np.ptp(left.heights) <= _FLAT * np.nanmax(np.abs(part.heights), where=np.isfinite(part.heights), initial=0.0):
        without = "" if how.detrend == "none" else " but for the trend that is removed"
        raise UnfitTopography("path", f"holds heights that are all the same{without}; allowed: a rough surface")


def _filled(scan, how):
    """Without missing points."""
    missing = ~np.isfinite(scan.heights)
    count = int(np.count_nonzero(missing))
    if not count:
        return scan, []
    if how.missing == "refuse":
        raise UnfitTopography(
            "missing",
            f"stops at points without a height, and there are {count} among {missing.size}; allowed: fill, or a crop "
            "without them",
        )
    if 2 * count > missing.size:
        raise UnfitTopography("missing", f"would make up {count} of {missing.size} points; allowed: up to half of them")
    heights = scan.heights.copy()
    heights[missing] = _harmonic(heights, missing, periodic=how.boundary == PERIODIC)
    return replace(scan, heights=heights), [f"{count} missing points filled"]


def _harmonic(heights, missing, *, periodic):
    """Heights (count,) of the missing points, each the mean of those of its four neighbours; edges have fewer.

    SurfaceTopography does the same, and takes seconds to import.
    """
    row, column = np.nonzero(missing)
    count = len(row)
    index = np.full(missing.shape, -1)
    index[missing] = np.arange(count)
    neighbours, right = np.zeros(count), np.zeros(count)
    pairs = []
    for down, across in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        y, x = row + down, column + across
        if periodic:
            y, x = y % missing.shape[0], x % missing.shape[1]
        there = np.flatnonzero((y >= 0) & (y < missing.shape[0]) & (x >= 0) & (x < missing.shape[1]))
        neighbours[there] += 1
        other = index[y[there], x[there]]
        known = there[other < 0]
        right[known] += heights[y[known], x[known]]
        pairs.append((there[other >= 0], other[other >= 0]))
    first, second = (np.concatenate(each) for each in zip(*pairs, strict=True))
    coupling = scipy.sparse.csc_matrix((np.full(len(first), -1.0), (first, second)), shape=(count, count))
    return scipy.sparse.linalg.spsolve(coupling + scipy.sparse.diags(neighbours, format="csc"), right)


def _bounded(scan, how):
    """The surface with edges as its boundary has them, on the grid that is asked for."""
    heights, side = scan.heights - np.mean(scan.heights), scan.size[0]
    said = []
    if how.boundary == WINDOW:
        across, along = (_taper(n, how.taper) for n in heights.shape)
        heights = heights * across[:, None] * along
        said.append(f"heights fall to their mean on {how.taper:g} of the side at every edge")
    if how.boundary == MIRROR:
        heights = np.concatenate([heights, heights[:, ::-1]], axis=1)
        heights = np.concatenate([heights, heights[::-1]], axis=0)
        side = 2 * side
        said.append("joined by its mirror images")
    grid = how.grid or heights.shape[0]
    if heights.shape != (grid, grid):
        heights = _resampled(heights, grid, free=how.boundary == FREE)
        said.append(f"resampled to {grid} x {grid} points")
    if flaw := flaw_of_heights(heights):
        raise UnfitTopography("path", f"holds {flaw}; allowed: a rough surface")
    free = how.boundary == FREE
    said.append("one square on a free half-space" if free else f"repeats after {side:.6g} m")
    return Surface(heights, side, FREE if free else PERIODIC), said


def _taper(n, part):
    """Tukey's window at n points, cell by cell: a cosine's half wave at either edge and one in between."""
    x = (np.arange(n) + 0.5) / n
    edge = np.minimum(np.minimum(x, 1 - x) / part, 1.0)
    return np.sin(0.5 * np.pi * edge) ** 2


def _resampled(heights, grid, *, free):
    """The same heights on grid x grid points: by their Fourier series, or, of a free square, by their cosine series."""
    # Slow to import, and seldom needed.
    from scipy.signal import resample

    for axis in (0, 1):
        n = heights.shape[axis]
        if n == grid:
            continue
        if not free:
            heights = resample(heights, grid, axis=axis)
            continue
        series = np.moveaxis(scipy.fft.dct(heights, axis=axis, norm="forward", workers=1), axis, 0)[:grid]
        padded = np.zeros((grid, series.shape[1]))
        padded[: len(series)] = series
        heights = np.moveaxis(scipy.fft.idct(padded, axis=0, norm="forward", workers=1), 0, axis)
    return heights
