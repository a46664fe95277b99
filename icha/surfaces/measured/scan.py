"""Read a scan from a file of any supported format: heights and size in metres."""

import importlib
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from icha.support import formatting
from icha.support.formatting import printable
from icha.support.input_files import RefusedFile, bounded_memory, problem_with_path, refuse_traps
from icha.support.rules import LENGTH
from icha.surfaces.measured.array_files import (
    guess_format,
    read_hdf5,
    read_instrument,
    read_matlab,
    read_netcdf,
    read_npy,
    read_npz,
)
from icha.surfaces.measured.settings import LINE_SCAN, Preparation, UnfitTopography
from icha.surfaces.measured.text_files import format_of_text, read_matrix, read_xyz
from icha.surfaces.measured.text_tables import SourceFile

# Reader of each format, and its library if the arrays of a file have names. A library is imported before the memory is
# limited, so its own memory does not count.
READERS = {
    "npy": (read_npy, None),
    "npz": (read_npz, "numpy"),
    "matlab": (read_matlab, "scipy.io"),
    "netcdf": (read_netcdf, "netCDF4"),
    "matrix": (read_matrix, None),
    "xyz": (read_xyz, None),
    "hdf5": (read_hdf5, "h5py"),
    "instrument": (read_instrument, "SurfaceTopography"),
}
# Largest relative difference of the proportions of a scan by its size and by its coordinates.
_PROPORTIONS = 1e-2


@dataclass(frozen=True, eq=False)
class Scan:
    """Heights and size of a scan, m, and the steps of its preparation.

    Attributes
    ----------
    heights : (ny, nx) array, m, nan where missing; the first axis is y.
    size : sides (x, y) of the whole scan, m.
    steps : descriptions of how the file was read and of the later steps.
    format : format with which the file was read.
    data : name of the array or channel that was read; empty if the file has only one.
    """

    heights: np.ndarray
    size: tuple[float, float]
    steps: tuple[str, ...] = ()
    format: str = ""
    data: str = ""

    @property
    def pixel(self) -> tuple[float, float]:
        """Distances (x, y) between neighbouring nodes, m."""
        rows, columns = self.heights.shape
        return self.size[0] / columns, self.size[1] / rows

    def after(self, heights: np.ndarray, *steps: str, size: tuple[float, float] | None = None) -> "Scan":
        """Return the scan after a step: new heights, added descriptions `steps`, and the new size (m) if given."""
        return replace(self, heights=heights, size=size or self.size, steps=(*self.steps, *steps))


def load_scan(path: Path, settings: Preparation) -> Scan:
    """Read the scan in a file of any supported format; raises UnfitTopography if the file or a setting does not fit."""
    if problem := problem_with_path(path) or ("" if path.stat().st_size else "is empty"):
        raise UnfitTopography(f"{problem}; expected a file of heights")
    name, found = _read(path, settings)
    unit = settings.height_unit or found.unit
    if unit is None:
        raise _missing("height_unit", "the unit of the heights in a known form; expected a unit such as 'um'")
    rows, columns = found.heights.shape
    size = settings.size or found.size
    if settings.size is not None:
        x, y = size = settings.size[0], settings.size[-1]
        square, exchanged = (math.isclose(a * rows, b * columns, rel_tol=_PROPORTIONS) for a, b in ((x, y), (y, x)))
        one_length = len(settings.size) == 1 and rows != columns
        if found.coordinates is None and (one_length or (exchanged and not square)):
            lengths = ", ".join(map(formatting.length, (y, x) if exchanged else (x, x * rows / columns)))
            raise UnfitTopography(
                f"makes pixels of {formatting.length(x / columns)} x {formatting.length(y / rows)}; expected two "
                f"lengths along x and y, [{lengths}] for square pixels, or the other `first_axis`",
                "size",
            )
    if size is None and found.coordinates is not None:
        if settings.lateral_unit is None:
            raise _missing(
                "lateral_unit",
                "the unit of its coordinates in a known form; expected a unit such as 'um', or the `size` of the scan",
            )
        size = tuple(each * settings.lateral_unit for each in found.coordinates)
    elif found.coordinates is not None and not np.isclose(
        size[0] * found.coordinates[1], size[1] * found.coordinates[0], rtol=_PROPORTIONS, atol=0
    ):
        raise UnfitTopography(
            "does not have the proportions {:.4g} : {:.4g} of the coordinates; expected two lengths along x and y, or "
            "the key `lateral_unit` instead".format(*found.coordinates),
            "size",
        )
    if size is None:
        raise _missing("size", "the size of the scan in a known form; expected a length such as '90 um'")
    replaced = []
    if settings.size and found.size and not np.allclose(size, found.size, rtol=1e-3, atol=0):
        replaced.append(f"the size {' x '.join(map(formatting.length, found.size))}")
    if settings.height_unit and found.unit and not np.isclose(settings.height_unit, found.unit, rtol=1e-3, atol=0):
        replaced.append(f"the unit of heights {formatting.length(found.unit)}")
    pixel = f"{formatting.length(size[0] / columns)} x {formatting.length(size[1] / rows)}"
    reading = [
        f"{name}, {rows} rows x {columns} columns of points"
        + (f", data {printable(found.data)} of several" if found.data else ""),
        f"pixels of {pixel}, {' x '.join(formatting.length(float(side)) for side in size)} in all",
        f"heights in {formatting.length(unit)}",
        found.remark,
        f"the settings replace {' and '.join(replaced)} of the file" if replaced else "",
    ]
    format_ = f"{name} ({found.format})" if name == "instrument" else name
    steps = ("; ".join(filter(None, reading)),)
    heights = found.heights.astype(float) * unit
    heights[np.isinf(heights)] = np.nan
    scan = Scan(heights, tuple(size), steps, format_, found.data)
    if not all(np.isfinite(each) and LENGTH.contains(each) for each in size):
        raise UnfitTopography(f"is {size[0]:g} m by {size[1]:g} m in the file; expected the size in this key", "size")
    return scan


def _missing(key, value):
    """Return the error for a missing key, whose value the file does not contain either."""
    return UnfitTopography(f"is missing, and the file does not contain {value}", key)


def read_height_map(path: str | Path, metres_per_unit: float) -> np.ndarray:
    """Read the heights (m) of a surface of kind `file`: (ny, nx) array; raise UnfitTopography if there are no heights.

    The file is a `.npy` file, or a netCDF file with a variable `height`.
    """
    path = Path(path)
    kind, data = ("netcdf", "height") if path.suffix == ".nc" else ("npy", None)
    # The size here has no effect: the configuration contains the size as `period`.
    return load_scan(path, Preparation(kind, "periodic", data, height_unit=metres_per_unit, size=(1.0, 1.0))).heights


def _read(path, settings):
    """Return the format of a file and its content; raise UnfitTopography if the file has no heights."""
    file, name = SourceFile(path), settings.format
    try:
        with bounded_memory():
            refuse_traps(path)
            if name == "auto":
                name = "xyz" if settings.columns else guess_format(path)
            library = None if name == "text" else READERS[name][1]
            if name in ("text", "matrix") and (file.layout is None or file.layout.heading):
                library = "SurfaceTopography"
        if library is not None:
            importlib.import_module(library)
        with bounded_memory():
            if name == "text":
                name = format_of_text(file)
            found = READERS[name][0](file, settings)
    except UnfitTopography:
        raise
    except RefusedFile as error:
        raise UnfitTopography(str(error)) from None
    except Exception:  # libraries raise many types of errors for files that are damaged or of another format
        as_format = "" if name in ("auto", "text") else f" as {name}"
        raise UnfitTopography(
            f"cannot be read{as_format}: the file is damaged or of another format; expected a sound file, or another "
            "`format`"
        ) from None
    if settings.data is not None and READERS[name][1] is None:
        raise UnfitTopography(
            f"is given, but a file of format {name} has one array without a name. Remove the key", "data"
        )
    heights = found.heights
    if heights.dtype.kind not in "iuf":
        raise UnfitTopography(f"contains {heights.dtype}, not real numbers; expected heights")
    if heights.ndim == 1 or (heights.ndim == 2 and 0 < min(heights.shape) <= 2 < max(heights.shape)):
        # An array of two columns contains x and z of a profile.
        raise UnfitTopography(LINE_SCAN.format(max(heights.shape)))
    if heights.ndim == 2 and min(heights.shape) == 3 < max(heights.shape) and found.size is None:
        raise UnfitTopography(
            f"has an array of shape {heights.shape}, which seems to be points x y z; expected rows and columns of "
            "heights, or `format: xyz` and a text file with x, y and z in every line (`numpy.savetxt`)"
        )
    if heights.ndim != 2 or not heights.size:
        raise UnfitTopography(f"has an array of shape {heights.shape}; expected rows and columns of heights")
    if found.first_axis == "y" and settings.first_axis == "x":
        raise UnfitTopography("is x, but the file states which of its axes is x. Remove the key", "first_axis")
    if "x" in (found.first_axis, settings.first_axis):
        sides = {name: getattr(found, name) and getattr(found, name)[::-1] for name in ("size", "coordinates")}
        found = replace(found, heights=heights.T, **sides)
    return name, found
