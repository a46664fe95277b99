"""Reader of the formats of instruments: whatever SurfaceTopography reads."""

from pathlib import Path

import numpy as np

from icha.surfaces.measured.found import Found, chosen_name, metres_of
from icha.surfaces.measured.settings import LINE_SCAN, Preparation, UnfitTopography

# Formats in which any bytes of the right number are heights: there it is the ending of the name that tells.
_WITHOUT_SIGNATURE = ("hgt", "nms")


# Formats that are no evidence of an instrument: of any text with numbers, of which other fields are dropped, and
# of any file of a certain length.
_OF_ANY_TEXT = ("asc", *_WITHOUT_SIGNATURE)


def is_instrument_text(path: Path) -> bool:
    """Whether SurfaceTopography knows the format of a text file, as one of a certain instrument."""
    from SurfaceTopography import open_topography
    from SurfaceTopography.Exceptions import CannotDetectFileFormat

    try:
        with open_topography(str(path)) as file:
            return file.format() not in _OF_ANY_TEXT
    except CannotDetectFileFormat:
        return False


def read_instrument(path: Path, how: Preparation) -> Found:
    """Whatever SurfaceTopography reads. Its arrays have x as first axis."""
    from SurfaceTopography import open_topography
    from SurfaceTopography.Exceptions import CannotDetectFileFormat

    try:
        opened = open_topography(str(path))
    except CannotDetectFileFormat:  # its message lists what every reader says
        raise ValueError("none of the formats that SurfaceTopography knows") from None
    with opened as file:
        if file.format() in _WITHOUT_SIGNATURE and path.suffix.lower().removeprefix(".") not in file.file_extensions():
            raise ValueError("none of the formats that SurfaceTopography knows by more than the length of a file")
        name = file.name()
        names = [channel.name for channel in file.channels]
        if how.data is None:
            channel = file.default_channel
        else:
            channel = file.channels[names.index(chosen_name(how.data, names, (), "channel"))]
        if channel.dim != 2:
            areal = [each.name for each in file.channels if each.dim == 2]
            if not areal:
                raise UnfitTopography("path", LINE_SCAN.format(max(channel.nb_grid_pts)))
            raise UnfitTopography("data", f"is a line scan; allowed: a topography, of {', '.join(areal)}")
        said = channel.physical_sizes
        topography = channel.topography(**({"physical_sizes": (1.0, 1.0)} if said is None else {}))
        heights = np.ma.filled(np.ma.asarray(topography.heights()).astype(float), np.nan).T
        unit = None if topography.unit is None else metres_of(topography.unit)
        sides = None if said is None else tuple(float(side) for side in topography.physical_sizes)
    if sides is not None and (lateral := how.lateral_unit or unit) is not None:
        return Found(heights, unit, tuple(side * lateral for side in sides), format=name)
    return Found(heights, unit, coordinates=sides, format=name)
