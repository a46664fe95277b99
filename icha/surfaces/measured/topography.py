"""Prepare a surface from the file of a measured topography.

The steps are: read heights and lengths in metres (`scan`); make heights positive on the side that touches first; cut
out a square; remove outliers, offsets of lines and the trend; fill missing points; make pixels square; filter short
waves; treat the edges as `boundary` requires; change the grid.

SurfaceTopography reads the files of instruments. SurfaceTopography could also remove trends and fill holes. ICHA does
these steps itself, because the import of SurfaceTopography takes seconds.
"""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.fft
import scipy.sparse
import scipy.sparse.linalg

from icha.support import formatting
from icha.support.checksums import sha256_of
from icha.support.input_files import TooLarge, require_room
from icha.surfaces.measured.defects import (
    MOST_OUTLIERS,
    Defects,
    find_outliers,
    level_lines,
    line_offsets,
    without_trend,
)
from icha.surfaces.measured.scan import Scan, load_scan
from icha.surfaces.measured.settings import MIRROR, WINDOW, Preparation, UnfitTopography
from icha.surfaces.surface import FREE, PERIODIC, Surface

# Relative rounding error of the quotient of two lengths.
_ROUNDING = 1e-9
# A surface is flat if the range of prepared heights, divided by the largest height in the file, is at most this value.
_FLAT = 1e-13
# A pixel counts as square if the relative difference of its sides is at most this value.
SQUARE = 1e-3
# Standard deviation of the filter, divided by the nesting index: alpha/sqrt(2 pi), alpha = sqrt(ln 2/pi), ISO 16610-61.
DEVIATION = math.sqrt(math.log(2) / 2) / math.pi
# Smallest nesting index, in pixels. With a smaller index, the filter would not have the transmission of the standard.
LEAST_PIXELS = 4
# Distance, in standard deviations, at which the weights of the filter are cut off; the omitted share is 2e-9.
_REACH = 6


@dataclass(frozen=True, eq=False)
class PreparedTopography:
    """A surface with its measured heights, and a record of how it was prepared from a file.

    Attributes
    ----------
    source_file, source_sha256 : name of the file and SHA-256 of its content.
    description : all steps from the file to the surface, as text for users.
    reading : points, pixels, units and omitted parts of the file, as text for users.
    filled : number of missing points that were filled.
    points : number of points in the whole square, not along a side, before resampling.
    square : the square that is cut out of the scan, before its preparation.
    """

    surface: Surface
    source_file: str
    source_sha256: str
    description: str
    reading: str
    filled: int
    points: int
    square: Scan


def prepared_topography(path: str | os.PathLike, preparation: Mapping) -> PreparedTopography:
    """Read a topography from a file and prepare a surface; `preparation` contains the arguments of `Preparation`.

    Raises UnfitTopography if the file or a setting does not fit.
    """
    file, settings = Path(path), Preparation(**preparation)
    scan = load_scan(file, settings)
    touching = scan.heights if settings.touches_first == "high" else -scan.heights
    square = crop_square(scan.after(touching, f"{settings.touches_first} numbers touch first"), settings)
    cleaned = prepared = remove_outliers(square, settings)
    for step in (
        level,
        remove_trend,
        fill_missing_points,
        resample_to_square_pixels,
        filter_short_waves,
    ):
        prepared = step(prepared, settings)
    refuse_flat(prepared, cleaned, settings)
    surface, steps = treat_edges(prepared, square, settings)
    return PreparedTopography(
        surface=surface,
        source_file=file.name,
        source_sha256=sha256_of(file),
        description="; ".join(steps),
        reading="; ".join([scan.steps[0], *(step for step in steps if "resampled" in step)]),
        filled=int(np.count_nonzero(~np.isfinite(square.heights))),
        points=square.heights.size,
        square=square,
    )


def crop_square(scan: Scan, settings: Preparation) -> Scan:
    """Cut out a square of whole pixels. If the pixels are not square, the sides may differ by less than a pixel."""
    rows, columns = scan.heights.shape
    dx, dy = scan.pixel
    width, height = map(formatting.length, scan.size)
    if settings.crop is None:
        side = min(scan.size)
        nx, ny = (int(side / each * (1 + _ROUNDING)) for each in (dx, dy))
        if abs(dx / dy - 1) <= SQUARE:
            nx = ny = min(nx, ny)
        first_x, first_y = (columns - nx) // 2, (rows - ny) // 2
    else:
        x, y, side = (settings.crop[name] for name in ("x", "y", "side"))
        first_x, first_y = round(x / dx), round(y / dy)
        nx, ny = round(side / dx), round(side / dy)
        if first_x + nx > columns or first_y + ny > rows:
            raise UnfitTopography(
                f"ends at x = {formatting.length(x + side)}, y = {formatting.length(y + side)}, outside the "
                f"scan; expected at most x = {width}, y = {height}",
                "crop",
            )
    if nx < 8 or ny < 8:
        raise UnfitTopography(
            f"gives a square of {nx} x {ny} points; expected at least 8 x 8", "crop" if settings.crop else "path"
        )
    if settings.boundary == PERIODIC and ((nx, ny) != (columns, rows) or abs(nx * dx / (ny * dy) - 1) > SQUARE):
        raise UnfitTopography(
            f"requires a square scan that is not cropped; the scan is {width} x {height}; expected another boundary",
            "boundary",
        )
    square = scan.heights[first_y : first_y + ny, first_x : first_x + nx]
    step = [] if square.shape == scan.heights.shape else [f"cut to {nx} x {ny} points from ({first_x}, {first_y})"]
    return scan.after(square, *step, size=(nx * dx, ny * dy))


def remove_outliers(scan: Scan, settings: Preparation) -> Scan:
    """Replace outliers by the solution of Laplace's equation, if the setting `outliers` is "remove"."""
    if settings.outliers != "remove" or not np.isfinite(scan.heights).any():
        return scan
    outliers, largest = find_outliers(scan.heights)
    count = int(np.count_nonzero(outliers))
    if count > MOST_OUTLIERS * outliers.size:
        raise UnfitTopography(
            f"cannot remove {count} of {outliers.size} points that stand out from the points around them; expected at "
            f"most {100 * MOST_OUTLIERS:g} %. Write keep if they belong to the surface, or crop the scan",
            "outliers",
        )
    if not count:
        return scan
    heights, gaps = scan.heights.copy(), outliers | ~np.isfinite(scan.heights)
    heights[gaps] = _harmonic(heights, gaps, periodic=settings.boundary == PERIODIC)
    heights[gaps & ~outliers] = np.nan
    share = formatting.share(count, outliers.size)
    return scan.after(
        heights, f"{count} outliers replaced, {share} of the points, the largest of {largest:.3g} rms heights"
    )


def level(scan: Scan, settings: Preparation) -> Scan:
    """Remove offsets between lines of points, if the setting `levelling` names the direction of the lines."""
    if settings.levelling == "none":
        return scan
    rows = settings.levelling == "lines"
    heights, tilted = level_lines(scan.heights if rows else scan.heights.T)
    removed = f"mean height{' and tilt' if tilted else ''} of each line along {'x' if rows else 'y'} removed"
    return scan.after(heights if rows else heights.T, removed)


def defects_of(scan: Scan) -> Defects:
    """Return the defects of a scan, before they are removed."""
    outliers, largest = find_outliers(scan.heights)
    level = without_trend(np.where(outliers, np.nan, scan.heights), 1)
    curvature = 1 - float(np.nanvar(without_trend(level, 2)) / (np.nanvar(level) or 1.0))
    return Defects(int(np.count_nonzero(outliers)), largest, line_offsets(level), curvature)


def remove_trend(scan: Scan, settings: Preparation) -> Scan:
    """Remove the plane or the paraboloid that fits the known heights best."""
    known = np.isfinite(scan.heights)
    if not known.any():
        raise UnfitTopography("has no height within the square that is used; expected another crop or file")
    degree = {"none": 0, "tilt": 1, "curvature": 2}[settings.detrend]
    if degree == 0:
        return scan
    return scan.after(without_trend(scan.heights, degree), f"{settings.detrend} removed")


def refuse_flat(prepared: Scan, cleaned: Scan, settings: Preparation) -> None:
    """Raise UnfitTopography if the prepared heights are only rounding errors of the heights without outliers."""
    known = np.isfinite(cleaned.heights)
    if np.ptp(prepared.heights) <= _FLAT * np.nanmax(np.abs(cleaned.heights), where=known, initial=0.0):
        apart = "" if settings.detrend == "none" else ", apart from the trend that is removed"
        raise UnfitTopography(f"contains heights that are all the same{apart}; expected a rough surface")


def fill_missing_points(scan: Scan, settings: Preparation) -> Scan:
    """Fill missing points with the solution of Laplace's equation; raise UnfitTopography if `missing` is "refuse"."""
    missing = ~np.isfinite(scan.heights)
    count = int(np.count_nonzero(missing))
    if not count:
        return scan
    if settings.missing == "refuse":
        raise UnfitTopography(
            f"does not allow {count} of {missing.size} points without a height; expected fill, or a crop without such "
            "points",
            "missing",
        )
    if 2 * count > missing.size:
        raise UnfitTopography(f"cannot fill {count} of {missing.size} points; expected at most half", "missing")
    heights = scan.heights.copy()
    heights[missing] = _harmonic(heights, missing, periodic=settings.boundary == PERIODIC)
    return scan.after(heights, f"{count} missing points filled, {formatting.share(count, missing.size)} of the points")


def _harmonic(heights, missing, *, periodic):
    """Solve Laplace's equation: each missing height is the mean of its neighbours; return the missing heights, (k,)."""
    row, column = np.nonzero(missing)
    count, pairs = len(row), []
    index = np.full(missing.shape, -1)
    index[missing] = np.arange(count)
    neighbours, right = np.zeros(count), np.zeros(count)
    for down, across in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        y, x = row + down, column + across
        if periodic:
            y, x = y % missing.shape[0], x % missing.shape[1]
        inside = np.flatnonzero((y >= 0) & (y < missing.shape[0]) & (x >= 0) & (x < missing.shape[1]))
        neighbours[inside] += 1
        other = index[y[inside], x[inside]]
        known = inside[other < 0]
        right[known] += heights[y[known], x[known]]
        pairs.append((inside[other >= 0], other[other >= 0]))
    first, second = (np.concatenate(each) for each in zip(*pairs, strict=True))
    coupling = scipy.sparse.csc_matrix((np.full(len(first), -1.0), (first, second)), shape=(count, count))
    return scipy.sparse.linalg.spsolve(coupling + scipy.sparse.diags(neighbours, format="csc"), right)


def resample_to_square_pixels(scan: Scan, settings: Preparation) -> Scan:
    """Resample a scan to square pixels. The new pixels have the shorter side of the original pixels.

    A cosine series interpolates the heights along the longer side of the pixels. The series keeps all measured waves
    and their rms slope, and adds no wave shorter than two pixels. `treat_edges` resamples periodic scans.
    """
    dx, dy = scan.pixel
    if settings.boundary == PERIODIC or abs(dx / dy - 1) <= SQUARE:
        return scan
    across, cell = (0, dx) if dx < dy else (1, dy)
    grid = int(min(scan.size) / cell * (1 + 1e-9))
    lines = np.take(scan.heights, range(grid), axis=1 - across)
    heights = _by_cosine_series(lines, across, cell / max(dx, dy), grid)
    pixel = " x ".join(map(formatting.length, (dx, dy)))
    step = f"pixels of {pixel} resampled to {grid} x {grid} square ones, by the cosine series along {'yx'[across]}"
    return scan.after(heights, step, size=(grid * cell, grid * cell))


def _by_cosine_series(heights, axis, step, count):
    """Evaluate the cosine series along an axis at the centres of `count` new pixels, each `step` old pixels wide.

    Waves shorter than two new pixels are left out.
    """
    # Slow to import, and rarely needed.
    from scipy.signal import czt

    n = heights.shape[axis]
    series = np.moveaxis(scipy.fft.dct(heights, axis=axis, norm="forward", workers=1), axis, 0)[:count]
    series[1:] *= 2
    # sum_k series_k cos(pi k y/n) at y = step (j + 1/2): a chirp z-transform.
    turn = 1j * np.pi * step / n
    return np.moveaxis(czt(series, count, w=np.exp(turn), a=np.exp(-turn / 2), axis=0).real, 0, axis)


def filter_short_waves(scan: Scan, settings: Preparation) -> Scan:
    """Apply the areal Gaussian filter of ISO 16610-61; its nesting index is the setting `cutoff`.

    The filter multiplies a wave of length l by 2^-(cutoff/l)^2. The filter continues the heights at the edges by
    reflection (ISO 16610-28), or periodically if the scan is periodic.
    """
    if settings.cutoff is None:
        return scan
    # Slow to import, and rarely needed.
    from scipy.ndimage import gaussian_filter

    least, most = LEAST_PIXELS * max(scan.pixel), min(scan.size)
    if not least * (1 - 1e-9) <= settings.cutoff <= most:
        raise UnfitTopography(
            f"is {settings.cutoff / max(scan.pixel):.3g} pixels; expected at least "
            f"{LEAST_PIXELS} pixels ({formatting.length(least)}), at most the side of the square "
            f"({formatting.length(most)})",
            "cutoff",
        )
    dx, dy = scan.pixel
    sigma = DEVIATION * settings.cutoff
    mode = "wrap" if settings.boundary == PERIODIC else "reflect"
    heights = gaussian_filter(scan.heights, (sigma / dy, sigma / dx), mode=mode, truncate=_REACH)
    return scan.after(heights, f"Gaussian S-filter (ISO 16610-61) with a nesting index of {settings.cutoff:.6g} m")


def treat_edges(scan: Scan, square: Scan, settings: Preparation) -> tuple[Surface, list[str]]:
    """Treat the edges as `boundary` requires, and change the grid; return the surface and descriptions of all steps.

    square : the square before its preparation, for a message about outliers.
    """
    nodes = settings.grid or (2 if settings.boundary == MIRROR else 1) * max(scan.heights.shape)
    try:
        # Resampling copies the heights.
        require_room(3 * 8 * nodes**2)
    except TooLarge as error:
        raise UnfitTopography(f"gives a surface of {nodes} x {nodes} points, which {error}", "grid") from None
    heights, side, free = scan.heights - np.mean(scan.heights), scan.size[0], settings.boundary == FREE
    steps = list(scan.steps)
    if settings.boundary == WINDOW:
        # Tukey's window at the centres of the pixels: half a cosine wave at each edge, and the value 1 between them.
        centres = [(np.arange(n) + 0.5) / n for n in heights.shape]
        edges = [np.minimum(np.minimum(x, 1 - x) / settings.taper, 1.0) for x in centres]
        across, along = (np.sin(0.5 * np.pi * edge) ** 2 for edge in edges)
        heights = heights * across[:, None] * along
        steps.append(f"heights fall to their mean on {settings.taper:g} of the side at every edge")
    if settings.boundary == MIRROR:
        heights, side = np.pad(heights, [(0, n) for n in heights.shape], mode="symmetric"), 2 * side
        steps.append("joined by its mirror images")
    # Periodic scans may still have pixels that are not square.
    grid = settings.grid or max(heights.shape)
    if heights.shape != (grid, grid):
        heights = _resampled(heights, grid, free=free)
        steps.append(f"resampled to {grid} x {grid} points")
    steps.append("one square on a free half-space" if free else f"repeats after {side:.6g} m")
    try:
        return Surface(heights, side, FREE if free else PERIODIC), steps
    except ValueError as error:  # the range of heights, divided by the side, is out of bounds
        outliers, largest = find_outliers(square.heights)
        if settings.outliers == "keep" and outliers.any():
            row, column = (int(each[0]) + 1 for each in np.nonzero(outliers))
            raise UnfitTopography(
                f"keeps {np.count_nonzero(outliers)} points that stand out by up to {largest:.3g} rms heights, the "
                f"first in row {row}, column {column} of the square, and contact models do not accept such heights; "
                "expected remove, or a crop without these points",
                "outliers",
            ) from None
        raise UnfitTopography(
            f"gives heights that contact models do not accept ({error}); expected another unit", "height_unit"
        ) from None


def _resampled(heights, grid, *, free):
    """Resample heights to grid x grid points by Fourier series, or by cosine series for a free square."""
    # Slow to import, and rarely needed.
    from scipy.signal import resample

    for axis in (0, 1):
        n = heights.shape[axis]
        if n == grid:
            continue
        heights = _by_cosine_series(heights, axis, n / grid, grid) if free else resample(heights, grid, axis=axis)
    return heights
