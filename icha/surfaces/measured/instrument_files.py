"""Reader of the formats of instruments: whatever SurfaceTopography reads."""

from pathlib import Path

import numpy as np

from icha.surfaces.measured.array_files import maps_among
from icha.surfaces.measured.found import Found, chosen_name, metres_of
from icha.surfaces.measured.settings import LINE_SCAN, Preparation, UnfitTopography

# Formats in which any bytes of the right number are heights: there it is the ending of the name that tells.
_WITHOUT_SIGNATURE = ("hgt", "nms")
# Formats of arrays that say nothing about themselves.
_ARRAYS = ("mat", "npz")
_UNKNOWN = (
    "cannot be read as instrument: the file is of none of the formats of instruments that are known here, or damaged; "
    "allowed: another `format`, or an export of the heights as text"
)


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
    except Exception:  # a damaged file of a format that it knows; reading it gives the message
        return True


def read_instrument(path: Path, how: Preparation) -> Found:
    """Whatever SurfaceTopography reads. Its arrays have x as first axis."""
    from SurfaceTopography import open_topography
    from SurfaceTopography.Exceptions import CannotDetectFileFormat

    try:
        opened = open_topography(str(path))
    except CannotDetectFileFormat:  # its message lists what every reader says
        raise UnfitTopography("path", _UNKNOWN) from None
    with opened as file:
        if file.format() in _WITHOUT_SIGNATURE and path.suffix.lower().removeprefix(".") not in file.file_extensions():
            raise UnfitTopography("path", _UNKNOWN)
        name = file.name()
        names = [channel.name for channel in file.channels]
        maps = maps_among({f"{k}": tuple(channel.nb_grid_pts) for k, channel in enumerate(file.channels)})
        maps = [file.channels[int(k)] for k in maps]
        if how.data is not None:
            channel = file.channels[names.index(chosen_name(how.data, names, (), "channel"))]
        elif file.format() in _ARRAYS and maps:
            # Arrays of a workspace have no default: whichever came first would be pressed.
            channel = file.channels[names.index(chosen_name(None, [each.name for each in maps], (), "array"))]
        else:
            channel = file.default_channel
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
        data = channel.name if len(maps) > 1 else ""
    if sides is not None and (lateral := how.lateral_unit or unit) is not None:
        return Found(heights, unit, tuple(side * lateral for side in sides), format=name, data=data)
    return Found(heights, unit, coordinates=sides, format=name, data=data)
