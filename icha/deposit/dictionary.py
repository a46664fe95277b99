"""The data dictionary of a deposit: every variable of every netCDF file, told by the files themselves."""

import csv
import io
import math
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import netCDF4
import numpy as np

from icha.datasets.results import LOOP, RUN, SOLUTION, SURFACE, THEORIES

# What stands for what differs among files of the same kind, and how these are called, by the beginning of their path;
# any other file is a kind of its own.
_DIFFERENT = {name: f"<{name}>" for name in ("study", "entry", "surface", "material")}
_DIFFERENT |= {"seed": "<k>", "slope": "<g>", "pressure": "<load>", "model_folder": ""}
# By the beginning of a path and its number of parts.
_KINDS = {
    (pattern.partition("/{")[0], len(PurePosixPath(kind).parts)): kind
    for pattern in (SURFACE, RUN, SOLUTION, LOOP, THEORIES)
    for kind in {pattern.format(**_DIFFERENT | {"model_folder": folder}) for folder in ("", "<model>/")}
}
# Numbers that are read at once.
_BLOCK = 2**22


class Entry(NamedTuple):
    """A variable of all files of a kind. Texts as the files have them; `files` counts those that hold the variable.

    `smallest` and `largest` are of all values that are not missing; texts have none.
    """

    file: str
    group: str
    variable: str
    dimensions: str
    type: str
    units: str
    long_name: str
    flags: str
    missing: str
    comment: str
    files: int
    smallest: float | int | None
    largest: float | int | None


def data_dictionary(folder: Path, files: Iterable[str]) -> list[Entry]:
    """The variables of some files, in the order of the files; what they agree in is said once for a kind of files.

    Parameters
    ----------
    folder : the folder of the files.
    files : their paths from there. Those that are no netCDF files are passed over.

    Raises
    ------
    OSError
        If a file cannot be read.
    """
    found: dict[tuple, list] = {}
    for name in sorted(files):
        if not name.endswith(".nc"):
            continue
        kind = kind_of(name)
        with netCDF4.Dataset(folder / name) as file:
            file.set_auto_maskandscale(False)
            for group in _groups(file):
                for variable in group.variables.values():
                    key = (kind, group.path, *_described(variable))
                    so_far = found.setdefault(key, [0, None, None])
                    smallest, largest = _range(variable)
                    so_far[0] += 1
                    so_far[1] = _known(min, so_far[1], smallest)
                    so_far[2] = _known(max, so_far[2], largest)
    return [Entry(*key, *values) for key, values in found.items()]


def dictionary_csv(entries: Iterable[Entry]) -> str:
    """The dictionary as a table with a line of headings, commas and quotes (RFC 4180 but for its line ends)."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(Entry._fields)
    table.writerows(["" if value is None else value for value in entry] for entry in entries)
    return text.getvalue()


def kind_of(path: str) -> str:
    """What files like this one are called."""
    parts = PurePosixPath(path).parts
    kinds = (_KINDS.get((beginning, len(parts))) for beginning in ("/".join(parts[:2]), parts[0]))
    return next(filter(None, kinds), path)


def _groups(group) -> Iterator[netCDF4.Dataset]:
    yield group
    for inner in group.groups.values():
        yield from _groups(inner)


def _described(variable) -> tuple[str, ...]:
    """Name, dimensions, type, units, long name, flags, meaning of missing values, and comment of a variable."""
    attributes = {name: variable.getncattr(name) for name in variable.ncattrs()}
    dimensions, kind = variable.dimensions, np.dtype(variable.dtype)
    # Texts are kept as characters, along a last dimension that is of no interest to anyone.
    if kind == np.dtype("S1") or kind.kind in "OU":
        dimensions, type_name = (dimensions[:-1] if kind == np.dtype("S1") else dimensions), "text"
    else:
        type_name = kind.name
    values = np.atleast_1d(attributes.get("flag_values", []))
    meanings = str(attributes.get("flag_meanings", "")).split()
    flags = ", ".join(f"{value}: {meaning}" for value, meaning in zip(values, meanings, strict=False))
    missing = str(attributes.get("missing", ""))
    if "_FillValue" in attributes:
        missing = f"{attributes['_FillValue']!s}: {missing or 'no value, see status and step_count'}"
    return (
        variable.name,
        " ".join(dimensions),
        type_name,
        *(str(attributes.get(name, "")) for name in ("units", "long_name")),
        flags,
        missing,
        str(attributes.get("comment", "")),
    )


def _range(variable) -> tuple[float | int | None, float | int | None]:
    """Smallest and largest value of a variable of numbers, read block by block."""
    if np.dtype(variable.dtype).kind not in "fiu":
        return None, None
    fill = variable.getncattr("_FillValue") if "_FillValue" in variable.ncattrs() else None
    smallest = largest = None
    for block in _blocks(variable):
        values = np.atleast_1d(block)
        there = np.isfinite(values) if values.dtype.kind == "f" else np.ones(values.shape, dtype=bool)
        if fill is not None:
            there &= values != fill
        if there.any():
            smallest = _known(min, smallest, values.min(where=there, initial=values[there][0]).item())
            largest = _known(max, largest, values.max(where=there, initial=values[there][0]).item())
    return smallest, largest


def _blocks(variable) -> Iterator[np.ndarray]:
    if not variable.shape:
        yield variable[...]
        return
    rows = max(1, _BLOCK // max(1, math.prod(variable.shape[1:])))
    for begin in range(0, variable.shape[0], rows):
        yield variable[begin : begin + rows]


def _known(choose, one, other):
    """The smaller or larger of two values, of which either may not be known."""
    return other if one is None else one if other is None else choose(one, other)
