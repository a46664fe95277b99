"""Write and read datasets as netCDF-4 files, with the conventions that all files of ICHA share.

A file never appears before it is complete. The same values always give the same bytes. All values are finite, except
where `write_dataset` allows missing or infinite values.

Files of runs contain many small variables. The netCDF library is slow if a program alternates between defining and
writing variables. Therefore ICHA defines all variables before it writes the first one.
"""

from __future__ import annotations

import math
import os
from collections.abc import Container, Hashable, Iterator
from contextlib import contextmanager

import netCDF4
import numpy as np
import xarray as xr

from icha.datasets.results import COMPRESSION, LEAST_COMPRESSED, LEAST_PLAIN_HEIGHTS, LEFT_IN_FILE, VALUES_IN_CHUNK
from icha.datasets.variables.campaign import COMPLETE
from icha.datasets.variables.run import CELLS
from icha.datasets.variables.terms import is_refused
from icha.path.targets import UNLOADING
from icha.support.atomic_files import whole_file

_FLOAT_FILL = 9.969209968386869e36
_INTEGER_FILL = -(2**31) + 1
# Dimensions of the heights of a surface.
HEIGHTS = ("y", "x")
# With this attribute, xarray recognises text that is stored as characters. Every netCDF tool reads characters. Unlike
# strings of variable length, characters can be compressed.
_TEXT = {"_Encoding": "utf-8"}


def write_dataset(data: xr.Dataset | xr.DataTree, path: str | os.PathLike) -> None:
    """Write a dataset or a tree of datasets to the netCDF-4 file `path`.

    Missing values are written as `_FillValue`. Values may be missing in runs whose `status` is not complete, after the
    last step of a run, in states of the last unloading that a run does not reach, and in variables with the attribute
    `missing`. The attribute `infinite` allows infinite values.

    Raises
    ------
    ValueError
        If a variable has no units, or has missing or infinite values that are not allowed.
    """
    nodes = {"/": data}
    if isinstance(data, xr.DataTree):
        nodes = {node.path: node.to_dataset(inherit=False) for node in data.subtree}
    for group, dataset in nodes.items():
        _refuse_values_not_finite(dataset, f"{path}" if group == "/" else f"{path}, group {group}")
    with whole_file(path) as temporary, netCDF4.Dataset(temporary, "w") as file:
        # Every variable is written completely, so filling it with missing values first would waste time.
        file.set_fill_off()
        defined = [
            each
            for group, dataset in nodes.items()
            for each in _define(file if group == "/" else file.createGroup(group), dataset)
        ]
        for variable, values, fill in defined:
            variable[...] = values if fill is None else np.where(np.isnan(values), fill, values).astype(variable.dtype)


def _define(
    group: netCDF4.Dataset, dataset: xr.Dataset
) -> Iterator[tuple[netCDF4.Variable, np.ndarray, float | int | None]]:
    """Define the dimensions and variables of a dataset in a group of a file.

    Yields each variable, its values, and the number that replaces missing values; None if no value is missing.
    """
    for dim, size in dataset.sizes.items():
        group.createDimension(dim, size)
    group.setncatts(dataset.attrs)
    coordinates = _coordinates_of(dataset)
    for name, variable in dataset.variables.items():
        dims, values, dtype, fill = variable.dims, variable.values, variable.dtype, None
        attrs = variable.attrs | ({"coordinates": coordinates[name]} if name in coordinates else {})
        if is_text(dtype):
            values, attrs = _characters(values), attrs | _TEXT
            dims, dtype = (*dims, f"string{values.shape[-1]}"), values.dtype
            if dims[-1] not in group.dimensions:
                group.createDimension(dims[-1], values.shape[-1])
        elif dtype.kind == "f" and np.isnan(values).any():
            fill = _FLOAT_FILL
            if variable.encoding.get("dtype") == np.dtype("int32"):
                dtype, fill = np.dtype(np.int32), _INTEGER_FILL
        defined = group.createVariable(name, dtype, dims, fill_value=fill, **_storage(dims, values.shape))
        defined.setncatts(attrs)
        # The netCDF library must not convert the values.
        defined.set_auto_maskandscale(False)
        defined.set_auto_chartostring(False)
        yield defined, values, fill


def _storage(dims: tuple[Hashable, ...], shape: tuple[int, ...]) -> dict:
    """Return the storage options of an array: whether it is compressed, and the shape of its chunks."""
    if dims[-2:] == CELLS:
        # Each map is one chunk, because maps are read one by one. Maps are compressed, since most values are zero.
        return COMPRESSION | {"chunksizes": (*[1] * (len(shape) - 2), *shape[-2:])}
    size = math.prod(shape)
    if size < LEAST_COMPRESSED or (dims == HEIGHTS and size >= LEAST_PLAIN_HEIGHTS):
        return {}
    chunk, left = [], VALUES_IN_CHUNK
    for length in reversed(shape):
        chunk.append(max(1, min(length, left)))
        left //= length
    return COMPRESSION | {"chunksizes": tuple(reversed(chunk))}


def _refuse_values_not_finite(dataset: xr.Dataset, where: str) -> None:
    excused = dataset["status"] != COMPLETE if "status" in dataset.data_vars else None
    for name, variable in dataset.variables.items():
        if "units" not in variable.attrs:
            raise ValueError(f"{where}: variable {name!r} has no units")
        if variable.dtype.kind not in "fc":
            continue
        bad = is_refused(variable.values, variable.attrs)
        if "missing" in variable.attrs:
            bad &= ~np.isnan(variable.values)
        if excused is not None and set(variable.dims) & set(excused.dims):
            # A value for several runs may be missing if all these runs are incomplete or missing.
            shared = [dim for dim in excused.dims if dim not in variable.dims]
            may_lack = excused.all(shared).variable
            if "snapshot" in variable.dims:
                # Runs need not reach the states of the last unloading.
                optional = dataset["snapshot_kind"].astype(str).str.startswith(UNLOADING)
                may_lack = may_lack | (dataset["snapshot_step"].isnull() & optional).all(shared).variable
            if "step" in variable.dims:
                may_lack = may_lack | (dataset["step"] >= dataset["step_count"]).variable
            bad &= ~(may_lack & np.isnan(variable)).transpose(*variable.dims).values
        if bad.any():
            raise ValueError(f"{where}: variable {not_finite(name, variable.dims, bad)}")


def read_dataset(path: str | os.PathLike) -> xr.Dataset:
    """Read a netCDF file with a single group into memory; raise ValueError if it cannot be read."""
    with readable(path):
        return xr.load_dataset(path, engine="netcdf4")


def has_groups(path: str | os.PathLike) -> bool:
    """Return True if a netCDF file has groups, like a campaign dataset; raise the errors of `read_dataset`."""
    with readable(path), netCDF4.Dataset(path) as file:
        return bool(file.groups)


def read_campaign(path: str | os.PathLike) -> xr.DataTree:
    """Read a campaign dataset into memory, except large arrays; raise the errors of `read_dataset`.

    Arrays of more than 64 MB, such as distributions of thousands of runs, stay in the file until they are used. If a
    single run is selected (`icha.datasets.campaign.select_run`), only the values of this run are read.
    """
    with readable(path):
        tree = xr.open_datatree(path, engine="netcdf4")
        variables = [variable for node in tree.subtree for variable in node.variables.values()]
        small = [variable.load() for variable in variables if variable.nbytes <= LEFT_IN_FILE]
        if len(small) == len(variables):
            tree.close()
        return tree


@contextmanager
def readable(path: str | os.PathLike) -> Iterator[None]:
    """Replace errors in reading a netCDF file by a ValueError that names the file."""
    try:
        yield
    except FileNotFoundError:
        raise ValueError(f"{path}: no such file") from None
    except (OSError, RuntimeError) as error:
        raise ValueError(f"{path}: not a readable netCDF file ({error})") from None


def read_run(path: str | os.PathLike) -> xr.Dataset:
    """Read the dataset of a run, which equals the result of `icha.simulate`; raise ValueError for other files."""
    run = read_dataset(path)
    check_is_run(run.variables, path)
    return run


def check_is_run(variables: Container[Hashable], path: str | os.PathLike) -> None:
    """Raise ValueError if a file lacks a variable that all runs have; `variables` are the names in the file."""
    for name in ("mean_separation", "nominal_pressure", "contact_area_fraction", "contact_modulus"):
        if name not in variables:
            raise ValueError(f"{path}: not a run dataset, because it has no variable {name!r}")


def is_text(dtype: np.dtype) -> bool:
    """Return True if an array of this type holds text."""
    return dtype.kind in "OUTS"


def encode_texts(texts: np.ndarray) -> np.ndarray:
    """Encode texts as bytes (UTF-8) of equal length, with zeros after the end of shorter texts."""
    return np.char.encode(np.asarray(texts).astype("U"), "utf-8")


def _characters(texts: np.ndarray) -> np.ndarray:
    """Encode texts as arrays of characters (UTF-8); the added last dimension has the length of the longest text."""
    encoded = np.ascontiguousarray(encode_texts(texts))
    return encoded.view("S1").reshape(*np.shape(texts), max(encoded.dtype.itemsize, 1))


def not_finite(name: Hashable, dims: tuple[Hashable, ...], bad: np.ndarray) -> str:
    """Describe the values of a variable that are not finite; the array `bad` is True for these values."""
    first = ", ".join(f"{dim}={index}" for dim, index in zip(dims, np.argwhere(bad)[0], strict=True))
    text = f"{name!r} holds {np.count_nonzero(bad)} of {bad.size} values that are not finite"
    return f"{text}, the first at {first}" if first else text


def _coordinates_of(dataset: xr.Dataset) -> dict[Hashable, str]:
    """Return the CF attribute `coordinates` for each variable that has coordinates besides those of its dimensions."""
    variables = dataset.variables
    # Bounds of coordinates do not get the attribute.
    without = {*dataset.coords, *(variable.attrs.get("bounds") for variable in variables.values())}
    auxiliary = sorted(name for name in dataset.coords if variables[name].dims != (name,))
    found = {
        name: " ".join(each for each in auxiliary if set(variables[each].dims) <= set(variable.dims))
        for name, variable in variables.items()
        if name not in without
    }
    return {name: text for name, text in found.items() if text}
