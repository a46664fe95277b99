"""The campaign dataset, written run by run, so that only a few numbers of each run stay in memory.

The runs are read one after the other. Some facts of all runs are needed before the first run can be written: numbers of
steps and spots, snapshots, widths of texts. These facts stay in memory. The values of the runs go to a temporary file.
From there they are read in the order of the dataset, one block of neighbouring runs at a time.
"""

import itertools
import math
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import BinaryIO, NamedTuple

import netCDF4
import numpy as np
import xarray as xr

from icha.datasets.attributes import COLLECTED, combine_attributes
from icha.datasets.campaign_runs import Arrangement, Entry, arrange_runs, load_values, spool_runs
from icha.datasets.files import (
    FLOAT_FILL,
    INTEGER_FILL,
    characters,
    coordinates_of,
    define_dimensions,
    define_numbers,
    define_text,
    is_text,
)
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.results import COMPRESSION, LEAST_COMPRESSED
from icha.datasets.variables.campaign import CAMPAIGN, RAGGED, index_variable
from icha.datasets.variables.run import FURTHER
from icha.support.atomic_files import whole_file

# Largest number of runs in a block, and of values of each variable: a block takes some megabytes.
_RUNS_IN_BLOCK = 256
VALUES_IN_BLOCK = 2**18
_VALUES_IN_CHUNK = 2**16

_LAYOUT = (
    "Variables of the runs along model, surface, seed, rms_slope and material. Spots and events of all runs, in this "
    "order of the runs, are ragged arrays along spot and event: the variables with an instance_dimension say where "
    "along that dimension each belongs, from 0; those that agree in all of them are of one snapshot of one run."
)
_OWN_SLOPES = {"comment": "each surface has slopes of its own, along the dimension rms_slope in ascending order"}
_STUDIES = "The runs of every study, a group for each."
# Attribute of the root of the file, which has no variables.
_ACCESS = (
    "The data are in the groups, one for each study: {0}. With Python's xarray: "
    "xarray.open_datatree(FILE)['{1}'].to_dataset(), or xarray.open_dataset(FILE, group='{1}')"
)
# Variables of reasons, one for each run.
_REASONS = ("failure", "applicability")


class Column(NamedTuple):
    """A variable of the runs in the file.

    Attributes
    ----------
    variable : the variable.
    along : the labels that it varies with.
    dims : its further dimensions.
    fill : what stands for no value.
    """

    variable: netCDF4.Variable
    along: tuple[str, ...]
    dims: tuple[str, ...]
    fill: float | int | bytes

    def pad(self, values: np.ndarray) -> np.ndarray:
        """Pad texts of a run to the width that they have in the file; return numbers as they are."""
        if values.dtype.kind != "S":
            return values
        padded = np.zeros((*values.shape[:-1], self.variable.shape[-1]), "S1")
        padded[..., : values.shape[-1]] = values
        return padded

    def slots(self, snapshots: list[int], values: np.ndarray) -> tuple[list[int] | slice, ...]:
        """Index a run's values along `dims`; `snapshots` are the positions of its snapshots in the file."""
        sizes = zip(self.dims, values.shape, strict=False)
        return tuple(snapshots if dim == "snapshot" else slice(0, size) for dim, size in sizes)


class Group(NamedTuple):
    """The group of a study: its dimensions and variables are defined, and no values are written yet.

    Attributes
    ----------
    study : the runs that belong there.
    block : how many neighbouring runs are written at once, along every label.
    columns : the variables of the runs, by name.
    ragged : the variables along ragged dimensions, by dimension and name.
    known : variables whose values need no run, with these.
    texts : reasons, with that of each of the study's runs.
    """

    study: Arrangement
    block: tuple[int, ...]
    columns: dict[str, Column]
    ragged: dict[str, dict[str, netCDF4.Variable]]
    known: list[tuple[netCDF4.Variable, np.ndarray]]
    texts: list[tuple[netCDF4.Variable, list[str]]]


def define_group(group: netCDF4.Dataset, study: Arrangement, attrs: Mapping[str, str]) -> Group:
    """Define dimensions, variables and attributes of a study's group; `attrs` are those of the file."""
    sample = study.sample
    counts = {dim: int(study.sizes_of(dim).sum()) for dim in RAGGED if dim in sample.dims}
    sizes = dict(zip(LABELS, study.status.shape, strict=True)) | study.sizes | counts
    define_dimensions(group, sizes)
    # The checksum is that of the campaign, and not that of one of the runs.
    shared = {"license": sample.attrs.get("license"), "config_sha256": attrs.get("config_sha256")}
    group.setncatts(
        combine_attributes(f"Study {study.name}", _LAYOUT, COLLECTED, study.origins)
        | {"study": study.name}
        | {name: value for name, value in shared.items() if value is not None}
    )
    names = [name for name in sample.variables if name not in LABELS]
    dims = {name: sum(study.dims_of(name), ()) for name in names} | {label: (label,) for label in LABELS}
    dims |= {name: CAMPAIGN[name].dims for name in ("status", "step_count", *_REASONS)}
    dims |= {"rms_slope": study.slope_dims}
    coordinates = coordinates_of(sample.variables, {*sample.coords, *LABELS}, dims)

    def attributes_of(name: str, attributes: Mapping) -> dict:
        return {**attributes, **({"coordinates": coordinates[name]} if name in coordinates else {})}

    storage = _Storage.of(study, sizes, names)
    columns = {
        name: _define_column(
            group, study, storage, name, attributes_of(name, sample[name].attrs | _why_lacking(study, name))
        )
        for name in names
        if name not in sizes
    }
    described = {name: attributes_of(name, CAMPAIGN[name].attributes) for name in CAMPAIGN}
    known = [*_define_positions(group, study), *_define_of_campaign(group, study, storage, described)]
    texts = [
        (_define_reasons(group, storage, name, reasons, described[name]), reasons)
        for name, reasons in zip(
            _REASONS, (study.failures, [each.applicability for each in study.entries]), strict=True
        )
    ]
    ragged = {dim: {name: each.variable for name, each in columns.items() if each.dims == (dim,)} for dim in counts}
    for dim, variables in ragged.items():
        for label in LABELS:
            name, options = f"{dim}_{label}", storage.options((), (dim,))
            variables[name] = define_numbers(
                group, name, (dim,), np.int32, index_variable(dim, label).attributes, **options
            )
    return Group(study, storage.block, columns, ragged, known, texts)


class _Storage(NamedTuple):
    """How the variables of a group are stored.

    `sizes` are those of its dimensions, `block` is how many neighbouring runs make a block along every label.
    """

    sizes: dict[str, int]
    block: tuple[int, ...]

    @classmethod
    def of(cls, study, sizes, names):
        varying = [dims for along, dims in map(study.dims_of, names) if along == LABELS]
        largest = max(math.prod(sizes[dim] for dim in dims) for dims in varying)
        return cls(sizes, _block(sizes, LABELS, largest))

    def options(self, along, dims, width=None):
        """Return the options of a variable: none if it is small, else it is compressed, block by block."""
        shape = tuple(self.sizes[dim] for dim in dims) + (() if width is None else (width,))
        if math.prod(self.sizes[dim] for dim in along) * math.prod(shape) < LEAST_COMPRESSED:
            return {}
        block = self.block if along == LABELS else _block(self.sizes, along, math.prod(shape))
        chunk = (*block, *shape) if along else tuple(min(size, _VALUES_IN_CHUNK) for size in shape)
        # A block is written at once: nothing is gained from keeping more than one.
        return COMPRESSION | {"chunksizes": chunk, "chunk_cache": 8 * math.prod(chunk)}


def _block(sizes, along, values):
    """Count the neighbouring runs that make a block, along every label; each has so many values."""
    left = max(1, min(_RUNS_IN_BLOCK, VALUES_IN_BLOCK // max(1, values)))
    block = []
    for size in reversed([sizes[label] for label in along]):
        block.append(min(size, left))
        left = left // size if block[-1] == size else 1
    return tuple(reversed(block))


def _why_lacking(study, name):
    """Return the attribute of a variable that some of the study's models do not have."""
    owners = [model for model, names in FURTHER.items() if name in names]
    lacking = [model for model in study.axes["model"] if owners and model not in owners]
    return {"missing": f"of runs by {' and '.join(lacking)}"} if lacking else {}


def _define_column(group, study, storage, name, attributes):
    """Define a variable of the runs."""
    along, dims = study.dims_of(name)
    dtype = study.sample[name].dtype
    if is_text(dtype):
        width = study.widths[name]
        options = storage.options(along, dims, width)
        return Column(define_text(group, name, along + dims, width, attributes, **options), along, dims, b"")
    options, lacks = storage.options(along, dims), study.lacks(name)
    fill = FLOAT_FILL
    if dtype.kind != "f":
        # 32 bits, which every netCDF tool reads, or flags.
        dtype = np.dtype(np.int8 if dtype == np.int8 and not lacks else np.int32)
        fill = INTEGER_FILL if lacks else 0
    options |= {"fill_value": fill} if lacks else {}
    return Column(define_numbers(group, name, along + dims, dtype, attributes, **options), along, dims, fill)


def _define_reasons(group, storage, name, reasons, attributes):
    """Define a variable of texts, one for each run, as wide as the longest of them."""
    width = max(1, *(len(text.encode()) for text in reasons))
    return define_text(group, name, LABELS, width, attributes, **storage.options(LABELS, (), width))


def _define_positions(group, study):
    """Define the variables that number the positions along the dimensions of runs; return them with their values."""
    return [
        (define_numbers(group, dim, (dim,), np.int32, study.sample[dim].attrs), np.arange(size, dtype=np.int32))
        for dim, size in study.sizes.items()
        if dim in study.sample.variables
    ]


def _define_of_campaign(group, study, storage, described):
    """Define the variables that list the runs of the study; yield them with their values."""
    values = {"status": study.status, "step_count": study.step_count, **study.axes}
    for name, (dims, _, _, dtype, *_) in CAMPAIGN.items():
        if name in _REASONS:
            continue
        attributes = described[name]
        if dtype is str:
            texts = characters(np.array(values[name]))
            yield define_text(group, name, dims, texts.shape[-1], attributes), texts
            continue
        numbers = np.asarray(values[name], dtype)
        options = storage.options(dims, ()) if dims == LABELS else {}
        if name == "rms_slope":
            dims = study.slope_dims
            attributes = attributes | (_OWN_SLOPES if len(dims) > 1 else {})
            if np.isnan(numbers).any():
                options |= {"fill_value": FLOAT_FILL}
                numbers = np.nan_to_num(numbers, nan=FLOAT_FILL)
        yield define_numbers(group, name, dims, numbers.dtype, attributes, **options), numbers


def write_campaign(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    path: str | os.PathLike,
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    settings: Mapping[RunLabels | tuple, str] = {},
    attrs: Mapping[str, str] = {},
) -> None:
    """Write all runs of a campaign to one netCDF-4 file: a group per study, full arrays along the labels of the runs.

    The groups have the dimensions model, surface, seed, rms_slope and material, and those of the run dataset; the maps
    of boundary elements stay in the files of the runs. Beyond the `step_count` steps of a run, numbers are missing and
    texts empty. Spots and events of all runs stand one after the other along `spot` and `event`; `spot_snapshot`,
    `spot_model`, `event_model` and so on are positions along these dimensions, from 0. For every combination of labels,
    `status` is complete, incomplete, missing, not in the design or failed checks; `failure` is why a run is incomplete
    or which checks failed, `applicability` why its model is not applicable. Values that an incomplete run, a missing
    run or a run of another model does not have are missing.

    Parameters
    ----------
    runs : pairs of labels (study, model, surface, seed, rms_slope, material) and run dataset, or its file. Names keep
        the order in which they appear in the design, seeds and slopes are sorted. A run is incomplete if it has an
        attribute `incomplete`, with the reason, if it did not converge, or if it lacks snapshots of its study.
    path : the file, which appears whole or not at all. The same runs give the same bytes.
    design : labels of the runs of the campaign; those of `runs` if left out. Other combinations of their labels are not
        in the design.
    settings : expected checksums of the settings of runs (their attribute `config_sha256`), by their labels.
    attrs : global attributes of the file (title, summary, campaign, license, …).

    Raises
    ------
    ValueError
        Naming the run: if it is given twice, is not in the design, has other labels than its dataset, was computed with
        other settings than it should, holds a value that is not finite, or does not fit its study's other runs; if a
        study has no run; if a file cannot be read.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=path.parent) as spool:
        studies = arrange_runs(spool_runs(runs, spool, settings), design)
        with whole_file(path) as temporary, netCDF4.Dataset(temporary, "w") as file:
            origins = [each for study in studies for each in study.origins]
            names = [study.name for study in studies]
            described = combine_attributes("Campaign of rough contacts", _STUDIES, COLLECTED, origins)
            file.setncatts(described | {"comment": _ACCESS.format(", ".join(names), names[0])} | dict(attrs))
            # All is defined before anything is written, which is quicker: see icha.datasets.files.
            groups = [define_group(file.createGroup(study.name), study, attrs) for study in studies]
            for group in groups:
                _write(group, spool)


def _write(group: Group, spool: BinaryIO) -> None:
    """Write all values of a group; the values of the runs are read from the temporary file, block by block."""
    for variable, values in group.known:
        variable[...] = values
    for variable, reasons in group.texts:
        for position, reason in zip(group.study.positions, reasons, strict=True):
            if reason:
                text = characters(np.array(reason))
                variable[(*position, slice(0, len(text)))] = text
    shared = {
        name: _SharedVariable(name, column)
        for name, column in group.columns.items()
        if column.along != LABELS and not set(column.dims) & set(RAGGED)
    }
    ragged = [_RaggedVariables(dim, variables) for dim, variables in group.ragged.items()]
    placed = zip(group.study.entries, map(tuple, group.study.positions.tolist()), strict=True)
    for start, members in itertools.groupby(
        placed, key=lambda each: tuple(k // n * n for k, n in zip(each[1], group.block, strict=True))
    ):
        _write_block(group, start, members, spool, shared, ragged)
    for each in ragged:
        each.flush()
    for each in shared.values():
        if not each.is_large:
            each.column.variable[...] = each.values


def _write_block(
    group: Group,
    start: tuple[int, ...],
    members: Iterable[tuple[Entry, tuple[int, ...]]],
    spool: BinaryIO,
    shared: Mapping[str, "_SharedVariable"],
    ragged: Iterable["_RaggedVariables"],
) -> None:
    """Write a block of neighbouring runs, except shared and ragged variables, which are kept for later."""
    corner = zip(start, group.block, group.study.status.shape, strict=True)
    box = tuple(slice(k, min(k + n, size)) for k, n, size in corner)
    lengths = tuple(side.stop - side.start for side in box)
    block = {
        name: np.full(lengths + column.variable.shape[len(LABELS) :], column.fill, column.variable.dtype)
        for name, column in group.columns.items()
        if column.along == LABELS
    }
    for entry, position in members:
        snapshots = [group.study.snapshots[each] for each in entry.snapshots]
        place = dict(zip(LABELS, position, strict=True))
        values = {
            name: group.columns[name].pad(v)
            for name, (_, v) in load_values(entry, spool).items()
            if name in group.columns
        }
        for name, v in values.items():
            column = group.columns[name]
            slots = column.slots(snapshots, v)
            if name in block:
                block[name][(*np.subtract(position, start), ...)][slots] = v
            elif name in shared:
                shared[name].put(entry.labels, tuple(place[label] for label in column.along), slots, v)
        for each in ragged:
            each.add(position, values, snapshots)
    for name, values in block.items():
        group.columns[name].variable[box] = values


class _SharedVariable:
    """A variable that several runs share: the first of them gives its values, the others must have the same.

    Attributes
    ----------
    name, column : the variable.
    values : of all places; few enough to stay in memory.
    known : which places, and snapshots, have values.
    is_large : True for arrays along labels, which are written one by one; others are written at the end.
    """

    def __init__(self, name: str, column: Column):
        """Begin without values."""
        self.name, self.column = name, column
        shape, snapshot = column.variable.shape, column.dims.index("snapshot") + 1 if "snapshot" in column.dims else 0
        self.is_large = bool(column.dims and column.along)
        self.values = np.full(shape, column.fill, column.variable.dtype)
        self.known = np.zeros(shape[: len(column.along) + snapshot], bool)

    def put(self, labels: RunLabels, place: tuple[int, ...], slots: tuple, values: np.ndarray) -> None:
        """Store the values of a run; if these labels have values already, check that both are equal."""
        index = (*place, *slots)
        known, present = self.known[index[: self.known.ndim]], self.values[index]
        if np.all(known) and np.array_equal(present, values):
            return
        same = present == values if values.dtype.kind == "S" else np.isclose(present, values, rtol=1e-9, atol=0)
        if np.any(known & ~np.reshape(same, (*np.shape(known), -1)).all(axis=-1)):
            shared = ", ".join(self.column.along) or "the study"
            raise ValueError(f"{labels}: {self.name} differs between runs that share {shared}")
        if not np.all(known):
            self.values[index] = values
            self.known[index[: self.known.ndim]] = True
            if self.is_large:
                self.column.variable[index] = values


class _RaggedVariables:
    """The variables along one ragged dimension, to which the values of the runs are appended.

    Attributes
    ----------
    dim, variables : the dimension and its variables, by name.
    runs, pending : values of the runs that are not yet written, and their number.
    written : number of values along the dimension that are written.
    """

    def __init__(self, dim: str, variables: Mapping[str, netCDF4.Variable]):
        """Begin with nothing written."""
        self.dim, self.variables = dim, variables
        self.runs, self.pending, self.written = [], 0, 0

    def add(self, position: tuple[int, ...], values: Mapping[str, np.ndarray], snapshots: list[int]) -> None:
        """Store the values of a run at a position; its spots are sorted by the positions of their snapshots."""
        found = {name: values[name] for name in self.variables if name in values}
        count = len(next(iter(found.values()), ()))
        if not count:
            return
        if "spot_snapshot" in found:
            found["spot_snapshot"] = np.asarray(snapshots, np.int32)[found["spot_snapshot"]]
            order = np.argsort(found["spot_snapshot"], kind="stable")
            found = {name: v[order] for name, v in found.items()}
        found |= {f"{self.dim}_{label}": np.full(count, k) for label, k in zip(LABELS, position, strict=True)}
        self.runs.append(found)
        self.pending += len(found) * count
        if self.pending > VALUES_IN_BLOCK:
            self.flush()

    def flush(self) -> None:
        """Write what has been added since the last time."""
        if not self.runs:
            return
        for name, variable in self.variables.items():
            values = np.concatenate([run[name] for run in self.runs])
            variable[self.written : self.written + len(values)] = values
        self.written += len(values)
        self.runs, self.pending = [], 0
