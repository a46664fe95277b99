"""Write and read datasets as netCDF-4 files, with the conventions that all files of ICHA share.

A file never appears before it is complete. The same values always give the same bytes. All values are finite, except
where `write_dataset` allows missing or infinite values.

Files of runs contain many small variables. The netCDF library is slow if a program alternates between defining and
writing variables. Therefore ICHA defines all variables before it writes the first one.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Container, Hashable, Iterator, Mapping
from contextlib import contextmanager

import netCDF4
import numpy as np
import xarray as xr

from icha.datasets.results import COMPRESSED_SIZES, COMPRESSION, LEFT_IN_FILE
from icha.datasets.variables.campaign import COMPLETE
from icha.datasets.variables.run import CELLS
from icha.datasets.variables.terms import is_refused
from icha.support.atomic_files import whole_file

FLOAT_FILL = 9.969209968386869e36
INTEGER_FILL = -(2**31) + 1
# With this attribute, xarray recognises text that is stored as characters. Every netCDF tool reads characters. Unlike
# strings of variable length, characters can be compressed.
TEXT = {"_Encoding": "utf-8"}


def write_dataset(data: xr.Dataset | xr.DataTree, path: str | os.PathLike) -> None:
    """Write a dataset or a tree of datasets to the netCDF-4 file `path`.

    Missing values are written as `_FillValue`. Values may be missing in runs whose `status` is not complete, after the
    last step of a run, and in variables with the attribute `missing`. The attribute `infinite` allows infinite values.

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
            variable
            for group, dataset in nodes.items()
            for variable in _define(file if group == "/" else file.createGroup(group), dataset)
        ]
        for variable, values in defined:
            variable[...] = values


def _define(group: netCDF4.Dataset, dataset: xr.Dataset) -> list[tuple[netCDF4.Variable, np.ndarray]]:
    """Define the dimensions and variables of a dataset in a group of a file; return each variable and its values."""
    define_dimensions(group, dataset.sizes)
    group.setncatts(dataset.attrs)
    coordinates = coordinates_of(dataset.variables, dataset.coords)
    defined = []
    for name, variable in dataset.variables.items():
        attrs = variable.attrs | ({"coordinates": coordinates[name]} if name in coordinates else {})
        if is_text(variable.dtype):
            values = characters(variable.values)
            width = values.shape[-1]
            defined.append((define_variable(group, name, variable.dims, values.dtype, attrs, width), values))
            continue
        values, storage = variable.values, {}
        if variable.dtype.kind == "f" and np.isnan(values).any():
            is_integer = variable.encoding.get("dtype") == np.dtype("int32")
            fill = storage["fill_value"] = INTEGER_FILL if is_integer else FLOAT_FILL
            values = np.where(np.isnan(values), fill, values)
            values = values.astype(np.int32) if is_integer else values
        if variable.dims[-2:] == CELLS:
            # Each map is one chunk, because maps are read one by one. Maps are compressed, since most values are zero.
            storage |= COMPRESSION | {"chunksizes": (*[1] * (variable.ndim - 2), *variable.shape[-2:])}
        elif variable.size in COMPRESSED_SIZES:
            storage |= COMPRESSION
        defined.append((define_variable(group, name, variable.dims, values.dtype, attrs, **storage), values))
    return defined


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
            may_lack = excused.all([dim for dim in excused.dims if dim not in variable.dims]).variable
            if "step" in variable.dims:
                may_lack = may_lack | (dataset["step"] >= dataset["step_count"]).variable
            bad &= ~(may_lack & np.isnan(variable)).transpose(*variable.dims).values
        if bad.any():
            raise ValueError(f"{where}: variable {not_finite(name, variable.dims, bad)}")


def read_dataset(path: str | os.PathLike) -> xr.Dataset:
    """Read a netCDF file with a single group into memory.

    Raises
    ------
    ValueError
        If the file does not exist or cannot be read.
    """
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
    """Read the dataset of a run from a file; the dataset equals the result of `icha.simulate`.

    Raises
    ------
    ValueError
        If the file cannot be read or is not a run dataset.
    """
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


def characters(texts: np.ndarray) -> np.ndarray:
    """Encode texts as arrays of characters (UTF-8); the added last dimension has the length of the longest text."""
    texts = np.asarray(texts)
    encoded = np.ascontiguousarray(np.char.encode(texts.astype("U"), "utf-8"))
    return encoded.view("S1").reshape(*texts.shape, max(encoded.dtype.itemsize, 1))


def define_dimensions(group: netCDF4.Dataset, sizes: Mapping[Hashable, int]) -> None:
    """Define the dimensions of a group of a netCDF file; `sizes` are sizes by name of the dimension."""
    for name, size in sizes.items():
        group.createDimension(name, size)


def define_variable(
    group: netCDF4.Dataset, name: str, dims: tuple[str, ...], dtype: np.dtype, attrs: Mapping, width=0, **storage
) -> netCDF4.Variable:
    """Define a variable of numbers, or of texts of at most `width` bytes, which are stored as characters.

    `storage` are options of `netCDF4.Dataset.createVariable`.
    """
    if width:
        dims, attrs = (*dims, f"string{width}"), {**attrs, **TEXT}
        if dims[-1] not in group.dimensions:
            group.createDimension(dims[-1], width)
    variable = group.createVariable(name, dtype, dims, **storage)
    variable.setncatts(dict(attrs))
    # The netCDF library must not convert the values.
    variable.set_auto_maskandscale(False)
    variable.set_auto_chartostring(False)
    return variable


def not_finite(name: Hashable, dims: tuple[Hashable, ...], bad: np.ndarray) -> str:
    """Describe the values of a variable that are not finite; the array `bad` is True for these values."""
    first = ", ".join(f"{dim}={index}" for dim, index in zip(dims, np.argwhere(bad)[0], strict=True))
    text = f"{name!r} holds {np.count_nonzero(bad)} of {bad.size} values that are not finite"
    return f"{text}, the first at {first}" if first else text


def coordinates_of(
    variables: Mapping[Hashable, xr.Variable],
    coordinates: Collection[Hashable],
    dims: Mapping[Hashable, tuple[Hashable, ...]] = {},
) -> dict[Hashable, str]:
    """Return the CF attribute `coordinates` for each variable that has coordinates besides those of its dimensions.

    Parameters
    ----------
    variables : all variables of a group, by name. Bounds of coordinates do not get the attribute.
    coordinates : names of the variables that are coordinates.
    dims : dimensions in the file by name of the variable, for variables with other dimensions in the file.
    """
    dims = {name: variable.dims for name, variable in variables.items()} | dict(dims)
    without = {*coordinates, *(variable.attrs.get("bounds") for variable in variables.values())}
    auxiliary = sorted(name for name in coordinates if dims[name] != (name,))
    found = {
        name: " ".join(each for each in auxiliary if set(dims[each]) <= set(dims[name]))
        for name in dims
        if name not in without
    }
    return {name: text for name, text in found.items() if text}
