"""Descriptions of variables, read from text tables, and the terms that several kinds of files have in common."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np


class Variable(NamedTuple):
    """Description of a variable.

    Attributes
    ----------
    dims : names of its dimensions.
    units : as CF has them, "1" for numbers without a unit.
    long_name : its meaning.
    dtype : of numpy; `str` for texts.
    further : attributes besides units and long name.
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
        """Attributes of the variable in a file."""
        return {"units": self.units, "long_name": self.long_name, **self.further}


# Attribute of a variable that may be infinite (inf is a value like any other); its text is the condition.
INFINITE = "infinite"
MATERIAL = ("contact_modulus", "surface_energy", "interaction_range")
ROUGHNESS = ("rms_slope", "rms_height", "rms_curvature")

Table = dict[str, Variable]
_TYPES = {"int": int, "int8": np.int8, "int32": np.int32, "text": str}


def read_tables(
    name: str, known: Mapping[str, Variable] = {}, attributes: Mapping[str, Mapping[str, Any]] = {}, **texts: str
) -> dict[str, Table]:
    """Return the tables of a text file of this folder by heading; `terms.txt` describes the format.

    Parameters
    ----------
    name : the file.
    known : descriptions to which lines without a long name refer; later tables also refer to earlier ones.
    attributes : further attributes of variables, by name.
    texts : replacements for names in braces in long names.
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
                table[key] = known[key]._replace(dims=dims, coordinate=coordinate)
                continue
            dtype = _TYPES[words.pop()] if words[-1] in _TYPES else float
            further = attributes.get(key, {})
            table[key] = Variable(dims, " ".join(words), long_name.format(**texts), dtype, further, coordinate)
    return tables or {"": table}


def bin_table(quantity: str, units: str, over: str = "") -> Table:
    """Describe the variables of the bins of a quantity.

    `<quantity>_bin_edges` are the edges; `<quantity>_bin_centre`, a coordinate, has `<quantity>_bin_bounds` as its
    bounds (CF 1.11, section 7.1), with its units and its long name. In Pa it must not be a coordinate variable (a
    variable along a dimension of its own name), because CF would read it as a height.

    Parameters
    ----------
    quantity : the binned quantity.
    units : of the edges.
    over : the unit of reference of the quantity, if it is divided by one.
    """
    over = f" over {over}" if over else ""
    bins, inside = f"{quantity}_bin", f"{quantity} in the bin{over}"
    middle = {"bounds": f"{bins}_bounds", "comment": "middle of the bin"}
    return {
        f"{bins}_edges": Variable((f"{quantity}_edge",), units, f"edges of the {quantity} bins{over}"),
        f"{bins}_centre": Variable((bins,), units, inside, further=middle, coordinate=True),
        # Lower and upper edge of a bin, as CF has bounds.
        f"{bins}_bounds": Variable((bins, "bound"), units, inside),
    }


TERMS = read_tables("terms.txt")[""]
