"""Settings of a measured topography: what the numbers of its file mean, and how they become a surface."""

from collections.abc import Mapping
from dataclasses import dataclass

# How edges are treated, beside `periodic` and `free` (`icha.surfaces.surface`); both end in a periodic surface.
WINDOW, MIRROR = "window", "mirror"


# What is wrong with a file of one profile.
LINE_SCAN = "is a line scan, one profile of {} points; allowed: a topography, with heights over x and y"


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
    cutoff : nesting index of the S-filter, m; None: no filter.
    taper : with a window, the part of the side over which heights fall at each edge.
    grid : nodes along a side of the result; None: as the scan.
    columns : numbers, from 1, of the columns x, y and z of a text; None: it has just these.
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
    cutoff: float | None = None
    taper: float | None = None
    grid: int | None = None
    columns: tuple[int, int, int] | None = None
