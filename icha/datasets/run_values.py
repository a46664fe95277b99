"""Values of the files of runs, read quickly: a campaign has thousands of them, of many small variables.

The library of netCDF goes through all that a file holds when it opens it. HDF5, which netCDF-4 files are, finds a
variable by its name; which dimensions it has says the vocabulary.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.files import check_is_run, readable
from icha.datasets.variables.run import CYCLE, LOOP, PATCHES, RUN
from icha.support.hdf5 import text

if TYPE_CHECKING:
    import h5py

# Dimensions and values of variables by name; texts are characters, along a last dimension without a name.
Values = dict[str, tuple[tuple[str, ...], np.ndarray]]

_DIMS = {name: description.dims for name, description in (RUN | PATCHES | CYCLE | LOOP).items()}
# Dimensions stand among the variables in HDF5.
_DIMENSIONS = {dim for dims in _DIMS.values() for dim in dims}
_ATTRIBUTES = ("contact_model", "config_sha256", "incomplete", "failed_checks", "applicability")
_WIDTH_OF_TEXT = re.compile(r"string\d+")


def read_run_values(path: str | os.PathLike, without: Collection[str] = ()) -> tuple[Values, dict[str, str]]:
    """Read the values of a run dataset and those of its attributes that tell what it is, if it has them.

    Variables along the dimensions `without` are left out.

    Raises
    ------
    ValueError
        If the file cannot be read or is not a run dataset.
    """
    import h5py  # which takes a while, and most callers read no run

    with readable(path), h5py.File(path) as file:
        names = [name for name in file if name in _DIMS or not _is_dimension(name)]
        check_is_run(names, path)
        if odd := set(names) - set(_DIMS):
            raise ValueError(f"{path}: not a run dataset, it has a variable {min(odd)!r}")
        wanted = [name for name in names if not set(without) & set(_DIMS[name])]
        values = {name: (_DIMS[name], _read(file, name)) for name in wanted}
        attrs = {name: text(file.attrs[name]) for name in _ATTRIBUTES if name in file.attrs}
    _check_sizes(values, path)
    return values, attrs


def _is_dimension(name):
    return name in _DIMENSIONS or _WIDTH_OF_TEXT.fullmatch(name)


def _read(file: h5py.File, name: str) -> np.ndarray:
    """All values of a variable; by h5py's low-level interface, which takes less than half the time of the other."""
    from h5py import h5d, h5s

    variable = h5d.open(file.id, name.encode())
    values = np.empty(variable.shape, variable.dtype)
    variable.read(h5s.ALL, h5s.ALL, values)
    return values


def _check_sizes(values, path):
    """Refuse variables of other dimensions than the vocabulary's."""
    sizes = {}
    for name, (dims, own) in values.items():
        further = int(own.dtype.kind == "S")
        if own.ndim != len(dims) + further or any(
            sizes.setdefault(dim, size) != size for dim, size in zip(dims, own.shape, strict=False)
        ):
            raise ValueError(f"{path}: not a run dataset, {name!r} does not have the dimensions ({', '.join(dims)})")
