"""The runs of a campaign for its dataset: read one by one, and arranged along the axes of their study."""

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

# Dimensions and values of variables, by name. Texts are characters along a last dimension without a name.
Values = dict[str, tuple[tuple[str, ...], np.ndarray]]

_DIMS = {name: description.dims for name, description in (RUN | OF_MODELS | CYCLE | LOOP).items()}
# In HDF5, dimensions are listed among the variables; those of texts are called after their width.
_DIMENSION = re.compile("|".join([*sorted({dim for dims in _DIMS.values() for dim in dims}), r"string\d+"]))
_ATTRIBUTES = ("contact_model", "config_sha256", "incomplete", "failed_checks", "applicability")


def read_run_values(path: str | os.PathLike, without: Collection[str] = ()) -> tuple[Values, dict[str, str]]:
    """Read the values of a run dataset, and its attributes that identify it and its status.

    Variables along the dimensions `without` are left out.

    Raises
    ------
    ValueError
        If the file cannot be read or is not a run dataset.
    """
    import h5py  # which takes a while, and most callers read no run

    with readable(path), h5py.File(path) as file:
        names = [name for name in file if name in _DIMS or not _DIMENSION.fullmatch(name)]
        check_is_run(names, path)
        if unknown := set(names) - set(_DIMS):
            raise ValueError(f"{path}: not a run dataset, it has a variable {min(unknown)!r}")
        wanted = [name for name in names if not set(without) & set(_DIMS[name])]
        values = {name: (_DIMS[name], _read(file, name)) for name in wanted}
        attrs = {name: text(file.attrs[name]) for name in _ATTRIBUTES if name in file.attrs}
    sizes: dict[str, int] = {}
    for name, (dims, v) in values.items():
        shape = v.shape[:-1] if v.dtype.kind == "S" else v.shape
        if len(shape) != len(dims) or any(sizes.setdefault(dim, n) != n for dim, n in zip(dims, shape, strict=True)):
            raise ValueError(f"{path}: not a run dataset, {name!r} does not have the dimensions ({', '.join(dims)})")
    return values, attrs


def _read(file: h5py.File, name: str) -> np.ndarray:
    """Read all values of a variable with h5py's low-level interface, which takes less than half the usual time."""
    from h5py import h5d, h5s

    variable = h5d.open(file.id, name.encode())
    values = np.empty(variable.shape, variable.dtype)
    variable.read(h5s.ALL, h5s.ALL, values)
    return values


class Entry(NamedTuple):
    """Facts of one run that stay in memory.

    Attributes
    ----------
    labels : the labels of the run.
    place : where its values begin in the spool, in bytes.
    names : its variables.
    sizes : names and sizes of its dimensions.
    snapshots : kind and target of its snapshots.
    failure : why it did not reach its end; an empty text if it did.
    failed_checks, applicability : attributes of its dataset.
    """

    labels: RunLabels
    place: int
    names: frozenset[str]
    sizes: tuple[tuple[str, int], ...]
    snapshots: tuple[tuple[bytes, float], ...]
    failure: str
    failed_checks: str
    applicability: str

    def size(self, dim: str) -> int:
        """Return the size of a dimension of the run, 0 if it has none of that name."""
        return dict(self.sizes).get(dim, 0)


@dataclass
class Members:
    """The runs of a study, noted one by one.

    Attributes
    ----------
    entries : one for each run, by its labels.
    widths : bytes of the longest text of each variable.
    samples : of every model a run that has the variables of its runs, after a rank by which the best one is chosen.
    """

    entries: dict[RunLabels, Entry] = field(default_factory=dict)
    widths: dict[str, int] = field(default_factory=dict)
    samples: dict[str, tuple[tuple[bool, int], xr.Dataset | str | os.PathLike]] = field(default_factory=dict)


def spool_runs(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    spool: BinaryIO,
    settings: Mapping[RunLabels | tuple, str] = {},
) -> dict[str, Members]:
    """Append the values of every run to the spool; return what is needed of all runs at once, by study.

    Raises
    ------
    ValueError
        Naming the run: if it is given twice, has other labels than its dataset, was computed with other settings than
        it should, or holds a value that is not finite; if no run is given.
    """
    studies: dict[str, Members] = {}
    # Most runs have the same variables, sizes and snapshots, which are then kept once.
    shared: dict = {}
    for labels, source in runs:
        labels = plain_labels(labels)
        members = studies.setdefault(labels.study, Members())
        if labels in members.entries:
            raise ValueError(f"{labels}: this run is given twice")
        values, attrs = _values_of(source) if isinstance(source, xr.Dataset) else read_run_values(source, CELLS)
        _refuse_other_labels(labels, values, attrs)
        if attrs.get("config_sha256") != settings.get(labels, attrs.get("config_sha256")):
            file = labels if isinstance(source, xr.Dataset) else source
            raise ValueError(
                f"{file}: this run was computed with other settings than the configuration's. Remove it and repeat the "
                "command, which computes it"
            )
        _refuse_values_not_finite(labels, values)
        sizes = {dim: n for dims, v in values.values() for dim, n in zip(dims, v.shape, strict=False)}
        alike = frozenset(values), tuple(sorted(sizes.items())), _snapshots_of(values)
        alike = (shared.setdefault(each, each) for each in alike)
        reasons = (str(attrs.get(name, "")) for name in ("failed_checks", "applicability"))
        members.entries[labels] = Entry(labels, spool.tell(), *alike, _failure(values, attrs), *reasons)
        pickle.dump(values, spool, protocol=5)
        for name, (_, v) in values.items():
            if is_text(v.dtype):
                members.widths[name] = max(members.widths.get(name, 1), v.shape[-1])
        # A run that ended early may lack variables, those that describe the end of its path.
        rank = ("incomplete" not in attrs, sizes.get("step", 0))
        if labels.model not in members.samples or rank > members.samples[labels.model][0]:
            members.samples[labels.model] = rank, source
    if not studies:
        raise ValueError("a campaign dataset needs at least one run")
    return studies


def load_values(entry: Entry, spool: BinaryIO) -> Values:
    """Load the values of a run from the spool."""
    spool.seek(entry.place)
    return pickle.load(spool)


def plain_labels(labels: RunLabels | tuple) -> RunLabels:
    """Return labels whose numbers have Python's own types."""
    labels = RunLabels(*labels)
    return labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))


def _values_of(run: xr.Dataset) -> tuple[Values, dict]:
    """Return the values and attributes of a run as `read_run_values` does for its file."""
    values = {
        name: (variable.dims, characters(variable.values) if is_text(variable.dtype) else variable.values)
        for name, variable in run.drop_dims(CELLS, errors="ignore").variables.items()
    }
    return values, run.attrs


def _failure(values: Values, attrs: Mapping) -> str:
    """Explain why a run did not reach its end; an empty text if it did."""
    if "incomplete" in attrs:
        return str(attrs["incomplete"])
    failed = int(np.sum(values["converged"][1] != 1)) if "converged" in values else 0
    return f"{failed} of its steps did not converge" if failed else ""


def _refuse_other_labels(labels: RunLabels, values: Values, attrs: Mapping) -> None:
    if attrs.get("contact_model", labels.model) != labels.model:
        raise ValueError(f"{labels}: the dataset's model is {attrs['contact_model']}")
    for label, tolerance in (("rms_slope", 1e-6), ("seed", 0)):
        if label in values:
            value, expected = float(values[label][1]), float(getattr(labels, label))
            if abs(value - expected) > tolerance * abs(expected):
                raise ValueError(f"{labels}: the dataset's {label} is {value:g}")


def _refuse_values_not_finite(labels: RunLabels, values: Values) -> None:
    for name, (dims, v) in values.items():
        if v.dtype.kind != "f" or np.isfinite(v).all():
            continue
        bad = is_refused(v, RUN[name].further if name in RUN else {})
        if bad.any():
            raise ValueError(f"{labels}: variable {not_finite(name, dims, bad)}")


def _snapshots_of(values: Values) -> tuple[tuple[bytes, float], ...]:
    """Return kind and target of a run's snapshots."""
    if "snapshot_kind" not in values:
        return ()
    kinds = (kind.tobytes().rstrip(b"\0") for kind in values["snapshot_kind"][1])
    return tuple(zip(kinds, values["snapshot_target"][1].tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The runs of a study along its axes.

    Attributes
    ----------
    name : of the study.
    axes : values of every label; rms slopes as `arrange_slopes` returns them.
    sample : a run with the variables of all models.
    origins : global attributes of a run of every model.
    widths : bytes of the longest text of each variable.
    sizes : of the dimensions that runs have in common.
    snapshots : position of every snapshot, by kind and target.
    entries : the computed runs, in the order of the axes.
    positions : (n, 5) int, positions of the entries along the labels.
    failures : why each entry is not a result; an empty text if it is one.
    status, step_count : int arrays along `LABELS`.
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
        """Return the size of a dimension of every run."""
        return _sizes(self.entries, dim)

    @property
    def slope_dims(self) -> tuple[str, ...]:
        """Dimensions of the rms slopes."""
        return slope_dims(self.axes["rms_slope"])

    def dims_of(self, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the labels with which a variable of the runs varies, and its own dimensions; no labels if ragged."""
        dims = self.sample[name].dims
        if name in self.sizes or set(RAGGED) & set(dims):
            return (), dims
        along = VARIES_WITH.get(name, LABELS)
        if "rms_slope" in along and not set(self.slope_dims) <= set(along):
            along = tuple(label for label in LABELS if label in {*along, *self.slope_dims})
        return along, dims

    def lacks(self, name: str) -> bool:
        """Return True if a variable of the runs has no value somewhere."""
        along, dims = self.dims_of(name)
        having = np.array([name in entry.names for entry in self.entries])
        filled = np.zeros([self.status.shape[LABELS.index(label)] for label in along], bool)
        filled[tuple(self.positions[having][:, LABELS.index(label)] for label in along)] = True
        if along != LABELS:
            return not filled.all()
        return not filled.all() or any((self.sizes_of(dim)[having] != self.sizes[dim]).any() for dim in dims)


def arrange_runs(studies: dict[str, Members], design: Iterable[RunLabels | tuple] | None) -> list[Arrangement]:
    """Arrange the runs of every study, in the order of the design.

    Raises
    ------
    ValueError
        Naming the run: if it is not in the design, or does not fit its study's other runs; if a study has no run.
    """
    asked = {name: list(members.entries) for name, members in studies.items()}
    if design is not None:
        asked = {}
        for labels in dict.fromkeys(map(plain_labels, design)):
            asked.setdefault(labels.study, []).append(labels)
    known = {labels for of_study in asked.values() for labels in of_study}
    for members in studies.values():
        for labels in members.entries:
            if labels not in known:
                raise ValueError(f"{labels}: this run is not in the design")
    for name in asked:
        if name not in studies:
            raise ValueError(f"study {name}: it has no run")
    return [_arrange_study(name, studies[name], labels) for name, labels in asked.items()]


def _arrange_study(name: str, members: Members, design: list[RunLabels]) -> Arrangement:
    axes = {label: list(dict.fromkeys(getattr(labels, label) for labels in design)) for label in LABELS}
    axes |= {"seed": sorted(axes["seed"])}
    axes["rms_slope"] = arrange_slopes((labels.surface, labels.rms_slope) for labels in design)
    position = _positions(axes, design)
    samples = {model: _sample(members.samples[model][1]) for model in axes["model"] if model in members.samples}
    sample = _combined(list(samples.values()))
    # In the order of the design, whatever the order in which they were given.
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
    shape = tuple(len(axes[label]) if label != "rms_slope" else axes[label].shape[-1] for label in LABELS)
    status = np.full(shape, NOT_IN_DESIGN, np.int8)
    status[tuple(np.transpose(list(position.values())))] = MISSING
    status[tuple(positions.T)] = [
        INCOMPLETE if failure else FAILED_CHECKS if entry.failed_checks else COMPLETE
        for entry, failure in zip(entries, failures, strict=True)
    ]
    step_count = np.zeros(shape, np.int32)
    step_count[tuple(positions.T)] = _sizes(entries, "step")
    return Arrangement(
        name=name,
        axes=axes,
        sample=sample,
        origins=[each.attrs for each in samples.values()],
        widths=members.widths,
        sizes=sizes,
        snapshots=snapshots,
        entries=entries,
        positions=positions,
        failures=[failure or entry.failed_checks for entry, failure in zip(entries, failures, strict=True)],
        status=status,
        step_count=step_count,
    )


def _positions(axes: Mapping[str, list | np.ndarray], design: list[RunLabels]) -> dict[RunLabels, tuple[int, ...]]:
    """Return the position of every run of a design along the labels."""
    at = {label: {value: k for k, value in enumerate(axes[label])} for label in LABELS if label != "rms_slope"}
    rows = np.broadcast_to(axes["rms_slope"], (len(axes["surface"]), axes["rms_slope"].shape[-1])).tolist()
    slopes = [{slope: k for k, slope in enumerate(row)} for row in rows]
    return {
        labels: tuple(
            slopes[at["surface"][labels.surface]][labels.rms_slope]
            if label == "rms_slope"
            else at[label][getattr(labels, label)]
            for label in LABELS
        )
        for labels in design
    }


def _sample(source: xr.Dataset | str | os.PathLike) -> xr.Dataset:
    run = source if isinstance(source, xr.Dataset) else read_run(source)
    return run.drop_dims(CELLS, errors="ignore")


def _combined(samples: list[xr.Dataset]) -> xr.Dataset:
    """Combine the variables of all samples in a run that is as long as the shortest of them."""
    whole, *others = samples
    for other in others:
        further = other.drop_vars([name for name in other.variables if name in whole.variables])
        common = {
            dim: slice(0, min(size, further.sizes[dim])) for dim, size in whole.sizes.items() if dim in further.sizes
        }
        whole = whole.isel(common).assign(further.isel(common).variables)
    return whole


def _sizes(entries: list[Entry], dim: str) -> np.ndarray:
    return np.array([entry.size(dim) for entry in entries])


def _snapshots(entries: list[Entry]) -> dict[tuple[bytes, float], int]:
    """Assign numbers to the snapshots of the study, known by kind and target.

    Runs may meet their stops, and take their snapshots, in different orders (a load and an area, for instance).
    """
    longest = max(entries, key=lambda entry: (not entry.failure, entry.size("step")))
    known = dict.fromkeys(itertools.chain(longest.snapshots, *(entry.snapshots for entry in entries)))
    return {each: k for k, each in enumerate(known)}


def _check(entries: list[Entry], samples: Mapping[str, xr.Dataset], sizes: Mapping[str, int]) -> None:
    """Refuse runs with other variables than their model's, or of other size along a common dimension."""
    names = {model: frozenset(sample.variables) for model, sample in samples.items()}
    ragged = {
        model: {name for name, variable in sample.variables.items() if set(RAGGED) & set(variable.dims)}
        for model, sample in samples.items()
    }
    for model, found in ragged.items():
        if unequal := found ^ next(iter(ragged.values())):
            listed = ", ".join(sorted(unequal))
            raise ValueError(f"model {model}: variables differ from those of other models: {listed}")
    for entry in entries:
        model = entry.labels.model
        unequal = entry.names ^ names[model]
        if unequal - (names[model] - ragged[model] if entry.failure else frozenset()):
            listed = ", ".join(sorted(unequal))
            raise ValueError(f"{entry.labels}: variables differ from those of the study's other runs: {listed}")
        for dim, size in sizes.items():
            if dim not in ("step", "snapshot") and entry.size(dim) != size:
                raise ValueError(f"{entry.labels}: {entry.size(dim)} along {dim}, {size} of the study's other runs")


def _why_incomplete(entry: Entry, snapshots: int) -> str:
    """Explain why a run does not hold all that the study has; an empty text if it does."""
    if entry.failure or len(entry.snapshots) == snapshots:
        return entry.failure
    return f"{len(entry.snapshots)} of {snapshots} snapshots"
