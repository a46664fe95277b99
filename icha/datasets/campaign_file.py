"""The campaign dataset, written run by run: memory does not grow with the runs, but for a few numbers of each.

The runs are taken one after the other. What is needed of all before the first can be written (how many steps and spots
there are, which snapshots, how long the texts) is noted; their values go to a temporary file, from which they are taken
in the order of the dataset, a block of neighbouring runs at a time.
"""

import itertools
import math
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

import netCDF4
import numpy as np
import xarray as xr

from icha.datasets.attributes import COLLECTED, collected
from icha.datasets.campaign_runs import Arrangement, Entry, arranged, spooled, values_back
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
from icha.datasets.variables.campaign import CAMPAIGN, RAGGED, place_of
from icha.datasets.variables.run import FURTHER
from icha.support.atomic_files import whole_file

# A block holds at most so many runs, and of each variable so many values: some megabytes of all together.
_RUNS_IN_BLOCK = 256
VALUES_IN_BLOCK = 2**18
_VALUES_IN_CHUNK = 2**16

_LAYOUT = (
    "Variables of the runs along model, surface, seed, rms_slope and material. Spots and events of all runs, in this "
    "order of the runs, are ragged arrays along spot and event: the variables with an instance_dimension say where "
    "along that dimension each belongs, from 0; those that agree in all of them are of one snapshot of one run."
)
_OWN_SLOPES = {"comment": "each surface has slopes of its own, along the dimension rms_slope in ascending order"}
# Of what runs share, values at so many places are kept at most.
_LATEST = 256
_STUDIES = "The runs of every study, a group for each."


class Column(NamedTuple):
    """A variable of the runs in the file: the labels it varies with, its own dimensions, what stands for no value."""

    variable: netCDF4.Variable
    along: tuple[str, ...]
    own: tuple[str, ...]
    fill: float | int | bytes

    def fitting(self, dims: tuple[str, ...], values: np.ndarray) -> np.ndarray:
        """A run's values with their dimensions in the order of the file's, texts of the file's width."""
        if dims != self.own:
            values = np.moveaxis(values, [dims.index(dim) for dim in self.own], range(len(self.own)))
        if values.dtype.kind == "S":
            whole = np.zeros((*values.shape[:-1], self.variable.shape[-1]), "S1")
            whole[..., : values.shape[-1]] = values
            return whole
        return values

    def places(self, snapshots: list[int], values: np.ndarray) -> tuple[list[int] | slice, ...]:
        """Where a run's values stand along the own dimensions; its snapshots are those at the positions given."""
        sizes = zip(self.own, values.shape, strict=False)
        return tuple(snapshots if dim == "snapshot" else slice(0, size) for dim, size in sizes)


@dataclass(frozen=True, eq=False)
class Group:
    """A study's group, defined and empty.

    study : what belongs there. block : how many neighbouring runs are written at once, along every label. columns : the
    variables of the runs. places : of what is ragged, by dimension and label, to which run it belongs. known :
    variables whose values need no run, with these. texts : reasons, by name, with what each of the study's runs has.
    """

    study: Arrangement
    block: tuple[int, ...]
    columns: dict[str, Column]
    places: dict[tuple[str, str], netCDF4.Variable]
    known: list[tuple[netCDF4.Variable, np.ndarray]]
    texts: list[tuple[netCDF4.Variable, list[str]]]


def define_group(group: netCDF4.Dataset, study: Arrangement, attrs: Mapping[str, str]) -> Group:
    """Make dimensions, variables and attributes of a study's group; `attrs` are those of the file."""
    sample = study.sample
    counts = {dim: int(study.sizes_of(dim).sum()) for dim in RAGGED if dim in sample.dims}
    sizes = dict(zip(LABELS, study.status.shape, strict=True)) | study.sizes | counts
    define_dimensions(group, sizes)
    own = {"study": study.name} | {name: sample.attrs[name] for name in ("license",) if name in sample.attrs}
    # Not the checksum of one of its runs.
    own |= {name: attrs[name] for name in ("config_sha256",) if name in attrs}
    group.setncatts(collected(f"Study {study.name}", _LAYOUT, COLLECTED, study.origins) | own)

    names = [name for name in sample.variables if name not in LABELS]
    dims = {name: sum(study.dims_of(name), ()) for name in names} | {label: (label,) for label in LABELS}
    dims |= {name: CAMPAIGN[name].dims for name in ("status", "step_count", "failure", "applicability")}
    dims |= {"rms_slope": study.slope_dims}
    coordinates = coordinates_of(sample.variables, {*sample.coords, *LABELS}, dims)
    storage = _Storage.of(study, sizes, names)
    columns = {}
    for name in names:
        if name not in sizes:
            attributes = (
                sample[name].attrs
                | _why_lacking(study, name)
                | ({"coordinates": coordinates[name]} if name in coordinates else {})
            )
            columns[name] = _define_column(group, study, storage, name, attributes)
    described = {
        name: CAMPAIGN[name].attributes | ({"coordinates": coordinates[name]} if name in coordinates else {})
        for name in CAMPAIGN
    }
    known = [*_define_numbers_along(group, study), *_define_of_campaign(group, study, storage, described)]
    texts = [
        (_define_reasons(group, storage, name, own, described[name]), own)
        for name, own in (
            ("failure", study.failures),
            ("applicability", [entry.applicability for entry in study.entries]),
        )
    ]
    places = {
        (dim, label): define_numbers(
            group, f"{dim}_{label}", (dim,), np.int32, place_of(dim, label).attributes, **storage.options((), (dim,))
        )
        for dim in counts
        for label in LABELS
    }
    return Group(study, storage.block, columns, places, known, texts)


@dataclass(frozen=True)
class _Storage:
    """How variables of a group are stored: sizes of its dimensions, and how many neighbouring runs make a block."""

    sizes: dict[str, int]
    block: tuple[int, ...]

    @classmethod
    def of(cls, study, sizes, names):
        varying = [own for along, own in map(study.dims_of, names) if along == LABELS]
        largest = max(math.prod(sizes[dim] for dim in own) for own in varying)
        return cls(sizes, _block(sizes, LABELS, largest))

    def options(self, along, own, width=None):
        """Options of a variable: none if it is small, else it is compressed, block by block."""
        shape = tuple(self.sizes[dim] for dim in own) + (() if width is None else (width,))
        if math.prod(self.sizes[dim] for dim in along) * math.prod(shape) < LEAST_COMPRESSED:
            return {}
        block = self.block if along == LABELS else _block(self.sizes, along, math.prod(shape))
        chunk = (*block, *shape) if along else tuple(min(size, _VALUES_IN_CHUNK) for size in shape)
        # A block is written at once: nothing is gained from keeping more than one.
        return COMPRESSION | {"chunksizes": chunk, "chunk_cache": 8 * math.prod(chunk)}


def _block(sizes, along, values):
    """How many neighbouring runs make a block, along every label; of each there are so many values."""
    left = max(1, min(_RUNS_IN_BLOCK, VALUES_IN_BLOCK // max(1, values)))
    block = []
    for size in reversed([sizes[label] for label in along]):
        block.append(min(size, left))
        left = left // size if block[-1] == size else 1
    return tuple(reversed(block))


def _why_lacking(study, name):
    """Attribute of a variable that some of the study's models do not have."""
    owners = [model for model, own in FURTHER.items() if name in own]
    lacking = [model for model in study.axes["model"] if owners and model not in owners]
    return {"missing": f"of runs by {' and '.join(lacking)}"} if lacking else {}


def _define_column(group, study, storage, name, attributes):
    """Make a variable of the runs."""
    along, own = study.dims_of(name)
    dtype = study.sample[name].dtype
    if is_text(dtype):
        width = study.widths[name]
        options = storage.options(along, own, width)
        return Column(define_text(group, name, along + own, width, attributes, **options), along, own, b"")
    options, lacks = storage.options(along, own), study.lacks(name)
    fill = FLOAT_FILL
    if dtype.kind != "f":
        # 32 bits, which every netCDF tool reads, or flags.
        dtype = np.dtype(np.int8 if dtype == np.int8 and not lacks else np.int32)
        fill = INTEGER_FILL if lacks else 0
    options |= {"fill_value": fill} if lacks else {}
    return Column(define_numbers(group, name, along + own, dtype, attributes, **options), along, own, fill)


def _define_reasons(group, storage, name, own, attributes):
    """Make a variable of texts, one for each run, as wide as the longest of its `own` texts."""
    width = max(1, *(len(text.encode()) for text in own))
    return define_text(group, name, LABELS, width, attributes, **storage.options(LABELS, (), width))


def _define_numbers_along(group, study):
    """Make the variables that number the positions along the dimensions of runs, and give them with their values."""
    for dim, size in study.sizes.items():
        if dim in study.sample.variables:
            variable = define_numbers(group, dim, (dim,), np.int32, study.sample[dim].attrs)
            yield variable, np.arange(size, dtype=np.int32)


def _define_of_campaign(group, study, storage, described):
    """Make the variables that say what runs there are, and give them with their values."""
    values = {"status": study.status, "step_count": study.step_count, **study.axes}
    for name, (dims, _, _, dtype, *_) in CAMPAIGN.items():
        if name in ("failure", "applicability"):
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

    The groups have the dimensions model, surface, seed, rms_slope and material, and those of the run dataset but for
    those of the maps of boundary elements, which stay in the files of the runs. A run has `step_count` steps; beyond
    them, along `step`, numbers are missing and texts empty. Spots and events of all runs stand one after the other
    along `spot` and `event`; `spot_model`, `spot_surface`, `spot_seed`, `spot_rms_slope` and `spot_material`,
    `event_model` and so on, and `spot_snapshot`, are positions along these dimensions, from 0. `status(model, surface,
    seed, rms_slope, material)` says of every combination whether its run is complete, incomplete,
    missing, not in the design or no result because its checks failed; `failure` says why it is incomplete or which
    checks failed, `applicability` why its model is not applicable. What is not known of an incomplete run, and
    everything of those that are not there, is missing; so is what only runs of another model have.

    Parameters
    ----------
    runs : pairs of labels (study, model, surface, seed, rms_slope, material) and run dataset, or its file. Studies,
        models, surfaces and materials keep the order in which they first come in the design, seeds and slopes are
        sorted. A run that failed has the reason in its attribute `incomplete`; one that did not converge or lacks
        snapshots that others
        of its study have is incomplete, too.
    path : the file, which appears whole or not at all. The same runs give the same bytes.
    design : labels of the runs that were asked for; those given, if left out. Other combinations of their labels are
        not in the design.
    settings : checksums of the settings that runs are to have been computed with (their attribute `config_sha256`), by
        their labels.
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
        studies = arranged(spooled(runs, spool, settings), design)
        with whole_file(path) as temporary, netCDF4.Dataset(temporary, "w") as file:
            origins = [each for study in studies for each in study.origins]
            own = collected("Campaign of rough contacts", _STUDIES, COLLECTED, origins)
            file.setncatts(own | {"comment": _where([study.name for study in studies])} | dict(attrs))
            # All is defined before anything is written, which is quicker: see icha.datasets.files.
            groups = [define_group(file.createGroup(study.name), study, attrs) for study in studies]
            for group in groups:
                _write(group, spool)


def _where(studies: list[str]) -> str:
    """Where in the file the data are: who opens its root alone sees nothing else."""
    return (
        f"The data are in the groups, one for each study: {', '.join(studies)}. With Python's xarray: "
        f"xarray.open_datatree(FILE)['{studies[0]}'].to_dataset(), or xarray.open_dataset(FILE, group='{studies[0]}')"
    )


def _write(group: Group, spool: BinaryIO) -> None:
    """Write all values of a group, those of the runs from the spool, block by block."""
    for variable, values in group.known:
        variable[...] = values
    for variable, own in group.texts:
        for position, reason in zip(group.study.positions, own, strict=True):
            if reason:
                text = characters(np.array(reason))
                variable[(*position, slice(0, len(text)))] = text
    common = {name: _Common(name, column) for name, column in group.columns.items() if _is_common(column)}
    ragged = _Ragged(group)
    for start, members in _blocks(group):
        _write_block(group, start, members, spool, common, ragged)
    ragged.flush()
    for each in common.values():
        each.flush()


def _write_block(group, start, members, spool, common, ragged):
    """Write a block of neighbouring runs, but for what is kept for later: what they share, and what is ragged."""
    corner = zip(start, group.block, group.study.status.shape, strict=True)
    box = tuple(slice(k, min(k + n, size)) for k, n, size in corner)
    lengths = tuple(side.stop - side.start for side in box)
    block = {
        name: np.full(lengths + column.variable.shape[len(LABELS) :], column.fill, column.variable.dtype)
        for name, column in group.columns.items()
        if column.along == LABELS
    }
    for entry, position in members:
        at = [group.study.snapshots[each] for each in entry.snapshots]
        place = dict(zip(LABELS, position, strict=True))
        values = {
            name: group.columns[name].fitting(*own)
            for name, own in values_back(entry, spool).items()
            if name in group.columns
        }
        for name, v in values.items():
            column = group.columns[name]
            own = column.places(at, v)
            if name in block:
                block[name][(*np.subtract(position, start), ...)][own] = v
            elif name in common:
                common[name].put(entry.labels, tuple(place[label] for label in column.along), own, v)
        ragged.add(position, values, at)
    for name, values in block.items():
        group.columns[name].variable[box] = values


def _is_common(column):
    return column.along != LABELS and not set(column.own) & set(RAGGED)


def _blocks(group: Group) -> Iterator[tuple[tuple[int, ...], list[tuple[Entry, tuple[int, ...]]]]]:
    """Where every block begins that has runs, and these with their positions."""
    placed = zip(group.study.entries, map(tuple, group.study.positions.tolist()), strict=True)
    for start, members in itertools.groupby(
        placed, key=lambda each: tuple(k // n * n for k, n in zip(each[1], group.block, strict=True))
    ):
        yield start, list(members)


class _Common:
    """A variable that several runs share: the first of them says what it is, the others must agree."""

    def __init__(self, name: str, column: Column):
        """Nothing is known yet."""
        self.name, self.column = name, column
        shape, at = column.variable.shape, column.own.index("snapshot") + 1 if "snapshot" in column.own else 0
        self.known = np.zeros(shape[: len(column.along) + at], bool)
        # A number of each run is kept in memory, arrays of each are read from the file again.
        self.held = column.variable
        if not column.own or not column.along:
            self.held = np.full(shape, column.fill, column.variable.dtype)
        # What was last taken or found to agree, by place.
        self.latest: dict[tuple[int, ...], tuple[tuple, np.ndarray]] = {}

    def put(self, labels: RunLabels, place: tuple[int, ...], own: tuple, values: np.ndarray) -> None:
        """Take the values of a run, or compare them."""
        latest = self.latest.get(place)
        if latest and latest[0] == own and np.array_equal(latest[1], values):
            return
        known = self.known[(*place, *own)[: self.known.ndim]]
        if np.any(known):
            there = self.held[(*place, *own)]
            same = there == values if values.dtype.kind == "S" else np.isclose(there, values, rtol=1e-9, atol=0)
            if np.any(known & ~np.reshape(same, (*np.shape(known), -1)).all(axis=-1)):
                shared = ", ".join(self.column.along) or "the study"
                raise ValueError(f"{labels}: {self.name} differs between runs that share {shared}")
        if not np.all(known):
            self.held[(*place, *own)] = values
            self.known[(*place, *own)[: self.known.ndim]] = True
        if len(self.latest) == _LATEST:
            self.latest.clear()
        self.latest[place] = own, values

    def flush(self) -> None:
        """Write what is kept in memory."""
        if self.held is not self.column.variable:
            self.column.variable[...] = self.held


class _Ragged:
    """What the runs have along ragged dimensions, one after the other."""

    def __init__(self, group: Group):
        """Nothing is written yet."""
        dims = dict.fromkeys(dim for dim, _ in group.places)
        self.written = dict.fromkeys(dims, 0)
        self.variables = {
            dim: {name: column.variable for name, column in group.columns.items() if column.own == (dim,)}
            | {f"{dim}_{label}": group.places[dim, label] for label in LABELS}
            for dim in dims
        }
        self._empty()

    def _empty(self):
        self.parts = {dim: {name: [] for name in variables} for dim, variables in self.variables.items()}
        self.taken = 0

    def add(self, position: tuple[int, ...], values: dict[str, np.ndarray], at: list[int]) -> None:
        """Take what a run has; `at` is where its snapshots stand, in whose order its spots are put."""
        for dim, parts in self.parts.items():
            own = {name: values[name] for name in parts if name in values}
            count = max(map(len, own.values()), default=0)
            if "spot_snapshot" in own and count:
                now = np.asarray(at, np.int32)[own["spot_snapshot"]]
                order = np.argsort(now, kind="stable")
                own = {name: v[order] for name, v in (own | {"spot_snapshot": now}).items()}
            own |= {f"{dim}_{label}": np.full(count, k) for label, k in zip(LABELS, position, strict=True)}
            for name, v in own.items():
                parts[name].append(v)
                self.taken += count
        if self.taken > VALUES_IN_BLOCK:
            self.flush()

    def flush(self) -> None:
        """Write what has been taken since the last time."""
        for dim, parts in self.parts.items():
            for name, values in parts.items():
                joined = np.concatenate(values) if values else np.empty(0)
                end = self.written[dim] + len(joined)
                if len(joined):
                    self.variables[dim][name][self.written[dim] : end] = joined
            self.written[dim] = end
        self._empty()
