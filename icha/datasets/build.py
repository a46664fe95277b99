"""Build datasets from values and from tables that describe the variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from icha.datasets.variables.terms import Table, Variable

if TYPE_CHECKING:
    import xarray as xr


def build_dataset(table: Table, values: Mapping[str, Any], attrs: Mapping[str, str]) -> xr.Dataset:
    """Build a dataset from values by name; variables have the order of the table, and coordinates come last.

    Raise ValueError if a value has no description in the table.
    """
    import xarray as xr  # imported here because the import is slow, and some callers do not build datasets

    variables = describe_variables(table, values)
    coordinates = {name: variables.pop(name) for name in table if name in variables and table[name].coordinate}
    return xr.Dataset(variables, coordinates, attrs)


def describe_variables(table: Table, values: Mapping[str, Any]) -> dict[str, xr.Variable]:
    """Make the variables of a dataset from values and descriptions, in the order of the table."""
    if unknown := values.keys() - table.keys():
        raise ValueError(f"variables without a description: {', '.join(sorted(unknown))}")
    return {name: make_variable(table[name], values[name]) for name in table if name in values}


def make_variable(description: Variable, values: Any) -> xr.Variable:
    """Make a variable from values, with the dimensions, type and attributes of the description."""
    import xarray as xr

    dtype = object if description.dtype is str else description.dtype
    return xr.Variable(description.dims, np.asarray(values, dtype), description.attributes)


def get_values(thing: Any, *names: str) -> dict[str, Any]:
    """Return attributes of a surface, a material or a spectrum by name, as values of variables with the same names."""
    return {name: getattr(thing, name) for name in names}


def stack_rows(
    table: Table, rows: Sequence[Mapping[str, Any]], dim: str, sizes: Mapping[str, int] = {}
) -> dict[str, np.ndarray]:
    """Stack rows to arrays of the variables whose first dimension is `dim`; a row has the values at one index of `dim`.

    `sizes` are the sizes of the other dimensions.
    """
    names = [name for name, described in table.items() if described.dims[:1] == (dim,) and name != dim]
    shapes = {name: (len(rows), *(sizes[each] for each in table[name].dims[1:])) for name in names}
    values = {name: np.array([row[name] for row in rows]).reshape(shapes[name]) for name in names}
    return values | ({dim: np.arange(len(rows))} if dim in table else {})


def concatenate_rows(table: Table, rows: Sequence[Mapping[str, Any]], dim: str, instance: str) -> dict[str, np.ndarray]:
    """Concatenate the arrays of all rows along `dim`; the rows may have different numbers of values (ragged dimension).

    The variable `<dim>_<instance>` gives the row number of each value.
    """
    index = f"{dim}_{instance}"
    names = [name for name, described in table.items() if described.dims == (dim,) and name != index]
    values = {name: np.concatenate([np.empty(0), *(row[name] for row in rows)]) for name in names}
    return values | {index: np.repeat(np.arange(len(rows)), [len(row[names[0]]) for row in rows])}


def bin_values(quantity: str, edges: np.ndarray) -> dict[str, np.ndarray]:
    """Return centres, edges and bounds of bins, for the variables of `bin_table`."""
    return {
        f"{quantity}_bin_edges": edges,
        f"{quantity}_bin_centre": (edges[:-1] + edges[1:]) / 2,
        f"{quantity}_bin_bounds": np.column_stack([edges[:-1], edges[1:]]),
    }
