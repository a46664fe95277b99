"""The runs of a campaign as its dataset takes them: read, noted one by one, arranged along the axes of their study."""

from __future__ import annotations

import itertools
import os
import pickle
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

import numpy as np
import xarray as xr

from icha.datasets.files import characters, check_is_run, is_refused, is_text, not_finite, read_run, readable
from icha.datasets.labels import LABELS, RunLabels, arrange_slopes, slope_dims
from icha.datasets.variables.campaign import (
    COMPLETE,
    FAILED_CHECKS,
    INCOMPLETE,
    MISSING,
    NOT_IN_DESIGN,
    RAGGED,
    VARIES_WITH,
)
from icha.datasets.variables.run import CELLS, CYCLE, LOOP, OF_MODELS, RUN
from icha.support.input_files import text

if TYPE_CHECKING:
    import h5py

# Dimensions and values of variables by name; texts are characters, along a last dimension without a name.
Values = dict[str, tuple[tuple[str, ...], np.ndarray]]

_DIMS = {name: description.dims for name, description in (RUN | OF_MODELS | CYCLE | LOOP).items()}
# Dimensions stand among the variables in HDF5.
_DIMENSIONS = {dim for dims in _DIMS.values() for dim in dims}
_ATTRIBUTES = ("contact_model", "config_sha256", "incomplete", "failed_checks", "applicability")
_WIDTH_OF_TEXT = re.compile(r"string\d+")


def read_run_values(path: str | os.PathLike, without: Collection[str] = ()) -> tuple[Values, dict[str, str]]:
    """Read the values of a run dataset and those of its attributes that tell what it is, if it has them.

    Variables along the dimensions `without` are left out.

    Raises
    ------
    ValueError
        If the file cannot be read or is not a run dataset.
    """
    import h5py  # which takes a while, and most callers read no run

    with readable(path), h5py.File(path) as file:
        names = [name for name in file if name in _DIMS or not _is_dimension(name)]
        check_is_run(names, path)
        if odd := set(names) - set(_DIMS):
            raise ValueError(f"{path}: not a run dataset, it has a variable {min(odd)!r}")
        wanted = [name for name in names if not set(without) & set(_DIMS[name])]
        values = {name: (_DIMS[name], _read(file, name)) for name in wanted}
        attrs = {name: text(file.attrs[name]) for name in _ATTRIBUTES if name in file.attrs}
    _check_sizes(values, path)
    return values, attrs


def _is_dimension(name):
    return name in _DIMENSIONS or _WIDTH_OF_TEXT.fullmatch(name)


def _read(file: h5py.File, name: str) -> np.ndarray:
    """All values of a variable; by h5py's low-level interface, which takes less than half the time of the other."""
    from h5py import h5d, h5s

    variable = h5d.open(file.id, name.encode())
    values = np.empty(variable.shape, variable.dtype)
    variable.read(h5s.ALL, h5s.ALL, values)
    return values


def _check_sizes(values, path):
    """Refuse variables of other dimensions than the vocabulary's."""
    sizes = {}
    for name, (dims, own) in values.items():
        further = int(own.dtype.kind == "S")
        if own.ndim != len(dims) + further or any(
            sizes.setdefault(dim, size) != size for dim, size in zip(dims, own.shape, strict=False)
        ):
            raise ValueError(f"{path}: not a run dataset, {name!r} does not have the dimensions ({', '.join(dims)})")


class Entry(NamedTuple):
    """What is kept in memory of one run: what it is called and has, and where its values are in the spool."""

    labels: RunLabels
    place: int
    names: frozenset[str]
    sizes: tuple[tuple[str, int], ...]
    snapshots: tuple[tuple[bytes, float], ...]
    failure: str
    failed_checks: str
    applicability: str

    def size(self, dim: str) -> int:
        """Size of a dimension of the run, 0 if it has none of that name."""
        return dict(self.sizes).get(dim, 0)


@dataclass
class Members:
    """The runs of a study as they come, the widths of their texts in bytes.

    samples, ranks : of every model a run that shows what its runs have, and how well it does.
    """

    entries: dict[RunLabels, Entry] = field(default_factory=dict)
    widths: dict[str, int] = field(default_factory=dict)
    samples: dict[str, xr.Dataset | str | os.PathLike] = field(default_factory=dict)
    ranks: dict[str, tuple] = field(default_factory=dict)


def spooled(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    spool: BinaryIO,
    settings: Mapping[RunLabels | tuple, str] = {},
) -> dict[str, Members]:
    """Note of every run what is needed of all, by study, and put its values into the spool.

    Raises
    ------
    ValueError
        Naming the run: if it is given twice, has other labels than its dataset, was computed with other settings than
        it should, or holds a value that is not finite; if there is none.
    """
    studies: dict[str, Members] = {}
    # Most runs have the same variables, sizes and snapshots, which are then kept once.
    shared: dict = {}
    for labels, source in runs:
        labels = plain(labels)
        members = studies.setdefault(labels.study, Members())
        if labels in members.entries:
            raise ValueError(f"{labels}: this run is given twice")
        values, attrs = _values_of(source) if isinstance(source, xr.Dataset) else read_run_values(source, CELLS)
        _check_labels(labels, values, attrs)
        if attrs.get("config_sha256") != settings.get(labels, attrs.get("config_sha256")):
            file = labels if isinstance(source, xr.Dataset) else source
            raise ValueError(
                f"{file}: this run was computed with other settings than are asked for; remove it and give the same "
                "command again, which computes it"
            )
        _refuse_values_not_finite(labels, values)
        sizes = {dim: n for dims, v in values.values() for dim, n in zip(dims, v.shape, strict=False)}
        alike = frozenset(values), tuple(sorted(sizes.items())), _snapshots_of(values)
        alike = (shared.setdefault(each, each) for each in alike)
        members.entries[labels] = Entry(
            labels,
            spool.tell(),
            *alike,
            _failure(values, attrs),
            str(attrs.get("failed_checks", "")),
            str(attrs.get("applicability", "")),
        )
        pickle.dump(values, spool, protocol=5)
        for name, (_, v) in values.items():
            if is_text(v.dtype):
                members.widths[name] = max(members.widths.get(name, 1), v.shape[-1])
        # Of a run that ended early some variables may be unknown: what it would have reached at the end.
        rank = ("incomplete" not in attrs, sizes.get("step", 0))
        if rank > members.ranks.get(labels.model, ()):
            members.samples[labels.model], members.ranks[labels.model] = source, rank
    if not studies:
        raise ValueError("a campaign dataset needs at least one run")
    return studies


def values_back(entry: Entry, spool: BinaryIO) -> Values:
    """Values of a run from the spool."""
    spool.seek(entry.place)
    return pickle.load(spool)


def plain(labels: RunLabels | tuple) -> RunLabels:
    """Labels with numbers of Python's own types."""
    labels = RunLabels(*labels)
    return labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))


def _values_of(run: xr.Dataset) -> tuple[Values, dict]:
    """What `icha.datasets.campaign_runs.read_run_values` gives of a run's file, of the run itself."""
    values = {
        name: (variable.dims, characters(variable.values) if is_text(variable.dtype) else variable.values)
        for name, variable in run.drop_dims(CELLS, errors="ignore").variables.items()
    }
    return values, run.attrs


def _failure(values, attrs) -> str:
    """Why a run did not reach its end; an empty text if it did."""
    if "incomplete" in attrs:
        return str(attrs["incomplete"])
    failed = int(np.sum(values["converged"][1] != 1)) if "converged" in values else 0
    return f"{failed} of its steps did not converge" if failed else ""


def _check_labels(labels, values, attrs):
    if attrs.get("contact_model", labels.model) != labels.model:
        raise ValueError(f"{labels}: the dataset's model is {attrs['contact_model']}")
    for label, tolerance in (("rms_slope", 1e-6), ("seed", 0)):
        if label in values:
            value, named = float(values[label][1]), float(getattr(labels, label))
            if abs(value - named) > tolerance * abs(named):
                raise ValueError(f"{labels}: the dataset's {label} is {value:g}")


def _refuse_values_not_finite(labels, values):
    for name, (dims, v) in values.items():
        if v.dtype.kind != "f" or np.isfinite(v).all():
            continue
        bad = is_refused(v, RUN[name].further if name in RUN else {})
        if bad.any():
            raise ValueError(f"{labels}: variable {not_finite(name, dims, bad)}")


def _snapshots_of(values):
    """Kind and target of a run's snapshots."""
    if "snapshot_kind" not in values:
        return ()
    kinds = values["snapshot_kind"][1]
    return tuple(
        zip((kind.tobytes().rstrip(b"\0") for kind in kinds), values["snapshot_target"][1].tolist(), strict=True)
    )


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The runs of a study along its axes.

    name : of the study. axes : values of every label; rms slopes as `arrange_slopes` returns them. sample : a run that
    shows what variables there are, with those of all models. origins : global attributes of a run of every model.
    widths : of texts, in bytes. sizes : of the dimensions that runs have in common. snapshots : position of every kind
    and target.
    entries : the runs there are, in the order of the axes; positions (n, 5) : of these; failures : why each of these is
    no result, an empty text if it is one. status, step_count : along `LABELS`.
    """

    name: str
    axes: dict[str, list | np.ndarray]
    sample: xr.Dataset
    origins: list[dict]
    widths: dict[str, int]
    sizes: dict[str, int]
    snapshots: dict[tuple[bytes, float], int]
    entries: list[Entry]
    positions: np.ndarray
    failures: list[str]
    status: np.ndarray
    step_count: np.ndarray

    def sizes_of(self, dim: str) -> np.ndarray:
        """Size of a dimension of every run."""
        return _sizes(self.entries, dim)

    @property
    def slope_dims(self) -> tuple[str, ...]:
        """Dimensions of the rms slopes."""
        return slope_dims(self.axes["rms_slope"])

    def dims_of(self, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The labels that a variable of the runs varies with, and its own dimensions; no labels of what is ragged."""
        own = self.sample[name].dims
        if name in self.sizes or set(RAGGED) & set(own):
            return (), own
        along = VARIES_WITH.get(name, LABELS)
        if "rms_slope" in along and not set(self.slope_dims) <= set(along):
            along = tuple(label for label in LABELS if label in {*along, *self.slope_dims})
        return along, own

    def lacks(self, name: str) -> bool:
        """Whether a variable of the runs has no value somewhere."""
        along, own = self.dims_of(name)
        having = np.array([name in entry.names for entry in self.entries])
        there = np.zeros([self.status.shape[LABELS.index(label)] for label in along], bool)
        there[tuple(self.positions[having][:, LABELS.index(label)] for label in along)] = True
        if along != LABELS:
            return not there.all()
        return not there.all() or any((self.sizes_of(dim)[having] != self.sizes[dim]).any() for dim in own)


def arranged(studies: dict[str, Members], design: Iterable[RunLabels | tuple] | None) -> list[Arrangement]:
    """Arrange the runs of every study, in the order of the design.

    Raises
    ------
    ValueError
        Naming the run: if it is not in the design, or does not fit its study's other runs; if a study has no run.
    """
    asked = {name: list(members.entries) for name, members in studies.items()}
    if design is not None:
        asked = {}
        for labels in dict.fromkeys(map(plain, design)):
            asked.setdefault(labels.study, []).append(labels)
    known = {labels for of_study in asked.values() for labels in of_study}
    if odd := [labels for members in studies.values() for labels in members.entries if labels not in known]:
        raise ValueError(f"{odd[0]}: this run is not in the design")
    for name in asked:
        if name not in studies:
            raise ValueError(f"study {name}: there is no run of it")
    return [_arranged_study(name, studies[name], labels) for name, labels in asked.items()]


def _arranged_study(name, members, design):
    axes = {label: list(dict.fromkeys(getattr(labels, label) for labels in design)) for label in LABELS}
    axes |= {"seed": sorted(axes["seed"])}
    slopes = axes["rms_slope"] = arrange_slopes((labels.surface, labels.rms_slope) for labels in design)
    at = {label: {value: k for k, value in enumerate(axes[label])} for label in LABELS if label != "rms_slope"}
    rows = slopes if slopes.ndim == 2 else [slopes] * len(axes["surface"])
    slope_at = [{value: k for k, value in enumerate(row.tolist())} for row in rows]

    def place(labels):
        own = at | {"rms_slope": slope_at[at["surface"][labels.surface]]}
        return tuple(own[label][getattr(labels, label)] for label in LABELS)

    position = {labels: place(labels) for labels in design}
    samples = {model: _sample(members.samples[model]) for model in axes["model"] if model in members.samples}
    sample = _combined(list(samples.values()))
    # In the order of the design, whatever that in which they came.
    entries = [members.entries[labels] for labels in position if labels in members.entries]
    snapshots = _snapshots(entries)
    sizes = {dim: size for dim, size in sample.sizes.items() if dim not in RAGGED}
    if "snapshot" in sizes:
        sizes["snapshot"] = len(snapshots)
    if "step" in sizes:
        sizes["step"] = int(_sizes(entries, "step").max())
    _check(entries, samples, sizes)

    entries = sorted(entries, key=lambda entry: position[entry.labels])
    positions = np.array([position[entry.labels] for entry in entries])
    failures = [_why_incomplete(entry, len(snapshots)) for entry in entries]
    shape = tuple(len(axes[label]) if label != "rms_slope" else slopes.shape[-1] for label in LABELS)
    status = np.full(shape, NOT_IN_DESIGN, np.int8)
    status[tuple(np.transpose(list(position.values())))] = MISSING
    status[tuple(positions.T)] = [
        INCOMPLETE if failure else FAILED_CHECKS if entry.failed_checks else COMPLETE
        for entry, failure in zip(entries, failures, strict=True)
    ]
    failures = [failure or entry.failed_checks for entry, failure in zip(entries, failures, strict=True)]
    step_count = np.zeros(shape, np.int32)
    step_count[tuple(positions.T)] = _sizes(entries, "step")
    return Arrangement(
        name,
        axes,
        sample,
        [each.attrs for each in samples.values()],
        members.widths,
        sizes,
        snapshots,
        entries,
        positions,
        failures,
        status,
        step_count,
    )


def _sample(source):
    run = source if isinstance(source, xr.Dataset) else read_run(source)
    return run.drop_dims(CELLS, errors="ignore")


def _combined(samples):
    """A run with the variables that any of the samples has, as long as the shortest of them."""
    whole, *others = samples
    for other in others:
        further = other.drop_vars([name for name in other.variables if name in whole.variables])
        common = {
            dim: slice(0, min(size, further.sizes[dim])) for dim, size in whole.sizes.items() if dim in further.sizes
        }
        whole = whole.isel(common).assign(further.isel(common).variables)
    return whole


def _sizes(entries, dim):
    return np.array([entry.size(dim) for entry in entries])


def _snapshots(entries):
    """Position of every snapshot of the study, by kind and target.

    Where a run meets its stops in another order than the others (a load and an area, say), so it does its snapshots.
    """
    longest = max(entries, key=lambda entry: (not entry.failure, entry.size("step")))
    known = dict.fromkeys(itertools.chain(longest.snapshots, *(entry.snapshots for entry in entries)))
    return {each: k for k, each in enumerate(known)}


def _check(entries, samples, sizes):
    """Refuse runs with other variables than their model's, or others along dimensions that all have in common."""
    names = {model: frozenset(sample.variables) for model, sample in samples.items()}
    ragged = {
        model: {name for name, variable in sample.variables.items() if set(RAGGED) & set(variable.dims)}
        for model, sample in samples.items()
    }
    for model, own in ragged.items():
        if odd := own ^ next(iter(ragged.values())):
            raise ValueError(f"model {model}: variables differ from those of other models: {', '.join(sorted(odd))}")
    for entry in entries:
        model = entry.labels.model
        odd = entry.names ^ names[model]
        if odd - (names[model] - ragged[model] if entry.failure else frozenset()):
            known = ", ".join(sorted(odd))
            raise ValueError(f"{entry.labels}: variables differ from those of the study's other runs: {known}")
        for dim, size in sizes.items():
            if dim not in ("step", "snapshot") and entry.size(dim) != size:
                raise ValueError(f"{entry.labels}: {entry.size(dim)} along {dim}, {size} of the study's other runs")


def _why_incomplete(entry, snapshots):
    """Why a run does not hold all that the study has; an empty text if it does."""
    if entry.failure or len(entry.snapshots) == snapshots:
        return entry.failure
    return f"{len(entry.snapshots)} of {snapshots} snapshots"
