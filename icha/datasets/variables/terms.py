"""Read descriptions of variables from text tables; `TERMS` are variables that several kinds of files have in common."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np


class Variable(NamedTuple):
    """Description of a variable.

    Attributes
    ----------
    dims : names of the dimensions.
    units : unit in the notation of CF; "1" for numbers without a unit.
    long_name : meaning of the variable.
    dtype : numpy type of the values; `str` for texts.
    further : attributes of the variable besides units and long name.
    coordinate : True for a coordinate of CF.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: type = float
    further: Mapping[str, Any] = {}
    coordinate: bool = False

    @property
    def attributes(self) -> dict[str, Any]:
        """All attributes of the variable in a file."""
        return {"units": self.units, "long_name": self.long_name, **self.further}


# Attribute of a variable that may have infinite values; the text of the attribute is the condition.
INFINITE = "infinite"
MATERIAL = ("contact_modulus", "surface_energy", "interaction_range")
ROUGHNESS = ("rms_slope", "rms_height", "rms_curvature")

Table = dict[str, Variable]
_TYPES = {"int": int, "int8": np.int8, "int32": np.int32, "text": str}


def read_tables(
    name: str, known: Mapping[str, Variable] = {}, attributes: Mapping[str, Mapping[str, Any]] = {}, **texts: str
) -> dict[str, Table]:
    """Return the tables of a text file in this folder, by heading; `terms.txt` describes the format.

    Parameters
    ----------
    name : name of the text file.
    known : descriptions for lines without a long name. Such a line may also refer to an earlier table of the file.
    attributes : further attributes of variables, by name of the variable.
    texts : texts that replace names in braces in long names.
    """
    tables: dict[str, Table] = {}
    table: Table = {}
    for line in Path(__file__).with_name(name).read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            known = {**known, **table}
            table = tables[line.strip("[]")] = {}
        elif bins := re.fullmatch(r"(\w+) bins (\S+)", line):
            table |= bin_table(*bins.groups())
        elif line and not line.startswith("#"):
            facts, _, long_name = line.partition(": ")
            key, dims, rest = re.fullmatch(r"(\w+)\((.*?)\) ?(.*)", facts).groups()
            dims = tuple(filter(None, dims.split(", ")))
            words = rest.split()
            coordinate = words[-1:] == ["coordinate"]
            if coordinate:
                words.pop()
            if not long_name:
                further = attributes.get(key, known[key].further)
                table[key] = known[key]._replace(dims=dims, further=further, coordinate=coordinate)
                continue
            dtype = _TYPES[words.pop()] if words[-1] in _TYPES else float
            further = attributes.get(key, {})
            table[key] = Variable(dims, " ".join(words), long_name.format(**texts), dtype, further, coordinate)
    return tables or {"": table}


def bin_table(quantity: str, units: str, over: str = "") -> Table:
    """Describe the variables for the bins of a quantity: edges, centres and bounds, divided by the reference `over`.

    `<quantity>_bin_bounds` are the CF bounds (CF 1.11, section 7.1) of the coordinate `<quantity>_bin_centre`. Bounds
    and centres have the same units and long name. The coordinate must not have the name of its dimension, because CF
    would read a coordinate variable in Pa as a height.
    """
    over = f" divided by {over}" if over else ""
    bins, inside = f"{quantity}_bin", f"{quantity} in the bin{over}"
    middle = {"bounds": f"{bins}_bounds", "comment": "middle of the bin"}
    return {
        f"{bins}_edges": Variable((f"{quantity}_edge",), units, f"edges of the {quantity} bins{over}"),
        f"{bins}_centre": Variable((bins,), units, inside, further=middle, coordinate=True),
        # Lower and upper edge of each bin.
        f"{bins}_bounds": Variable((bins, "bound"), units, inside),
    }


def is_refused(values: np.ndarray, attrs: Mapping[str, object]) -> np.ndarray:
    """Return True for values of a variable that are not finite, except infinite values that `attrs` allow."""
    refused = ~np.isfinite(values)
    return refused & ~np.isposinf(values) if INFINITE in attrs else refused


TERMS = read_tables("terms.txt")[""]
