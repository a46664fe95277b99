"""Readers of text: a row of heights per line, or x y z."""

from pathlib import Path

import numpy as np

from icha.support.input_files import require_room
from icha.surfaces.measured.found import Found, regular_ticks, with_y_first
from icha.surfaces.measured.instrument_files import is_instrument_text, read_instrument
from icha.surfaces.measured.settings import LINE_SCAN, Preparation, UnfitTopography
from icha.surfaces.measured.text_headings import WIDTH, read_heading
from icha.surfaces.measured.text_tables import layout_of, read_table, without_scales

# A surface has at least so many columns of heights.
_FEWEST_COLUMNS = 8


def read_matrix(path: Path, how: Preparation) -> Found:
    """Read a row of heights in every line, and what a heading says of units, size and missing heights."""
    table = read_table(path)
    if table.heading and (known := _as_instrument_file(path, how, table)):
        return known
    heights, steps, remark = without_scales(table.values)
    rows, columns = heights.shape
    heading = read_heading(table.heading, heights.shape)
    coordinates = heading.coordinates or (steps and (columns * steps[0], rows * steps[1]))
    return Found(
        with_y_first(_without_missing(heights, heading), how),
        heading.height_unit,
        heading.size,
        coordinates,
        remark=remark,
    )


def _as_instrument_file(path, how, table):
    """What SurfaceTopography, which knows many headings, finds; None if its heights are not all of the numbers."""
    try:
        found = read_instrument(path, how)
    except Exception:  # whatever it raises at texts of other kinds
        return None
    if found.unit is None or found.heights.shape != table.values.shape or np.isnan(table.values).any():
        return None
    scale = np.max(np.abs(found.heights)) / np.max(np.abs(table.values))
    same = np.allclose(found.heights, scale * table.values, rtol=1e-9, atol=1e-9 * np.max(np.abs(found.heights)))
    return found if same else None


def read_xyz(path: Path, how: Preparation) -> Found:
    """Read x y z in every line, in any order; points may be missing. A heading may give the units."""
    table = read_table(path)
    points = _columns_of_points(table.values, how)
    heading = read_heading(table.heading, points.shape)
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
    sides, lateral = (nx * dx, ny * dy), heading.lateral_unit
    size = (sides[0] * lateral, sides[1] * lateral) if lateral and how.lateral_unit is None else None
    return Found(heights.reshape(ny, nx), heading.height_unit, size, coordinates=sides)


def _columns_of_points(values, how):
    """The columns x, y and z (k, 3) of a table."""
    count = values.shape[1]
    columns = how.columns or (1, 2, 3)
    if max(columns) > count:
        raise UnfitTopography("columns", f"is {list(columns)}, and a line has {count} numbers; allowed: 1 to {count}")
    if how.columns is None and count != 3:
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
    return np.where(np.isin(heights, heading.missing), np.nan, heights) if heading.missing else heights


def format_of_text(path: Path) -> str | None:
    """Format of a text file, by its columns; None if it is no table of numbers, or a format of an instrument."""
    layout = layout_of(path)
    if layout is None or (layout.words and is_instrument_text(path)):
        return None
    if any(map(WIDTH.match, layout.heading)):
        return "matrix"
    if layout.columns == 4 and looks_like_fourier(read_table(path).values):
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
