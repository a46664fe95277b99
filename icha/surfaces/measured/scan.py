"""A scan in metres: what a file of any format says, with units and size."""

import importlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from icha.support import formatting
from icha.support.formatting import printable
from icha.support.input_files import RefusedFile, bounded_memory, refuse_traps
from icha.support.rules import LENGTH
from icha.surfaces.measured.array_files import format_of_hdf5, read_hdf5, read_instrument, read_netcdf, read_npy
from icha.surfaces.measured.settings import LINE_SCAN, Preparation, UnfitTopography
from icha.surfaces.measured.text_files import format_of_text, read_fourier, read_matrix, read_xyz
from icha.surfaces.measured.text_tables import SourceFile, reason_against_table

READERS = {
    "npy": read_npy,
    "netcdf": read_netcdf,
    "matrix": read_matrix,
    "xyz": read_xyz,
    "hdf5": read_hdf5,
    "fourier": read_fourier,
    "instrument": read_instrument,
}
# Libraries of the readers that have one. They are imported before memory is bounded: theirs is not the file's.
_LIBRARIES = {"netcdf": "netCDF4", "hdf5": "h5py", "instrument": "SurfaceTopography"}


@dataclass(frozen=True, eq=False)
class Scan:
    """What a file says in metres: heights (ny, nx), nan where missing, first axis y, and the size (x, y) of it all.

    coordinate_unit: metres, where the size follows from coordinates whose unit the file does not tell. format: as
    which the file was read. data: name of the array or channel that was taken, empty if the file has only one. steps:
    what was read and done, in words.
    """

    heights: np.ndarray
    size: tuple[float, float]
    steps: tuple[str, ...] = ()
    coordinate_unit: float | None = None
    format: str = ""
    data: str = ""

    @property
    def pixel(self) -> tuple[float, float]:
        """Distance of neighbouring nodes along x and along y, m."""
        rows, columns = self.heights.shape
        return self.size[0] / columns, self.size[1] / rows

    def after(self, heights: np.ndarray, *said: str, size: tuple[float, float] | None = None) -> "Scan":
        """The scan with other heights after a step, what is to be said about it, and another size if it has one."""
        return replace(self, heights=heights, size=size or self.size, steps=(*self.steps, *said))

    @property
    def remark_on_unit(self) -> str:
        """What is to be added where a length of the scan is at fault."""
        if self.coordinate_unit is None:
            return ""
        unit = formatting.length(self.coordinate_unit)
        return f"; the coordinates are taken to be in units of {unit}, see `lateral_unit`"


def load_scan(path: Path, how: Preparation) -> Scan:
    """Read a file of any of the formats; errors as `icha.surfaces.measured.topography.prepared_topography`."""
    if not path.stat().st_size:
        raise UnfitTopography("path", "is empty; allowed: a file of heights")
    name, found = _read(path, how)
    unit = how.height_unit or found.unit
    if unit is None:
        raise UnfitTopography("height_unit", "is missing, and the file does not say it; allowed: such as 'um'")
    size, coordinate_unit = how.size or found.size, None
    if size is None and found.coordinates is not None:
        coordinate_unit = how.lateral_unit or unit
        size = tuple(each * coordinate_unit for each in found.coordinates)
    if size is None:
        raise UnfitTopography("size", "is missing, and the file does not say it; allowed: a length, such as '90 um'")
    rows, columns = found.heights.shape
    said = f"{name}, {rows} rows x {columns} columns of points"
    if found.data:
        said += f", data {printable(found.data)} of several"
    sides = [formatting.length(float(side)) for side in size]
    pixel = [formatting.length(size[0] / columns), formatting.length(size[1] / rows)]
    said += f"; pixels of {' x '.join(pixel)}, {' x '.join(sides)} in all; heights in {formatting.length(unit)}"
    said += "".join(f"; {remark}" for remark in (found.remark, _replaced(how, found)) if remark)
    format_ = f"{name} ({found.format})" if name == "instrument" else name
    scan = Scan(found.heights.astype(float) * unit, tuple(size), (said,), coordinate_unit, format_, found.data)
    if not all(np.isfinite(each) and LENGTH.contains(each) for each in size):
        raise UnfitTopography(
            "size", f"is {size[0]:g} m by {size[1]:g} m in the file{scan.remark_on_unit}; allowed: give it here"
        )
    return scan


def _replaced(how, found):
    """Say which size and unit of the file are not used, because others are given; empty if there are none."""
    replaced = []
    if how.size and found.size and not np.allclose(how.size, found.size, rtol=1e-3, atol=0):
        replaced.append(f"its size {' x '.join(map(formatting.length, found.size))}")
    if how.height_unit and found.unit and not np.isclose(how.height_unit, found.unit, rtol=1e-3, atol=0):
        replaced.append(f"its unit of heights {formatting.length(found.unit)}")
    return f"the file has, and you replace, {' and '.join(replaced)}" if replaced else ""


def _read(path, how):
    """The format of a file, and what its reader finds, if that are heights."""
    file, name = SourceFile(path, how.data), how.format
    try:
        with bounded_memory():
            refuse_traps(path)
            if name == "auto":
                name = "xyz" if how.columns else _format_of(path)
            library = _LIBRARIES.get(name)
            if name in ("text", "matrix") and (file.layout is None or file.layout.heading):
                library = "SurfaceTopography"
        if library is not None:
            importlib.import_module(library)
        with bounded_memory():
            if name == "text":
                name = format_of_text(file) or "instrument"
                if name == "instrument" and file.instrument is None and (reason := reason_against_table(path)):
                    raise UnfitTopography("path", reason)
            found = READERS[name](file, how)
    except UnfitTopography:
        raise
    except RefusedFile as error:
        raise UnfitTopography("path", str(error)) from None
    except Exception as error:  # whatever the libraries raise for files that are damaged or of another kind
        raise UnfitTopography(
            "path",
            f"cannot be read as {name}{_own_reason(error)}: the file is damaged or of another format; allowed: a file "
            "that is, or another `format`",
        ) from None
    if how.data is not None and not found.data_known:
        raise UnfitTopography(
            "data", f"is given, and a file that is read as {name} has one array without a name; allowed: leave it out"
        )
    heights = found.heights
    if heights.dtype.kind not in "iuf":
        raise UnfitTopography("path", f"holds {heights.dtype}, not real numbers; allowed: heights")
    if heights.ndim == 1 or (heights.ndim == 2 and 0 < min(heights.shape) <= 2 < max(heights.shape)):
        # Two columns are x and z.
        raise UnfitTopography("path", LINE_SCAN.format(max(heights.shape)))
    if heights.ndim != 2 or not heights.size:
        nothing = "" if heights.size else ", no heights"
        raise UnfitTopography(
            "path", f"holds an array of shape {heights.shape}{nothing}; allowed: rows and columns of heights"
        )
    return name, found


def _own_reason(error):
    """The reason in brackets if this package raised the error itself; libraries speak to programmers."""
    trace = error.__traceback__
    while trace.tb_next is not None:
        trace = trace.tb_next
    own = type(error) is ValueError and trace.tb_frame.f_globals.get("__name__", "").startswith("icha.")
    return f" ({error})" if own else ""


def _format_of(path: Path) -> str:
    """The format that a file has by its name or, if it is HDF5, by what is in it; else "text", which may be others."""
    suffix = path.suffix.lower()
    known = {".npy": "npy", ".nc": "netcdf", ".nc4": "netcdf", ".h5": "hdf5", ".hdf5": "hdf5", ".xyz": "xyz"}
    if suffix in known:
        return known[suffix]
    if (hdf5 := format_of_hdf5(path)) is not None:
        return hdf5
    return "xyz" if path.name.lower().endswith(".xyz.gz") else "text"
