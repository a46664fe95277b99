"""Measured topographies: reading what instruments and people write, and preparing it for the model.

A measurement becomes a surface in this order: heights and lengths in metres, the side that touches first up, a square
cut out, the trend removed, missing points filled, edges made what the boundary asks for, and the grid changed.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import scipy.fft

from icha.surface import FREE, PERIODIC, Surface
from icha.validation import flaw_of_heights

# How the edges of a measurement are treated; `FREE` is the one that does not end in a periodic surface.
WINDOW, MIRROR = "window", "mirror"


class UnfitTopography(ValueError):
    """A file that is no topography or cannot be prepared as asked; `key` is the key of the settings that is at fault."""

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
    raise NotImplementedError


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
    raise NotImplementedError
