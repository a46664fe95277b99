"""Arrangement of the runs of a study in its group: axes, sizes, the runs in the order of the axes, their status."""

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from icha.datasets.campaign_file.spool import Entry, Members, plain
from icha.datasets.files import read_run
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.places import arrange_slopes, slope_dims
from icha.datasets.variables.campaign import (
    COMPLETE,
    FAILED_CHECKS,
    INCOMPLETE,
    MISSING,
    NOT_IN_DESIGN,
    RAGGED,
    VARIES_WITH,
)
from icha.datasets.variables.run import CELLS


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
