"""Labelled arrays as variables of a netCDF-4 file: the conventions that all files here share, and quickly.

Files of runs hold many small variables. All of a file are defined before the first is written: the library goes
through them all whenever it turns from one to the other.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping
from typing import TYPE_CHECKING

import netCDF4
import numpy as np

from icha.datasets.variables.terms import INFINITE

if TYPE_CHECKING:
    import xarray as xr

FLOAT_FILL = 9.969209968386869e36
INTEGER_FILL = -(2**31) + 1
# How xarray marks text that is kept as characters. Every netCDF tool reads those, and they compress, unlike strings of
# variable length.
TEXT = {"_Encoding": "utf-8"}


def is_text(dtype: np.dtype) -> bool:
    """Whether an array of this type holds text."""
    return dtype.kind in "OUTS"


def characters(texts: np.ndarray) -> np.ndarray:
    """Texts as characters along a further, last dimension, as many as the longest text has (UTF-8), at least one."""
    texts = np.asarray(texts)
    encoded = np.ascontiguousarray(np.char.encode(texts.astype("U"), "utf-8"))
    return encoded.view("S1").reshape(*texts.shape, max(encoded.dtype.itemsize, 1))


def define_dimensions(group: netCDF4.Dataset, sizes: Mapping[Hashable, int]) -> None:
    """Make the dimensions of a group."""
    for name, size in sizes.items():
        group.createDimension(name, size)


def define_text(
    group: netCDF4.Dataset, name: str, dims: tuple[str, ...], width: int, attrs: Mapping, **storage
) -> netCDF4.Variable:
    """Make a variable of texts of at most `width` bytes, kept as characters."""
    along = f"string{width}"
    if along not in group.dimensions:
        group.createDimension(along, width)
    return _define(group, name, "S1", (*dims, along), {**attrs, **TEXT}, storage)


def define_numbers(
    group: netCDF4.Dataset, name: str, dims: tuple[str, ...], dtype: np.dtype, attrs: Mapping, **storage
) -> netCDF4.Variable:
    """Make a variable of numbers; `storage` as `netCDF4.Dataset.createVariable` takes it."""
    return _define(group, name, dtype, dims, attrs, storage)


def _define(group, name, dtype, dims, attrs, storage):
    variable = group.createVariable(name, dtype, dims, **storage)
    variable.setncatts(dict(attrs))
    # Values are written, and read, as they are.
    variable.set_auto_maskandscale(False)
    variable.set_auto_chartostring(False)
    return variable


def is_refused(values: np.ndarray, attrs: Mapping[str, object]) -> np.ndarray:
    """Which numbers of a variable are not finite, but for infinite ones where its attributes allow them."""
    refused = ~np.isfinite(values)
    return refused & ~np.isposinf(values) if INFINITE in attrs else refused


def not_finite(name: Hashable, dims: tuple[Hashable, ...], bad: np.ndarray) -> str:
    """Name of a variable, how many of its values are not finite, and where the first is; `bad` says which are not."""
    first = ", ".join(f"{dim}={index}" for dim, index in zip(dims, np.argwhere(bad)[0], strict=True))
    text = f"{name!r} holds {np.count_nonzero(bad)} of {bad.size} values that are not finite"
    return f"{text}, the first at {first}" if first else text


def coordinates_of(
    variables: Mapping[Hashable, xr.Variable],
    coordinates: Collection[Hashable],
    dims: Mapping[Hashable, tuple[Hashable, ...]] = {},
) -> dict[Hashable, str]:
    """The attribute `coordinates` (CF) of each variable that has coordinates besides those of its dimensions.

    Parameters
    ----------
    variables : all of a group, by name. Bounds of coordinates have no coordinates.
    coordinates : the names of those that are coordinates.
    dims : dimensions of those that have others in the file.
    """
    dims = {name: variable.dims for name, variable in variables.items()} | dict(dims)
    without = {*coordinates, *(variable.attrs.get("bounds") for variable in variables.values())}
    auxiliary = sorted(name for name in coordinates if dims[name] != (name,))
    found = {
        name: " ".join(each for each in auxiliary if set(dims[each]) <= set(own))
        for name, own in dims.items()
        if name not in without
    }
    return {name: text for name, text in found.items() if text}
