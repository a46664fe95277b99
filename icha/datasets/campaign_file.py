"""The campaign dataset, written run by run: memory does not grow with the runs, but for a few numbers of each.

The runs are taken one after the other. What is needed of all before the first can be written (how many steps and spots
there are, which snapshots, how long the texts) is noted; their values go to a temporary file, from which they are taken
in the order of the dataset, a block of neighbouring runs at a time.
"""

from __future__ import annotations

import itertools
import math
import os
import pickle
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

import netCDF4
import numpy as np
import xarray as xr

from icha.datasets.attributes import COLLECTED, collected
from icha.datasets.bins import bin_table
from icha.datasets.files import (
    COMPLETE,
    INCOMPLETE,
    MISSING,
    NOT_IN_DESIGN,
    STATUS_ATTRIBUTES,
    Values,
    read_run,
    read_run_values,
)
from icha.datasets.labels import RunLabels
from icha.datasets.netcdf import (
    COMPRESSION,
    FLOAT_FILL,
    INTEGER_FILL,
    LEAST_COMPRESSED,
    characters,
    coordinates_of,
    define_dimensions,
    define_numbers,
    define_text,
    is_text,
)
from icha.support.atomic_files import whole_file

LABELS = ("surface", "seed", "rms_slope", "material")

# What a quantity of a run can depend on; everything else depends on all four labels. The snapshots' targets are those
# of the study's path, the bins are fixed in units of h_rms and of E* h'_rms.
_VARIES_WITH = {
    "contact_modulus": ("material",),
    "surface_energy": ("material",),
    "interaction_range": ("material",),
    "rms_height": ("surface", "seed", "rms_slope"),
    "rms_curvature": ("surface", "seed", "rms_slope"),
    "spectral_moment_0": ("surface", "seed", "rms_slope"),
    "spectral_moment_2": ("surface", "seed", "rms_slope"),
    "spectral_moment_4": ("surface", "seed", "rms_slope"),
    "nayak_parameter": ("surface", "seed", "rms_slope"),
    "period": ("surface",),
    "grid": ("surface",),
    "boundary": ("surface",),
    **dict.fromkeys(bin_table("gap", "m"), ("surface", "seed", "rms_slope")),
    **dict.fromkeys(bin_table("pressure", "Pa"), ("rms_slope", "material")),
    "snapshot_kind": (),
    "snapshot_target": (),
    "control": (),
}
# Of these every run has as many as it has: in the campaign they stand one after the other.
RAGGED = ("spot", "event")

# A block holds at most so many runs, and of each variable so many values: some megabytes of all together.
_RUNS_IN_BLOCK = 256
_VALUES_IN_BLOCK = 2**18
_VALUES_IN_CHUNK = 2**16


def write_campaign(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    path: str | os.PathLike,
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    attrs: Mapping[str, str] = {},
) -> None:
    """Write all runs of a campaign to one netCDF-4 file: a group per study, full arrays along the labels of the runs.

    The groups have the dimensions surface, seed, rms_slope and material, and those of the run dataset. A run has
    `step_count` steps; beyond them, along `step`, numbers are missing and texts empty. Spots and events of all runs
    stand one after the other along `spot` and `event`; `spot_surface`, `spot_seed`, `spot_rms_slope` and
    `spot_material`, `event_surface` and so on, and `spot_snapshot`, are positions along these dimensions, from 0.
    `status(surface, seed, rms_slope, material)` says of every combination whether its run is complete, incomplete,
    missing or not in the design; `failure` says why a run is incomplete. What is not known of an incomplete run, and
    everything of those that are not there, is missing.

    Parameters
    ----------
    runs : pairs of labels (study, surface, seed, rms_slope, material) and run dataset, or its file. Studies, surfaces
        and materials keep the order in which they first come in the design, seeds and slopes are sorted. A run that
        failed has the reason in its attribute `incomplete`; one that did not converge or lacks snapshots that others
        of its study have is incomplete, too.
    path : the file, which appears whole or not at all. The same runs give the same bytes.
    design : labels of the runs that were asked for; those given, if left out. Other combinations of their labels are
        not in the design.
    attrs : global attributes of the file (title, summary, campaign, license, …).

    Raises
    ------
    ValueError
        Naming the run: if it is given twice, is not in the design, has other labels than its dataset, holds a value
        that is not finite, or does not fit its study's other runs; if a study has no run; if a file cannot be read.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=path.parent) as spool:
        studies = _arranged(_taken(runs, spool), design)
        with whole_file(path) as temporary, netCDF4.Dataset(temporary, "w") as file:
            models = [study.model.attrs for study in studies]
            described = collected("Campaign of rough contacts", _STUDIES, COLLECTED, models)
            file.setncatts(described | dict(attrs))
            # All is defined before anything is written, which is quicker: see icha.datasets.netcdf.
            groups = [_Group(file.createGroup(study.name), study, attrs) for study in studies]
            for group in groups:
                group.write(spool)


class _Entry(NamedTuple):
    """What is kept in memory of one run: what it is called and has, and where its values are in the spool."""

    labels: RunLabels
    place: int
    names: frozenset[str]
    sizes: tuple[tuple[str, int], ...]
    snapshots: tuple[tuple[bytes, float], ...]
    failure: str

    def size(self, dim: str) -> int:
        """Size of a dimension of the run, 0 if it has none of that name."""
        return dict(self.sizes).get(dim, 0)


@dataclass
class _Members:
    """The runs of a study as they come, the widths of their texts in bytes, and a run that shows what a study has."""

    entries: dict[RunLabels, _Entry] = field(default_factory=dict)
    widths: dict[str, int] = field(default_factory=dict)
    model: xr.Dataset | str | os.PathLike | None = None
    rank: tuple = ()


def _taken(runs, spool: BinaryIO) -> dict[str, _Members]:
    """Note of every run what is needed of all, and put its values into the spool."""
    studies: dict[str, _Members] = {}
    # Most runs have the same variables, sizes and snapshots, which are then kept once.
    shared: dict = {}
    for labels, source in runs:
        labels = _plain(labels)
        members = studies.setdefault(labels.study, _Members())
        if labels in members.entries:
            raise ValueError(f"{labels}: this run is given twice")
        values, attrs = _values_of(source) if isinstance(source, xr.Dataset) else read_run_values(source)
        _check_labels(labels, values)
        _refuse_values_not_finite(labels, values)
        sizes = {dim: n for dims, v in values.values() for dim, n in zip(dims, v.shape, strict=False)}
        alike = frozenset(values), tuple(sorted(sizes.items())), _snapshots(values)
        alike = (shared.setdefault(each, each) for each in alike)
        members.entries[labels] = _Entry(labels, spool.tell(), *alike, _failure(values, attrs))
        pickle.dump(values, spool, protocol=5)
        for name, (_, v) in values.items():
            if is_text(v.dtype):
                members.widths[name] = max(members.widths.get(name, 1), v.shape[-1])
        # Of a run that ended early some variables may be unknown: what it would have reached at the end.
        rank = ("incomplete" not in attrs, sizes.get("step", 0))
        if members.model is None or rank > members.rank:
            members.model, members.rank = source, rank
    if not studies:
        raise ValueError("a campaign dataset needs at least one run")
    return studies


def _plain(labels) -> RunLabels:
    """Labels with numbers of Python's own types."""
    labels = RunLabels(*labels)
    return labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))


def _values_of(run: xr.Dataset) -> tuple[Values, dict]:
    """What `icha.datasets.files.read_run_values` gives of a run's file, of the run itself."""
    values = {
        name: (variable.dims, characters(variable.values) if is_text(variable.dtype) else variable.values)
        for name, variable in run.variables.items()
    }
    return values, run.attrs


def _failure(values, attrs) -> str:
    """Why a run did not reach its end; an empty text if it did."""
    if "incomplete" in attrs:
        return str(attrs["incomplete"])
    failed = int(np.sum(values["converged"][1] != 1)) if "converged" in values else 0
    return f"{failed} of its steps did not converge" if failed else ""


def _check_labels(labels, values):
    for label, tolerance in (("rms_slope", 1e-6), ("seed", 0)):
        if label in values:
            value, named = float(values[label][1]), float(getattr(labels, label))
            if abs(value - named) > tolerance * abs(named):
                raise ValueError(f"{labels}: the dataset's {label} is {value:g}")


def _refuse_values_not_finite(labels, values):
    for name, (dims, v) in values.items():
        if v.dtype.kind == "f" and not np.isfinite(v).all():
            bad = np.argwhere(~np.isfinite(v))
            first = ", ".join(f"{dim}={index}" for dim, index in zip(dims, bad[0], strict=True))
            raise ValueError(
                f"{labels}: variable {name!r} holds {len(bad)} of {v.size} values that are not finite"
                + (f", the first at {first}" if first else "")
            )


def _snapshots(values):
    """Kind and target of a run's snapshots."""
    if "snapshot_kind" not in values:
        return ()
    kinds = values["snapshot_kind"][1]
    return tuple(
        zip((kind.tobytes().rstrip(b"\0") for kind in kinds), values["snapshot_target"][1].tolist(), strict=True)
    )


def _arranged(studies: dict[str, _Members], design) -> list[_Study]:
    """How the runs of every study lie in its group."""
    asked = {name: list(members.entries) for name, members in studies.items()}
    if design is not None:
        asked = {}
        for labels in dict.fromkeys(map(_plain, design)):
            asked.setdefault(labels.study, []).append(labels)
    if odd := [labels for name, members in studies.items() if name not in asked for labels in members.entries]:
        raise ValueError(f"{odd[0]}: this run is not in the design")
    for name in asked:
        if name not in studies:
            raise ValueError(f"study {name}: there is no run of it")
    return [_Study(name, studies[name], labels) for name, labels in asked.items()]


class _Study:
    """How the runs of a study lie in its group: axes, sizes, the runs in the order of the axes, what became of them."""

    def __init__(self, name: str, members: _Members, design: list[RunLabels]):
        """Arrange the runs; refuse those that do not fit together."""
        self.name, self.widths = name, members.widths
        self.axes = {
            label: list(dict.fromkeys(getattr(labels, label) for labels in design)) for label in ("surface", "material")
        } | {label: sorted({getattr(labels, label) for labels in design}) for label in ("seed", "rms_slope")}
        self.shape = tuple(len(self.axes[label]) for label in LABELS)
        at = [{value: k for k, value in enumerate(self.axes[label])} for label in LABELS]
        position = {labels: tuple(k[value] for k, value in zip(at, labels[1:], strict=True)) for labels in design}
        if odd := [labels for labels in members.entries if labels not in position]:
            raise ValueError(f"{odd[0]}: this run is not in the design")
        self.model = members.model if isinstance(members.model, xr.Dataset) else read_run(members.model)

        # In the order of the design, whatever that in which they came.
        entries = [members.entries[labels] for labels in position if labels in members.entries]
        # Where a run meets its stops in another order than the others (a load and an area, say), so it does its
        # snapshots.
        longest = max(entries, key=lambda entry: (not entry.failure, entry.size("step")))
        known = dict.fromkeys(itertools.chain(longest.snapshots, *(entry.snapshots for entry in entries)))
        self.snapshots = {each: k for k, each in enumerate(known)}
        self.sizes = {dim: size for dim, size in self.model.sizes.items() if dim not in RAGGED}
        if "snapshot" in self.sizes:
            self.sizes["snapshot"] = len(self.snapshots)
        if "step" in self.sizes:
            self.sizes["step"] = max(entry.size("step") for entry in entries)
        self._check(entries)

        self.entries = sorted(entries, key=lambda entry: position[entry.labels])
        self.positions = np.array([position[entry.labels] for entry in self.entries])
        self.failures = [self._why_incomplete(entry) for entry in self.entries]
        self.status = np.full(self.shape, NOT_IN_DESIGN, np.int8)
        self.status[tuple(np.transpose(list(position.values())))] = MISSING
        self.status[tuple(self.positions.T)] = [INCOMPLETE if failure else COMPLETE for failure in self.failures]
        self.step_count = np.zeros(self.shape, np.int32)
        self.step_count[tuple(self.positions.T)] = self.sizes_of("step")

    def sizes_of(self, dim: str) -> np.ndarray:
        """Size of a dimension of every run."""
        return np.array([entry.size(dim) for entry in self.entries])

    def _check(self, entries):
        """Refuse runs with other variables, or others along dimensions that all have in common."""
        names = frozenset(self.model.variables)
        may_lack = frozenset(name for name in names if not set(RAGGED) & set(self.model[name].dims))
        for entry in entries:
            odd = entry.names ^ names
            if odd - (may_lack if entry.failure else frozenset()):
                known = ", ".join(sorted(odd))
                raise ValueError(f"{entry.labels}: variables differ from those of the study's other runs: {known}")
            for dim, size in self.sizes.items():
                if dim not in ("step", "snapshot") and entry.size(dim) != size:
                    raise ValueError(f"{entry.labels}: {entry.size(dim)} along {dim}, {size} of the study's other runs")

    def _why_incomplete(self, entry):
        """Why a run does not hold all that the study has; an empty text if it does."""
        if entry.failure or len(entry.snapshots) == len(self.snapshots):
            return entry.failure
        return f"{len(entry.snapshots)} of {len(self.snapshots)} snapshots"

    def dims_of(self, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The labels that a variable of the runs varies with, and its own dimensions; no labels of what is ragged."""
        own = self.model[name].dims
        if name in self.sizes or set(RAGGED) & set(own):
            return (), own
        return _VARIES_WITH.get(name, LABELS), own

    def lacks(self, name: str) -> bool:
        """Whether a variable of the runs has no value somewhere."""
        along, own = self.dims_of(name)
        having = np.array([name in entry.names for entry in self.entries])
        there = np.zeros([len(self.axes[label]) for label in along], bool)
        there[tuple(self.positions[having][:, LABELS.index(label)] for label in along)] = True
        if along != LABELS:
            return not there.all()
        return not there.all() or any((self.sizes_of(dim)[having] != self.sizes[dim]).any() for dim in own)


_STUDIES = "The runs of every study, a group for each."
_LAYOUT = (
    "Variables of the runs along surface, seed, rms_slope and material. Spots and events of all runs, in this order of "
    "the runs, are ragged arrays along spot and event: the variables with an instance_dimension say where along that "
    "dimension each belongs, from 0; those that agree in all of them are of one snapshot of one run."
)


class _Column(NamedTuple):
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
            room = self.variable.shape[-1] - values.shape[-1]
            values = np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, room)])
        return values

    def places(self, snapshots: list[int], values: np.ndarray) -> tuple[list[int] | slice, ...]:
        """Where a run's values stand along the own dimensions; its snapshots are those at the positions given."""
        sizes = zip(self.own, values.shape, strict=False)
        return tuple(snapshots if dim == "snapshot" else slice(0, size) for dim, size in sizes)


class _Group:
    """The group of a study in the file: what is in it, and how it is written."""

    def __init__(self, group: netCDF4.Dataset, study: _Study, attrs: Mapping[str, str]):
        """Make dimensions, variables and attributes."""
        self.group, self.study, model = group, study, study.model
        self.counts = {dim: int(study.sizes_of(dim).sum()) for dim in RAGGED if dim in model.dims}
        self.sizes = dict(zip(LABELS, study.shape, strict=True)) | study.sizes | self.counts
        define_dimensions(group, self.sizes)
        own = {"study": study.name} | {name: model.attrs[name] for name in ("license",) if name in model.attrs}
        # Not the checksum of one of its runs.
        own |= {name: attrs[name] for name in ("config_sha256",) if name in attrs}
        group.setncatts(collected(f"Study {study.name}", _LAYOUT, COLLECTED, [model.attrs]) | own)

        names = [name for name in model.variables if name not in LABELS]
        dims = {name: sum(study.dims_of(name), ()) for name in names} | {label: (label,) for label in LABELS}
        coordinates = coordinates_of(model.variables, {*model.coords, *LABELS}, dims)
        varying = [own for along, own in map(study.dims_of, names) if along == LABELS]
        largest = max(math.prod(self._shape((), own)) for own in varying)
        self.block = self._block(LABELS, largest)
        self.columns = {
            name: self._define(
                name, model[name].attrs | ({"coordinates": coordinates[name]} if name in coordinates else {})
            )
            for name in names
            if name not in self.sizes
        }
        self.whole = list(self._define_whole())
        width = max(1, *(len(failure.encode()) for failure in study.failures))
        attrs = {"units": "1", "long_name": "why the run is incomplete; empty where it is not"}
        self.failure = define_text(group, "failure", LABELS, width, attrs, **self._storage(LABELS, (), width))
        self.places = {
            (dim, label): define_numbers(
                group,
                f"{dim}_{label}",
                (dim,),
                np.int32,
                {
                    "units": "1",
                    "long_name": f"position of the {dim}'s run along {label}, from 0",
                    "instance_dimension": label,
                },
                **self._storage((), (dim,)),
            )
            for dim in self.counts
            for label in LABELS
        }

    def _shape(self, along, own):
        return tuple(self.sizes[dim] for dim in (*along, *own))

    def _block(self, along, values):
        """How many neighbouring runs make a block, along every label; of each there are so many values."""
        left = max(1, min(_RUNS_IN_BLOCK, _VALUES_IN_BLOCK // max(1, values)))
        block = []
        for size in reversed(self._shape(along, ())):
            block.append(min(size, left))
            left = left // size if block[-1] == size else 1
        return tuple(reversed(block))

    def _storage(self, along, own, width=None):
        """How a variable is kept: as it is if it is small, else compressed, block by block."""
        shape = self._shape((), own) + (() if width is None else (width,))
        if math.prod(self._shape(along, ())) * math.prod(shape) < LEAST_COMPRESSED:
            return {}
        block = self.block if along == LABELS else self._block(along, math.prod(shape))
        chunk = (*block, *shape) if along else tuple(min(size, _VALUES_IN_CHUNK) for size in shape)
        # A block is written at once: nothing is gained from keeping more than one.
        return COMPRESSION | {"chunksizes": chunk, "chunk_cache": 8 * math.prod(chunk)}

    def _define(self, name, attrs):
        """Make a variable of the runs."""
        along, own = self.study.dims_of(name)
        dtype = self.study.model[name].dtype
        if is_text(dtype):
            width = self.study.widths[name]
            storage = self._storage(along, own, width)
            return _Column(define_text(self.group, name, along + own, width, attrs, **storage), along, own, b"")
        storage, lacks = self._storage(along, own), self.study.lacks(name)
        fill = FLOAT_FILL
        if dtype.kind != "f":
            # 32 bits, which every netCDF tool reads, or flags.
            dtype = np.dtype(np.int8 if dtype == np.int8 and not lacks else np.int32)
            fill = INTEGER_FILL if lacks else 0
        storage |= {"fill_value": fill} if lacks else {}
        return _Column(define_numbers(self.group, name, along + own, dtype, attrs, **storage), along, own, fill)

    def _define_whole(self):
        """Make the variables that are known without the runs' values, and give them with what is to be written."""
        study, model = self.study, self.study.model
        for name in study.sizes:
            if name in model.variables:
                yield (
                    define_numbers(self.group, name, (name,), np.int32, model[name].attrs),
                    np.arange(study.sizes[name], dtype=np.int32),
                )
        numbers = {
            "status": (LABELS, study.status, STATUS_ATTRIBUTES),
            "step_count": (
                LABELS,
                study.step_count,
                {
                    "units": "1",
                    "long_name": "number of steps of the run",
                    "comment": "from this position on along step, numbers are filled with _FillValue and texts "
                    "are empty",
                },
            ),
            "seed": (
                ("seed",),
                np.array(study.axes["seed"], np.int32),
                {"units": "1", "long_name": "seed of the surface"},
            ),
            "rms_slope": (
                ("rms_slope",),
                np.array(study.axes["rms_slope"], float),
                {"units": "1", "long_name": "root mean square slope of the surface"},
            ),
        }
        for name, (dims, values, attrs) in numbers.items():
            storage = self._storage(dims, ()) if dims == LABELS else {}
            yield define_numbers(self.group, name, dims, values.dtype, attrs, **storage), values
        for name in ("surface", "material"):
            values = characters(np.array(study.axes[name]))
            attrs = {"units": "1", "long_name": f"name of the {name}"}
            yield define_text(self.group, name, (name,), values.shape[-1], attrs), values

    def write(self, spool: BinaryIO) -> None:
        """Write all values, those of the runs from the spool, block by block."""
        for variable, values in self.whole:
            variable[...] = values
        for position, failure in zip(self.study.positions, self.study.failures, strict=True):
            if failure:
                text = characters(np.array(failure))
                self.failure[(*position, slice(0, len(text)))] = text
        common = {name: _Common(name, column) for name, column in self.columns.items() if self._is_common(column)}
        ragged = _Ragged(self)
        for start, members in self._blocks():
            box = tuple(
                slice(k, min(k + n, size)) for k, n, size in zip(start, self.block, self.study.shape, strict=True)
            )
            lengths = tuple(s.stop - s.start for s in box)
            block = {
                name: np.full(lengths + column.variable.shape[len(LABELS) :], column.fill, column.variable.dtype)
                for name, column in self.columns.items()
                if column.along == LABELS
            }
            for entry, position in members:
                at = [self.study.snapshots[each] for each in entry.snapshots]
                values = self._taken_back(entry, spool)
                place = dict(zip(LABELS, position, strict=True))
                for name, v in values.items():
                    column = self.columns[name]
                    own = column.places(at, v)
                    if name in block:
                        block[name][(*np.subtract(position, start), ...)][own] = v
                    elif name in common:
                        common[name].put(entry.labels, tuple(place[label] for label in column.along), own, v)
                ragged.add(position, values, at)
            for name, values in block.items():
                self.columns[name].variable[box] = values
        ragged.flush()
        for each in common.values():
            each.flush()

    def _taken_back(self, entry, spool):
        """Values of a run's variables, as they fit the file."""
        spool.seek(entry.place)
        return {
            name: self.columns[name].fitting(*values)
            for name, values in pickle.load(spool).items()
            if name in self.columns
        }

    def _is_common(self, column):
        return column.along != LABELS and not set(column.own) & set(RAGGED)

    def _blocks(self) -> Iterator[tuple[tuple[int, ...], list[tuple[_Entry, tuple[int, ...]]]]]:
        """Where every block begins that has runs, and these with their positions."""
        placed = zip(self.study.entries, map(tuple, self.study.positions.tolist()), strict=True)
        for start, members in itertools.groupby(
            placed, key=lambda each: tuple(k // n * n for k, n in zip(each[1], self.block, strict=True))
        ):
            yield start, list(members)


class _Common:
    """A variable that several runs share: the first of them says what it is, the others must agree."""

    def __init__(self, name: str, column: _Column):
        """Nothing is known yet."""
        self.name, self.column = name, column
        shape, at = column.variable.shape, column.own.index("snapshot") + 1 if "snapshot" in column.own else 0
        self.known = np.zeros(shape[: len(column.along) + at], bool)
        # A number of each run is kept in memory, arrays of each are read from the file again.
        self.held = column.variable
        if not column.own or not column.along:
            self.held = np.full(shape, column.fill, column.variable.dtype)

    def put(self, labels: RunLabels, place: tuple[int, ...], own: tuple, values: np.ndarray) -> None:
        """Take the values of a run, or compare them."""
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

    def flush(self) -> None:
        """Write what is kept in memory."""
        if self.held is not self.column.variable:
            self.column.variable[...] = self.held


class _Ragged:
    """What the runs have along ragged dimensions, one after the other."""

    def __init__(self, group: _Group):
        """Nothing is written yet."""
        self.written = dict.fromkeys(group.counts, 0)
        self.variables = {
            dim: {name: column.variable for name, column in group.columns.items() if column.own == (dim,)}
            | {f"{dim}_{label}": group.places[dim, label] for label in LABELS}
            for dim in group.counts
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
        if self.taken > _VALUES_IN_BLOCK:
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
