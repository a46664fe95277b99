"""Readers of arrays with or without their units: npy, netCDF and HDF5."""

import math
from pathlib import Path

import numpy as np

from icha.support.input_files import require_room
from icha.surfaces.measured.found import Found, chosen_name, metres_of, regular_ticks, with_y_first
from icha.surfaces.measured.settings import Preparation, UnfitTopography

# Copies of an array, as floats, that are held while it is read.
_COPIES = 3


def read_npy(path: Path, how: Preparation) -> Found:
    """An array of NumPy's, without names or units."""
    return Found(with_y_first(whole_npy(path), how))


def whole_npy(path: Path) -> np.ndarray:
    """The array of a file of NumPy's."""
    # Mapped, no more is declared than is there; of what overflows NumPy warns before it refuses it.
    with np.errstate(over="ignore"):
        array = np.lib.format.open_memmap(path, mode="r")
    _require_room(array)
    return np.array(array)


def whole_variable(variable) -> np.ndarray:
    """The numbers of a netCDF variable as floats, nan where they are missing."""
    _require_room(variable)
    return np.ma.filled(variable[...].astype(float), np.nan)


def _require_room(declared):
    """Refuse an array by what is declared of it, before it is read; on the way to heights it is copied."""
    require_room(_COPIES * 8 * math.prod(declared.shape))


def read_netcdf(path: Path, how: Preparation) -> Found:
    """The variable `data`, `height`, `heights`, `z` or the only one of two dimensions, with its units and axes."""
    import netCDF4

    with netCDF4.Dataset(path) as file:
        plane = [name for name, variable in file.variables.items() if variable.ndim == 2]
        chosen = file[chosen_name(how.data, plane, ("height", "heights", "z"), "variable")]
        if chosen.ndim != 2:
            raise UnfitTopography(
                "data", f"has {chosen.ndim} dimensions; allowed: {', '.join(plane) or 'none is there'}"
            )
        heights = whole_variable(chosen)
        names = [name.lower() for name in chosen.dimensions]
        turned = names[0] == "x" if set(names) == {"x", "y"} else how.first_axis == "x"
        sides = []
        for axis, name in enumerate(chosen.dimensions):
            side, backwards = _side(file.variables.get(name), heights.shape[axis])
            sides.append(side)
            if backwards:
                heights = np.flip(heights, axis)
        unit = _unit_of(chosen.__dict__)
    along_y, along_x = sides[::-1] if turned else sides
    size = (along_x, along_y) if along_x and along_y else None
    return Found(heights.T if turned else heights, unit, size)


def _side(coordinate, count):
    """Length of a side in m, None if the file does not say it, and whether its coordinate falls."""
    if coordinate is None or coordinate.ndim != 1:
        return None, False
    about, unit = coordinate.__dict__, _unit_of(coordinate.__dict__)
    values = whole_variable(coordinate)
    if unit is not None and "length" in about:
        return float(about["length"]) * unit, False
    if count < 2:
        return None, False
    _, ticks, step = regular_ticks(values, coordinate.name)
    if ticks != count:
        raise ValueError(f"{coordinate.name} is not on a regular grid")
    return (count * step * unit if unit is not None else None), values[0] > values[-1]


def read_hdf5(path: Path, how: Preparation) -> Found:
    """The dataset `data`, or the only one of two dimensions; its attribute `units` or `unit`, if there is one."""
    import h5py

    with h5py.File(path) as file:
        plane = []
        file.visititems(
            lambda name, node: (
                plane.append(name)
                if isinstance(node, h5py.Dataset) and node.ndim == 2 and node.dtype.kind in "iuf"
                else None
            )
        )
        asked = how.data.strip("/") if how.data else None
        chosen = file[chosen_name(asked, sorted(plane), (), "dataset")]
        _require_room(chosen)
        return Found(with_y_first(chosen[...], how), _unit_of(dict(chosen.attrs)))


def _unit_of(attributes):
    """Metres of the unit that a variable's attributes name; None if they do not, or not of a length."""
    text = attributes.get("units", attributes.get("unit"))
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    return None if text is None else metres_of(text)
