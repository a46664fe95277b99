"""Measured topographies: from a file to a surface.

A measurement becomes a surface in this order: heights and lengths in metres (`scan`, by the readers of `text_files` and
`array_files`), the side that touches first up, and the steps of `steps`: a square cut out, the trend removed, missing
points filled, pixels made square, short waves taken out, edges made what the boundary asks for, the grid changed.

SurfaceTopography, which reads what instruments write, could remove trends and fill holes, too. It takes seconds to
import, which every look at a configuration with a measured surface would cost, and has neither the cosine series of a
free square nor windows of cells.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from icha.support.checksums import sha256_of
from icha.support.input_files import problem_with_path
from icha.surfaces.measured.scan import load_scan
from icha.surfaces.measured.settings import Preparation, UnfitTopography
from icha.surfaces.measured.steps import bounded, cropped, detrended, filled, refuse_flat, squared, without_short_waves
from icha.surfaces.surface import Surface


@dataclass(frozen=True, eq=False)
class PreparedTopography:
    """A surface at its own heights, and what was done to the file to get it.

    format : as which the file was read. data : the array or channel that was taken, empty if the file has only one.
    reading : points, pixels and units of the file and what was left out of it, in words.
    filled : number of points that had no height. points : number of points that were used.
    """

    surface: Surface
    source_file: str
    source_sha256: str
    description: str
    format: str
    data: str
    reading: str
    filled: int
    points: int

    @property
    def rms_slope(self) -> float:
        """Root mean square slope of the surface as prepared."""
        return self.surface.rms_slope


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
    file, how = _existing(path), Preparation(**preparation)
    scan = load_scan(file, how)
    touching = scan.heights if how.touches_first == "high" else -scan.heights
    part = cropped(scan.after(touching, f"{how.touches_first} numbers touch first"), how)
    missing, left = int(np.count_nonzero(~np.isfinite(part.heights))), part
    for step in (detrended, filled, squared, without_short_waves):
        left = step(left, how)
    refuse_flat(left, part, how)
    surface, steps = bounded(left, how)
    return PreparedTopography(
        surface=surface,
        source_file=file.name,
        source_sha256=sha256_of(file),
        description="; ".join(steps),
        format=scan.format,
        data=scan.data,
        reading="; ".join([scan.steps[0], *(step for step in steps if "resampled" in step)]),
        filled=missing,
        points=part.heights.size,
    )


@dataclass(frozen=True)
class TopographyFacts:
    """What a plan needs to know of a measured surface and its file.

    Parameters
    ----------
    grid : nodes a side.
    period : side of the square, m.
    rms_slope : of the prepared surface.
    boundary : "periodic" or "free".
    source_sha256 : checksum of the file.
    full_contact_energy : U_full/E* of the surface at rms slope 1, m.
    """

    grid: int
    period: float
    rms_slope: float
    boundary: str
    source_sha256: str
    full_contact_energy: float


def topography_facts(path: str | os.PathLike, preparation: Mapping) -> TopographyFacts:
    """Facts of the prepared surface; arguments and errors as `prepared_topography`. Known ones cost nothing."""
    stat = _existing(path).stat()
    return _facts(os.fspath(path), stat.st_mtime_ns, stat.st_size, json.dumps(preparation, sort_keys=True))


@lru_cache(maxsize=256)
def _facts(path, modified, size, preparation):
    prepared = prepared_topography(path, json.loads(preparation))
    surface = prepared.surface
    energy = surface.full_contact_energy / surface.rms_slope**2
    own = surface.grid, surface.period, surface.rms_slope, surface.boundary
    return TopographyFacts(*own, prepared.source_sha256, energy)


def _existing(path):
    path = Path(path)
    if problem := problem_with_path(path):
        raise UnfitTopography("path", f"{problem}; allowed: a file of heights")
    return path
