"""Write the data dictionary of a deposit: all variables of netCDF files and all columns of CSV files, with units."""

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import netCDF4
import numpy as np

from icha.configuration.load import INPUTS
from icha.datasets.results import RUN, SURFACE, THEORIES
from icha.datasets.table import name_and_unit
from icha.figures.drawn import COLUMNS

_COLUMNS = "file group variable dimensions type units long_name flags missing comment files".split()
# Placeholders for the parts of a path that differ between files of one kind.
_PLACEHOLDERS = {name: f"<{name}>" for name in ("study", "surface", "material")}
_PLACEHOLDERS |= {"seed": "<k>", "slope": "<g>"}
_KINDS = [
    pattern.format(**_PLACEHOLDERS, model_folder=folder)
    for pattern in (SURFACE, RUN, THEORIES)
    for folder in ("", "<model>/")
]
_KINDS.append("figures/<name>.csv")


def data_dictionary(folder: Path, files: Iterable[str]) -> str:
    """Return the text of `data_dictionary.csv`, with one row for each variable of each kind of file.

    Files of one kind share their rows: `<name>` in a path stands for the part that differs. Columns of the table of all
    runs have the descriptions of the variables with the same names. Paths in `files` are relative to `folder`.
    """
    found: Counter[tuple[str, ...]] = Counter()
    long_names: dict[str, str] = {}
    for name in sorted(files, key=lambda each: (not each.endswith(".nc"), each)):
        if name.endswith(".nc"):
            with netCDF4.Dataset(folder / name) as file:
                for group in (file, *file.groups.values()):
                    for variable in group.variables.values():
                        found[file_pattern(name), group.path, *_described(variable)] += 1
                        long_names[variable.name] = getattr(variable, "long_name", "")
        elif name.endswith(".csv") and not name.startswith(f"{INPUTS}/"):
            with (folder / name).open(encoding="utf-8", newline="") as table:
                for column in next(csv.reader(table), []):
                    variable, unit = name_and_unit(column)
                    meaning = long_names.get(variable, variable)
                    if name.startswith("figures/"):
                        meaning, unit = COLUMNS.get(column, (column, ""))
                    row = column, "row", "", unit, meaning, "", "empty", ""
                    found[file_pattern(name), "", *row] += 1
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([_COLUMNS, *((*row, count) for row, count in found.items())])
    return text.getvalue()


def file_pattern(path: str) -> str:
    """Return the path pattern of the kind of file that `path` belongs to, such as `surfaces/<surface>/seed<k>.nc`."""
    return next((kind for kind in _KINDS if re.fullmatch(re.sub("<.*?>", "[^/]+", kind), path)), path)


def _described(variable: netCDF4.Variable) -> tuple[str, ...]:
    """Return the row of the data dictionary for a variable in a file, from column `variable` to column `comment`."""
    attributes = {name: str(variable.getncattr(name)) for name in variable.ncattrs()}
    units, long_name, meanings, missing, comment = (
        attributes.get(name, "") for name in ("units", "long_name", "flag_meanings", "missing", "comment")
    )
    # Texts are stored as characters along a last dimension.
    is_text = variable.dtype == "S1"
    dimensions = variable.dimensions[:-1] if is_text else variable.dimensions
    values = np.atleast_1d(getattr(variable, "flag_values", []))
    flags = ", ".join(f"{value}: {meaning}" for value, meaning in zip(values, meanings.split(), strict=True))
    if "_FillValue" in attributes:
        missing = f"{attributes['_FillValue']}: {missing or 'no value, see status and step_count'}"
    kind = "text" if is_text else variable.dtype.name
    return variable.name, " ".join(dimensions), kind, units, long_name, flags, missing, comment
