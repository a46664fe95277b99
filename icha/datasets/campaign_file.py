"""Write the campaign dataset run by run, so that only a few numbers of each run stay in memory.

First, ICHA reads all runs, one by one, and appends their values to a temporary file. The sizes of all arrays, the
snapshots and the lengths of texts stay in memory, because ICHA needs this information before it writes the first run.
Then ICHA reads the temporary file in the order of the dataset, and writes one block of neighbouring runs at a time.
"""

import itertools
import math
import os
import pickle
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import BinaryIO, NamedTuple

import netCDF4
import numpy as np

from icha.datasets.attributes import COLLECTED, combine_attributes
from icha.datasets.campaign_runs import Arrangement, LabelledRun, arrange_runs, spool_runs
from icha.datasets.files import (
    FLOAT_FILL,
    INTEGER_FILL,
    characters,
    coordinates_of,
    define_dimensions,
    define_variable,
    is_text,
)
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.results import COMPRESSION, LEAST_COMPRESSED
from icha.datasets.variables.campaign import CAMPAIGN, RAGGED, index_variable
from icha.datasets.variables.run import FURTHER
from icha.support.atomic_files import whole_file

# A block has at most _RUNS_IN_BLOCK runs and VALUES_IN_BLOCK values of each variable, so it needs some megabytes.
_RUNS_IN_BLOCK = 256
VALUES_IN_BLOCK = 2**18
_VALUES_IN_CHUNK = 2**16
# Values that must be the same for several runs count as equal up to this relative difference.
_SAME = 1e-9

_LAYOUT = (
    "Variables of the runs along model, surface, seed, rms_slope and material. Spots and events are ragged arrays "
    "along spot and event, with one run after the other in the order of the labels. A variable with the attribute "
    "instance_dimension gives, for each spot or event, the position of its run or snapshot along this dimension."
)
_OWN_SLOPES = {"comment": "each surface has different slopes, in ascending order along the dimension rms_slope"}
_STUDIES = "The runs of every study, with one group for each study."
# Attribute of the root of the file. The root has no variables.
_ACCESS = (
    "The file has one group for each study: {0}. To open a group with Python's xarray, use "
    "xarray.open_datatree(FILE)['{1}'].to_dataset(), or xarray.open_dataset(FILE, group='{1}')"
)


class Column(NamedTuple):
    """A variable of the runs, as defined in the file.

    Attributes
    ----------
    variable : the variable in the file.
    along : labels that are dimensions of the variable.
    dims : other dimensions of the variable.
    fill : value that marks a missing value.
    """

    variable: netCDF4.Variable
    along: tuple[str, ...]
    dims: tuple[str, ...]
    fill: float | int | bytes

    def pad(self, values: np.ndarray) -> np.ndarray:
        """Pad texts of a run to the width of texts in the file; return numbers unchanged."""
        if values.dtype.kind != "S":
            return values
        padded = np.zeros((*values.shape[:-1], self.variable.shape[-1]), "S1")
        padded[..., : values.shape[-1]] = values
        return padded

    def slots(self, snapshots: list[int], values: np.ndarray) -> tuple[list[int] | slice, ...]:
        """Return the indices of a run's values along `dims`; `snapshots` are the indices of the run's snapshots."""
        sizes = zip(self.dims, values.shape, strict=False)
        return tuple(snapshots if dim == "snapshot" else slice(0, size) for dim, size in sizes)


class Group(NamedTuple):
    """The group of a study in a file, with defined dimensions and variables but without values.

    Attributes
    ----------
    study : the runs of the study.
    block : for every label, number of neighbouring runs that are written at once.
    columns : variables of the runs, by name.
    ragged : variables along ragged dimensions, by dimension and name.
    known : variables that do not depend on the content of runs, with their values.
    """

    study: Arrangement
    block: tuple[int, ...]
    columns: dict[str, Column]
    ragged: dict[str, dict[str, netCDF4.Variable]]
    known: list[tuple[netCDF4.Variable, np.ndarray]]


def _group_attributes(study: Arrangement, attrs: Mapping[str, str]) -> dict:
    """Return the attributes of a study's group; `attrs` are the attributes of the file."""
    # config_sha256 is the checksum of the campaign, and not that of one of the runs.
    shared = {"license": study.origins[0].get("license"), "config_sha256": attrs.get("config_sha256")}
    return (
        combine_attributes(f"Study {study.name}", _LAYOUT, COLLECTED, study.origins)
        | {"study": study.name}
        | {name: value for name, value in shared.items() if value is not None}
    )


def define_group(
    group: netCDF4.Dataset, study: Arrangement, attrs: Mapping[str, str], varied: Mapping[str, tuple[str, str, dict]]
) -> Group:
    """Define dimensions, variables and attributes of a study's group; `attrs` are the attributes of the file.

    varied : varied parameters of the study, as in `write_campaign`. Variables of the runs keep their values.
    """
    varied = {name: each for name, each in varied.items() if name not in study.variables}
    counts = {
        dim: sum(entry.sizes.get(dim, 0) for entry in study.entries)
        for dim in RAGGED
        if any(dim in variable.dims for variable in study.variables.values())
    }
    sizes = dict(zip(LABELS, study.known["status"].shape, strict=True)) | study.sizes | counts
    define_dimensions(group, sizes)
    group.setncatts(_group_attributes(study, attrs))
    dims_in_file = {name: sum(study.dims_of(name), ()) for name in study.variables}
    dims_in_file |= {name: described.dims for name, described in CAMPAIGN.items()} | {"rms_slope": study.slope_dims}
    dims_in_file |= {name: (label,) for name, (label, *_) in varied.items()}
    coordinates = coordinates_of(study.variables, {*study.coordinates, *varied}, dims_in_file)
    varying = [dims for along, dims in map(study.dims_of, study.variables) if along == LABELS]
    block = _block(sizes, LABELS, max(math.prod(sizes[dim] for dim in dims) for dims in varying))

    def define(name, attributes, along, dims, dtype, width=0, fill=None):
        """Define a variable along labels and further dimensions; `width` is the length of texts in bytes."""
        options = _storage(sizes, block, along, dims, width)
        attributes = {**attributes, **({"coordinates": coordinates[name]} if name in coordinates else {})}
        options |= {} if width or fill is None else {"fill_value": fill}
        return define_variable(group, name, along + dims, dtype, attributes, width, **options)

    columns, known = {}, []
    for name in (name for name in study.variables if name not in sizes):
        along, dims = study.dims_of(name)
        attributes, dtype = study.variables[name].attrs | _why_lacking(study, name), study.variables[name].dtype
        lacks, width = study.lacks(name), 0
        fill: float | int | bytes = FLOAT_FILL if dtype.kind == "f" else INTEGER_FILL if lacks else 0
        if is_text(dtype):
            dtype, width, fill = np.dtype("S1"), max(entry.widths.get(name, 1) for entry in study.entries), b""
        elif dtype.kind != "f":
            # Every netCDF tool reads integers of 32 bits. Flags have 8 bits.
            dtype = np.dtype(np.int8 if dtype == np.int8 and not lacks else np.int32)
        variable = define(name, attributes, along, dims, dtype, width, fill if lacks and not width else None)
        columns[name] = Column(variable, along, dims, fill)
    for dim, size in study.sizes.items():
        if dim in study.variables:
            known.append((define(dim, study.variables[dim].attrs, (), (dim,), np.int32), np.arange(size)))
    for name, described in CAMPAIGN.items():
        along, dims, attributes, fill = (), described.dims, described.attributes, None
        if dims == LABELS:
            along, dims = dims, ()
        is_texts = described.dtype is str
        values = characters(study.known[name]) if is_texts else np.asarray(study.known[name], described.dtype)
        if name == "rms_slope" and values.ndim > 1:
            dims, attributes = study.slope_dims, attributes | _OWN_SLOPES
            fill = FLOAT_FILL if np.isnan(values).any() else None
            values = np.nan_to_num(values, nan=FLOAT_FILL)
        width = values.shape[-1] if is_texts else 0
        known.append((define(name, attributes, along, dims, values.dtype, width, fill), values))
    for name, (label, unit, by_name) in varied.items():
        given = [by_name.get(each) for each in study.known[label]]
        numbers = all(isinstance(value, int | float) or value is None for value in given)
        values = (
            np.array([math.nan if value is None else value for value in given], float)
            if numbers
            else characters(np.array(["" if value is None else str(value) for value in given], object))
        )
        attributes = {"units": unit, "long_name": f"{name.replace('_', ' ')} of the {label}", "varied": "true"}
        width = 0 if numbers else values.shape[-1]
        known.append((define(name, attributes, (), (label,), values.dtype, width), values))
    ragged = {dim: {name: each.variable for name, each in columns.items() if each.dims == (dim,)} for dim in counts}
    for dim, variables in ragged.items():
        for label in LABELS:
            name = f"{dim}_{label}"
            variables[name] = define(name, index_variable(dim, label).attributes, (), (dim,), np.int32)
    return Group(study, block, columns, ragged, known)


def _storage(sizes, block, along, dims, width):
    """Return the storage options of a variable: a large variable is compressed, one chunk per block of runs."""
    shape = (*(sizes[dim] for dim in dims), *([width] if width else []))
    if math.prod(sizes[dim] for dim in along) * math.prod(shape) < LEAST_COMPRESSED:
        return {}
    if along != LABELS:
        block = _block(sizes, along, math.prod(shape))
    chunk = (*block, *shape) if along else tuple(min(size, _VALUES_IN_CHUNK) for size in shape)
    # Each block is written at once, so a cache of more than one block has no advantage.
    return COMPRESSION | {"chunksizes": chunk, "chunk_cache": 8 * math.prod(chunk)}


def _block(sizes, along, values):
    """Return the number of neighbouring runs per block along every label; `values` is the number of values per run."""
    left = max(1, min(_RUNS_IN_BLOCK, VALUES_IN_BLOCK // max(1, values)))
    block = []
    for size in reversed([sizes[label] for label in along]):
        block.append(min(size, left))
        left = left // size if block[-1] == size else 1
    return tuple(reversed(block))


def _why_lacking(study, name):
    """Return the attribute `missing`, which names the models without the variable; {} if every model has it."""
    owners = [model for model, names in FURTHER.items() if name in names]
    lacking = [model for model in study.known["model"] if owners and model not in owners]
    return {"missing": f"in runs with the model {' or '.join(lacking)}"} if lacking else {}


def write_campaign(
    runs: Iterable[LabelledRun],
    path: str | os.PathLike,
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    attrs: Mapping[str, str] = {},
    varied: Mapping[str, Mapping[str, tuple[str, str, dict]]] = {},
) -> None:
    """Write all runs of a campaign to one netCDF-4 file, with one group for each study and arrays along labels.

    `docs/howto/dataset.md` describes the file. The file does not contain the maps of boundary elements.

    Parameters
    ----------
    runs : for each run, its labels (study, model, surface, seed, rms_slope, material), and its dataset or path. Names
        in the file have the order of the design. Seeds and slopes are sorted. A run counts as incomplete if it has the
        attribute `incomplete`, or if it lacks a snapshot that another run of its study has.
    path : the file to write. A file appears only when it is complete. The same runs give the same bytes.
    design : labels of all runs of the campaign. Default: the labels in `runs`. Other combinations of these labels have
        the status `not_in_design`.
    varied : for each study, its varied parameters by name: label on which the parameter depends (surface or material),
        unit, and value for each value of the label. They become coordinates.
    attrs : global attributes of the file (title, summary, campaign, license, …).

    Raises
    ------
    ValueError
        If a run is given twice or is not in the design; if runs differ in a value that they must share; if a file
        cannot be read. The message names the run.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=path.parent) as spool:
        studies = arrange_runs(spool_runs(runs, spool), design)
        with whole_file(path) as temporary, netCDF4.Dataset(temporary, "w") as file:
            origins = [each for study in studies for each in study.origins]
            names = [study.name for study in studies]
            described = combine_attributes("Campaign of rough contacts", _STUDIES, COLLECTED, origins)
            file.setncatts(described | {"comment": _ACCESS.format(", ".join(names), names[0])} | dict(attrs))
            # Writing is faster if all variables are defined first: see icha.datasets.files.
            groups = [
                define_group(file.createGroup(each.name), each, attrs, varied.get(each.name, {})) for each in studies
            ]
            for group in groups:
                _write(group, spool)


def _write(group: Group, spool: BinaryIO) -> None:
    """Write all values of a group; `spool` is the temporary file, from which runs are read block by block."""
    for variable, values in group.known:
        variable[...] = values
    along_ragged = {name for variables in group.ragged.values() for name in variables}
    written = dict.fromkeys(group.ragged, 0)
    shared = {
        name: np.full(column.variable.shape, column.fill, column.variable.dtype)
        for name, column in group.columns.items()
        if column.along != LABELS and name not in along_ragged
    }
    shape, lengths = group.study.known["status"].shape, np.array(group.block)
    placed = zip(group.study.entries, group.study.positions, strict=True)
    for start, members in itertools.groupby(placed, key=lambda each: tuple(each[1] // lengths * lengths)):
        box = tuple(slice(k, min(k + n, size)) for k, n, size in zip(start, lengths, shape, strict=True))
        sides = [side.stop - side.start for side in box]
        block = {
            name: np.full((*sides, *column.variable.shape[len(LABELS) :]), column.fill, column.variable.dtype)
            for name, column in group.columns.items()
            if column.along == LABELS
        }
        for entry, position in members:
            spool.seek(entry.place)
            snapshots = [group.study.snapshots[each] for each in entry.snapshots]
            values = {
                name: group.columns[name].pad(v) for name, (_, v) in pickle.load(spool).items() if name in group.columns
            }
            for name, v in values.items():
                column = group.columns[name]
                slots = column.slots(snapshots, v)
                if name in block:
                    block[name][*(position - start), ...][slots] = v
                elif name in shared:
                    index = (*(position[LABELS.index(label)] for label in column.along), *slots)
                    _put_shared(name, column, shared[name], index, v, entry.labels)
            for dim, variables in group.ragged.items():
                written[dim] += _write_ragged(dim, variables, written[dim], position, values, snapshots)
        for name, values in block.items():
            group.columns[name].variable[box] = values
    for name, values in shared.items():
        group.columns[name].variable[...] = values


def _write_ragged(
    dim: str,
    variables: Mapping[str, netCDF4.Variable],
    begin: int,
    position: np.ndarray,
    values: Mapping[str, np.ndarray],
    snapshots: list[int],
) -> int:
    """Write the values of a run along a ragged dimension, beginning at index `begin`; return the number of values.

    The spots of a run are sorted by the index of the snapshot in the file.
    """
    found = {name: values[name] for name in variables if name in values}
    count = len(next(iter(found.values()), ()))
    found |= {f"{dim}_{label}": np.full(count, k) for label, k in zip(LABELS, position, strict=True)}
    if "spot_snapshot" in found and count:
        found["spot_snapshot"] = np.asarray(snapshots, np.int32)[found["spot_snapshot"]]
        order = np.argsort(found["spot_snapshot"], kind="stable")
        found = {name: v[order] for name, v in found.items()}
    for name, v in found.items():
        variables[name][begin : begin + count] = v
    return count


def _put_shared(name: str, column: Column, known: np.ndarray, index: tuple, values: np.ndarray, run: RunLabels) -> None:
    """Store the values of a variable that is the same for several runs; raise ValueError if an earlier run differs."""
    present = known[index]
    unknown = present == column.fill
    equal = present == values if values.dtype.kind == "S" else np.isclose(present, values, rtol=_SAME, atol=0)
    if not np.all(unknown | equal):
        shared = ", ".join(column.along) or "the study"
        raise ValueError(f"{run}: {name} differs between runs that share {shared}; expected equal values")
    known[index] = np.where(unknown, values, present)
