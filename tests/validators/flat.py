"""netCDF files without groups, for tools that know none: each group with variables as a file of its own.

What a group inherits stands in its file, too: the dimensions of its variables, the variables of groups above it that
its own ones name, and the attributes of those groups that it does not have itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import netCDF4

# Attributes by which a variable names others (CF 1.11, appendix A).
NAMING = (
    "ancillary_variables",
    "bounds",
    "cell_measures",
    "climatology",
    "coordinates",
    "formula_terms",
    "grid_mapping",
)


def flat_files(path: Path, folder: Path) -> Iterator[tuple[str, Path]]:
    """Write every group of `path` that has variables to `folder`; yield its name (`/`, `/study`) and its file.

    A file without groups is yielded as it is.
    """
    with netCDF4.Dataset(path) as data:
        if not data.groups:
            yield "/", path
            return
        for group in _groups(data):
            if group.variables:
                target = folder / f"{path.stem}{group.path.replace('/', '-').rstrip('-')}.nc"
                _write(group, target)
                yield group.path, target


def _groups(group: netCDF4.Group) -> Iterator[netCDF4.Group]:
    yield group
    for child in group.groups.values():
        yield from _groups(child)


def _ancestry(group: netCDF4.Group) -> list[netCDF4.Group]:
    """The group and those above it, the root last."""
    return [group] if group.parent is None else [group, *_ancestry(group.parent)]


def _write(group: netCDF4.Group, target: Path) -> None:
    ancestry = _ancestry(group)
    known = {name: variable for above in reversed(ancestry) for name, variable in above.variables.items()}
    variables = dict(group.variables)
    pending = list(variables.values())
    while pending:
        variable = pending.pop()
        named = {
            word for key in NAMING if key in variable.ncattrs() for word in re.findall(r"\w+", variable.getncattr(key))
        }
        for name in named | set(variable.dimensions):
            if name in known and name not in variables:
                variables[name] = known[name]
                pending.append(known[name])
    with netCDF4.Dataset(target, "w") as flat:
        for above in reversed(ancestry):
            flat.setncatts({key: above.getncattr(key) for key in above.ncattrs()})
        for variable in variables.values():
            for dimension in variable.get_dims():
                if dimension.name not in flat.dimensions:
                    flat.createDimension(dimension.name, None if dimension.isunlimited() else dimension.size)
        for name, variable in variables.items():
            attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
            copy = flat.createVariable(
                name, variable.datatype, variable.dimensions, fill_value=attributes.pop("_FillValue", None)
            )
            copy.setncatts(attributes)
            for both in (variable, copy):
                both.set_auto_maskandscale(False)
                both.set_auto_chartostring(False)
            copy[...] = variable[...]
