"""Measured topographies: from a file to a surface.

A measurement becomes a surface in this order: read heights and lengths in metres (`scan`), turn the side that touches
first upwards, then apply the functions in `steps`: cut out a square, remove the trend, fill missing points, make pixels
square, filter short waves, treat the edges as the boundary requires, change the grid.

SurfaceTopography reads the files of instruments. It could also remove trends and fill holes, but its import takes
seconds, which every command with a measured surface would need.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from icha.support.checksums import sha256_of
from icha.surfaces.measured.scan import load_scan
from icha.surfaces.measured.settings import Preparation
from icha.surfaces.measured.steps import (
    crop_square,
    fill_missing_points,
    filter_short_waves,
    refuse_flat,
    remove_trend,
    resample_to_square_pixels,
    treat_edges,
)
from icha.surfaces.surface import Surface


@dataclass(frozen=True, eq=False)
class PreparedTopography:
    """A surface at its own heights, and the record of its preparation from a file.

    Attributes
    ----------
    source_file, source_sha256 : name and checksum of the file.
    description : all steps from the file to the surface, for readers.
    format : format as which the file was read.
    data : name of the array or channel that was read; empty if the file has only one.
    reading : points, pixels and units of the file, and parts of the file that were left out, for readers.
    filled : number of points that had no height.
    points : number of points that were used.
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
    """Read a topography and prepare the surface that the settings describe.

    Parameters
    ----------
    path : the file.
    preparation : arguments of `Preparation`, as `MeasuredSurface.preparation` gives them.

    Raises
    ------
    UnfitTopography
        A ValueError with the setting that does not fit the file (its attribute `key`), the reason, and the expectation.
    """
    file, settings = Path(path), Preparation(**preparation)
    scan = load_scan(file, settings)
    touching = scan.heights if settings.touches_first == "high" else -scan.heights
    square = crop_square(scan.after(touching, f"{settings.touches_first} numbers touch first"), settings)
    prepared = square
    for step in (remove_trend, fill_missing_points, resample_to_square_pixels, filter_short_waves):
        prepared = step(prepared, settings)
    refuse_flat(prepared, square, settings)
    surface, steps = treat_edges(prepared, settings)
    return PreparedTopography(
        surface=surface,
        source_file=file.name,
        source_sha256=sha256_of(file),
        description="; ".join(steps),
        format=scan.format,
        data=scan.data,
        reading="; ".join([scan.steps[0], *(step for step in steps if "resampled" in step)]),
        filled=int(np.count_nonzero(~np.isfinite(square.heights))),
        points=square.heights.size,
    )
