"""Read the runs of a campaign one by one, and arrange the runs along the dimensions of the campaign dataset."""

from __future__ import annotations

import itertools
import os
import pickle
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, BinaryIO, NamedTuple

import numpy as np
import xarray as xr

from icha.datasets.files import characters, check_is_run, is_text, read_run, readable
from icha.datasets.labels import LABELS, RunLabels, arrange_slopes, slope_dims
from icha.datasets.variables.campaign import (
    BEYOND_MODEL,
    COMPLETE,
    FAILED_CHECKS,
    INCOMPLETE,
    MISSING,
    NOT_IN_DESIGN,
    RAGGED,
    STATUS_ATTRIBUTES,
    VARIES_WITH,
    VARIES_WITH_OWN_UNITS,
    WHOLE_RUNS,
)
from icha.datasets.variables.run import CELLS, CYCLE, INDENTER, LOOP, OF_MODELS, RUN
from icha.support.input_files import text

# Dimensions and values of variables, by name. Texts are arrays of characters; the dimension of characters has no name.
Values = dict[str, tuple[tuple[str, ...], np.ndarray]]
# Labels of a run, and the dataset of the run or the path of its file.
LabelledRun = tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]

_DIMS = {name: description.dims for name, description in (RUN | OF_MODELS | CYCLE | LOOP | INDENTER).items()}
# Two units of slopes count as equal up to this relative difference, because scaling of surfaces causes rounding errors.
_SAME_UNIT = 1e-9
_ENDED_EARLY = (INCOMPLETE, BEYOND_MODEL)
_ATTRIBUTES = ("contact_model", "config_sha256", "applicability", "attraction", *STATUS_ATTRIBUTES.values())


def read_run_values(path: str | os.PathLike) -> tuple[Values, dict[str, str]]:
    """Read all values of a run dataset except maps, and the attributes that give settings and status of the run.

    Raises
    ------
    ValueError
        If the file cannot be read or is not a run dataset.
    """
    import h5py  # imported here because the import is slow, and most callers do not read runs
    from h5py import h5d, h5s

    with readable(path), h5py.File(path) as file:
        check_is_run(file, path)
        values: Values = {}
        for name, dims in _DIMS.items():
            if name in file and not set(CELLS) & set(dims):
                # The low-level interface of h5py takes less than half the time of the usual interface.
                variable = h5d.open(file.id, name.encode())
                values[name] = dims, np.empty(variable.shape, variable.dtype)
                variable.read(h5s.ALL, h5s.ALL, values[name][1])
        return values, {name: text(file.attrs[name]) for name in _ATTRIBUTES if name in file.attrs}


class Entry(NamedTuple):
    """Properties of one run that stay in memory.

    Attributes
    ----------
    labels : labels of the run.
    source : dataset of the run, or path of its file.
    place : number of bytes before the values of the run in the temporary file.
    names : names of the variables of the run.
    sizes : sizes of the dimensions of the run, by name.
    widths : length in bytes of the longest text, for each variable with texts.
    snapshots : kind and target of each snapshot of the run.
    status : status of the run before ICHA checks that the run has all snapshots of its study.
    failure : reason why the run is not complete; "" for a complete run.
    applicability : reason why the model is not applicable to the run; "" if it is applicable.
    attraction : law of attraction of boundary elements; "" for the asperity model.
    unit_slope : unit of slopes of the run, to which its bins of pressures are proportional; NaN if it has none.
    """

    labels: RunLabels
    source: xr.Dataset | str | os.PathLike
    place: int
    names: frozenset[str]
    sizes: dict[str, int]
    widths: dict[str, int]
    snapshots: tuple[tuple[bytes, float], ...]
    status: int
    failure: str
    applicability: str
    attraction: str
    unit_slope: float

    @property
    def extent(self) -> tuple[bool, int, int]:
        """Sort key: (run reached its end, numbers of variables and of steps). The largest key has all variables."""
        return self.status not in _ENDED_EARLY, len(self.names), self.sizes.get("step", 0)


def spool_runs(runs: Iterable[LabelledRun], spool: BinaryIO) -> dict[str, dict[RunLabels, Entry]]:
    """Append the values of every run to a temporary file; return the entries of all runs, by study and labels.

    Parameters
    ----------
    runs : as in `icha.datasets.campaign_file.write_campaign`.
    spool : the temporary file.

    Raises
    ------
    ValueError
        If a run is given twice. The message names the run.
    """
    studies: dict[str, dict[RunLabels, Entry]] = {}
    # Most runs have the same variables and snapshots. Each combination is stored only once.
    stored: dict[Hashable, Any] = {}
    for labels, source in runs:
        labels = plain_labels(labels)
        entries = studies.setdefault(labels.study, {})
        if labels in entries:
            raise ValueError(f"{labels}: this run is given twice")
        values, attrs = _values_of(source) if isinstance(source, xr.Dataset) else read_run_values(source)
        names, snapshots = frozenset(values), _snapshots_of(values)
        entries[labels] = Entry(
            labels,
            source,
            spool.tell(),
            stored.setdefault(names, names),
            {dim: n for dims, v in values.values() for dim, n in zip(dims, v.shape, strict=False)},
            {name: v.shape[-1] for name, (_, v) in values.items() if is_text(v.dtype)},
            stored.setdefault(snapshots, snapshots),
            *_status_and_failure(attrs),
            str(attrs.get("applicability", "")),
            str(attrs.get("attraction", "")),
            float(values["unit_slope"][1]) if "unit_slope" in values else np.nan,
        )
        pickle.dump(values, spool, protocol=5)
    return studies


def plain_labels(labels: RunLabels | tuple) -> RunLabels:
    """Return labels with seed and slope as Python's int and float instead of types of numpy."""
    labels = RunLabels(*labels)
    return labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))


def _values_of(run: xr.Dataset) -> tuple[Values, dict]:
    """Return the values and attributes of a run in memory, in the form that `read_run_values` returns for a file."""
    values = {
        name: (variable.dims, characters(variable.values) if is_text(variable.dtype) else variable.values)
        for name, variable in run.drop_dims(CELLS, errors="ignore").variables.items()
    }
    return values, run.attrs


def _status_and_failure(attrs: Mapping) -> tuple[int, str]:
    """Return the status of a run, and the reason why the run is not complete; "" for a complete run."""
    found = [(status, str(attrs[name])) for status, name in STATUS_ATTRIBUTES.items() if name in attrs]
    return (*found, (COMPLETE, ""))[0]


def _snapshots_of(values: Values) -> tuple[tuple[bytes, float], ...]:
    """Return the kind and the target of each snapshot of a run."""
    if "snapshot_kind" not in values:
        return ()
    kinds = (kind.tobytes().rstrip(b"\0") for kind in values["snapshot_kind"][1])
    return tuple(zip(kinds, values["snapshot_target"][1].tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The runs of a study, arranged along labels such as surface and seed.

    Attributes
    ----------
    name : name of the study.
    known : values of the variables that list the runs: labels, `status`, `step_count`, `failure`,
        `applicability`, `attraction`.
    variables : variables of all models, each from one run as an example.
    coordinates : names of the variables that are coordinates.
    origins : global attributes of one run of every model.
    sizes : sizes of the dimensions in the file, except dimensions of spots and events.
    snapshots : index of every snapshot along the dimension `snapshot`, by kind and target.
    entries : the computed runs, in the order of the labels.
    positions : (n, 5) int, indices of the n entries along the five labels.
    """

    name: str
    known: dict[str, Any]
    variables: dict[str, xr.Variable]
    coordinates: set[str]
    origins: list[dict]
    sizes: dict[str, int]
    snapshots: dict[tuple[bytes, float], int]
    entries: list[Entry]
    positions: np.ndarray

    @property
    def slope_dims(self) -> tuple[str, ...]:
        """Dimensions of the coordinate `rms_slope`. They include `surface` if surfaces have different slopes."""
        return slope_dims(self.known["rms_slope"])

    @cached_property
    def own_units(self) -> bool:
        """True if runs of equal rms slopes may have different units of slopes: with shapes, and with rms heights."""
        units: dict[float, list[float]] = {}
        for entry in self.entries:
            units.setdefault(entry.labels.rms_slope, []).append(entry.unit_slope)
        return "shape" in self.variables or any(max(each) > (1 + _SAME_UNIT) * min(each) for each in units.values())

    def dims_of(self, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the labels (none for spots and events) and the other dimensions along which a variable is stored."""
        dims = self.variables[name].dims
        if name in self.sizes or set(RAGGED) & set(dims):
            return (), dims
        along = (VARIES_WITH_OWN_UNITS if self.own_units else VARIES_WITH).get(name, LABELS)
        if "rms_slope" in along and not set(self.slope_dims) <= set(along):
            along = tuple(label for label in LABELS if label in {*along, *self.slope_dims})
        return along, dims

    def lacks(self, name: str) -> bool:
        """Return True if a variable is missing in a run, or at a step or snapshot of a run."""
        along, dims = self.dims_of(name)
        columns = [LABELS.index(label) for label in along]
        having = np.array([name in entry.names for entry in self.entries])
        filled = np.zeros([self.known["status"].shape[column] for column in columns], bool)
        filled[tuple(self.positions[having][:, column] for column in columns)] = True
        if along != LABELS:
            return not filled.all()
        return not filled.all() or any((_sizes(self.entries, dim)[having] != self.sizes[dim]).any() for dim in dims)


def arrange_runs(
    studies: dict[str, dict[RunLabels, Entry]], design: Iterable[RunLabels | tuple] | None
) -> list[Arrangement]:
    """Arrange the runs of every study, in the order of the design.

    Raises
    ------
    ValueError
        If a run is not in the design. The message names the run.
    """
    given = [labels for entries in studies.values() for labels in entries]
    asked: dict[str, dict[RunLabels, None]] = {}
    for labels in given if design is None else map(plain_labels, design):
        asked.setdefault(labels.study, {})[labels] = None
    for labels in given:
        if labels not in asked.get(labels.study, ()):
            raise ValueError(f"{labels}: this run is not in the design")
    return [_arrange_study(name, studies[name], list(labels)) for name, labels in asked.items()]


def _arrange_study(name: str, found: dict[RunLabels, Entry], design: list[RunLabels]) -> Arrangement:
    axes: dict[str, Any] = {label: list(dict.fromkeys(getattr(each, label) for each in design)) for label in LABELS}
    axes["seed"].sort()
    axes["rms_slope"] = arrange_slopes((labels.surface, labels.rms_slope) for labels in design)
    position = _positions(axes, design)
    # The order of the design replaces the order in which the runs were given.
    entries = [found[labels] for labels in position if labels in found]
    # For every model, one run that has all variables of the model.
    samples = [
        _sample(max(of_model, key=lambda entry: entry.extent).source)
        for model in axes["model"]
        if (of_model := [entry for entry in entries if entry.labels.model == model])
    ]
    variables: dict[str, xr.Variable] = {}
    for sample in samples:
        variables |= {key: variable for key, variable in sample.variables.items() if key not in variables}
    snapshots = _snapshots(entries)
    sizes = {dim: n for v in variables.values() for dim, n in v.sizes.items() if dim not in RAGGED}
    longest = {"snapshot": len(snapshots), "step": int(_sizes(entries, "step").max())}
    sizes |= {dim: size for dim, size in longest.items() if dim in sizes}
    entries = sorted(entries, key=lambda entry: position[entry.labels])
    positions = np.array([position[entry.labels] for entry in entries])
    shape = tuple(len(axes[label]) if label != "rms_slope" else axes[label].shape[-1] for label in LABELS)

    def spread(values: Iterable, fill: int | str, dtype: type) -> np.ndarray:
        array = np.full(shape, fill, dtype)
        array[tuple(positions.T)] = list(values)
        return array

    outcomes = [
        (INCOMPLETE, f"{len(entry.snapshots)} of {len(snapshots)} snapshots")
        if entry.status in (*WHOLE_RUNS, FAILED_CHECKS) and len(entry.snapshots) != len(snapshots)
        else (entry.status, entry.failure)
        for entry in entries
    ]
    status = spread((status for status, _ in outcomes), NOT_IN_DESIGN, np.int8)
    asked = np.zeros(shape, bool)
    asked[tuple(np.transpose(list(position.values())))] = True
    status[asked & (status == NOT_IN_DESIGN)] = MISSING
    return Arrangement(
        name=name,
        known=axes
        | {
            "status": status,
            "step_count": spread(_sizes(entries, "step"), 0, np.int32),
            "failure": spread((failure for _, failure in outcomes), "", object),
            "applicability": spread((entry.applicability for entry in entries), "", object),
            "attraction": spread((entry.attraction for entry in entries), "", object),
        },
        variables={key: variable for key, variable in variables.items() if key not in LABELS},
        coordinates={*samples[0].coords, *LABELS},
        origins=[sample.attrs for sample in samples],
        sizes=sizes,
        snapshots=snapshots,
        entries=entries,
        positions=positions,
    )


def _positions(axes: Mapping[str, Any], design: list[RunLabels]) -> dict[RunLabels, tuple[int, ...]]:
    """Return the index of every run of a design along each label."""
    at = {(label, value): k for label in LABELS if label != "rms_slope" for k, value in enumerate(axes[label])}
    rows = np.broadcast_to(axes["rms_slope"], (len(axes["surface"]), axes["rms_slope"].shape[-1])).tolist()
    for surface, row in zip(axes["surface"], rows, strict=True):
        at |= {((surface, "rms_slope"), slope): k for k, slope in enumerate(row)}
    return {
        labels: tuple(
            at[(labels.surface, label) if label == "rms_slope" else label, getattr(labels, label)] for label in LABELS
        )
        for labels in design
    }


def _sample(source: xr.Dataset | str | os.PathLike) -> xr.Dataset:
    run = source if isinstance(source, xr.Dataset) else read_run(source)
    return run.drop_dims(CELLS, errors="ignore")


def _sizes(entries: list[Entry], dim: str) -> np.ndarray:
    """Return the size of a dimension of every run, 0 if a run does not have the dimension."""
    return np.array([entry.sizes.get(dim, 0) for entry in entries])


def _snapshots(entries: list[Entry]) -> dict[tuple[bytes, float], int]:
    """Assign a number to each snapshot of a study; kind and target identify a snapshot.

    The order of targets may differ between runs. For example, only in some runs a load target precedes an area target.
    """
    longest = max(entries, key=lambda entry: entry.extent)
    known = dict.fromkeys(itertools.chain(longest.snapshots, *(entry.snapshots for entry in entries)))
    return {each: k for k, each in enumerate(known)}
