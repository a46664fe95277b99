"""The builder of datasets: values by name, and a table of the vocabulary that describes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from icha.datasets.variables.terms import Table, Variable


def build(table: Table, values: Mapping[str, Any], attrs: Mapping[str, str]) -> xr.Dataset:
    """The dataset of some values, in the order of the table, coordinates last.

    Parameters
    ----------
    table : descriptions of the variables (`icha.datasets.variables`).
    values : of those variables that the dataset has; numbers, texts or arrays of the shapes of their dimensions.
    attrs : global attributes.

    Raises
    ------
    ValueError
        If a value has no description.
    """
    variables = described(table, values)
    coordinates = {name: variables.pop(name) for name in table if name in variables and table[name].coordinate}
    return xr.Dataset(variables, coordinates, attrs)


def described(table: Table, values: Mapping[str, Any]) -> dict[str, xr.Variable]:
    """Variables of some values with their dimensions, types and attributes, in the order of the table."""
    if unknown := values.keys() - table.keys():
        raise ValueError(f"variables without a description: {', '.join(sorted(unknown))}")
    return {name: variable(table[name], values[name]) for name in table if name in values}


def variable(description: Variable, values: Any) -> xr.Variable:
    """A variable with the dimensions, type and attributes of its description."""
    dtype = object if description.dtype is str else description.dtype
    return xr.Variable(description.dims, np.asarray(values, dtype), description.attributes)
