"""Select runs and snapshots of a campaign dataset, which has arrays along the labels of the runs."""

from collections.abc import Collection

import numpy as np
import xarray as xr

from icha.datasets.labels import LABELS, RunLabels, labels_at, place_of, slopes_at
from icha.datasets.variables.campaign import (
    BEYOND_MODEL,
    COMPUTED_RUNS,
    FAILED_LOSS,
    INCOMPLETE,
    MISSING,
    NOT_IN_DESIGN,
    RAGGED,
    STATUS_ATTRIBUTES,
    WHOLE_RUNS,
)
from icha.datasets.variables.run import FURTHER, OF_LOSS, OF_SOME
from icha.path.targets import BETWEEN

# Variables of the campaign dataset that describe a run; datasets of runs do not have these variables.
_OF_EVERY_CAMPAIGN = ("status", "step_count", "failure")
# Variables of the campaign dataset that are attributes of a run.
_TEXTS = ("applicability", "attraction")


def run_labels(tree: xr.DataTree) -> list[RunLabels]:
    """List the labels of all runs in a campaign dataset, including incomplete runs, in the order of the dataset."""
    found = []
    for study, node in tree.children.items():
        found += runs_of_status(node.to_dataset(), study, COMPUTED_RUNS)
    return found


def runs_of_status(study: xr.Dataset, name: str, statuses: Collection[int]) -> list[RunLabels]:
    """List the labels of the runs of a study whose status is one of `statuses`, in the order of the dataset."""
    found = np.argwhere(np.isin(study["status"].transpose(*LABELS).values, tuple(statuses)))
    return [RunLabels(name, *labels_at(study, place, LABELS)) for place in found.tolist()]


def run_place(study: xr.Dataset, labels: RunLabels) -> dict[str, int]:
    """Return the index of a run along each label of a study; raise ValueError if the study lacks a value."""
    wanted = {label: getattr(labels, label) for label in LABELS}
    try:
        return place_of(study, wanted)
    except KeyError as error:
        (label,) = error.args
        known = study[label].values.tolist()
        if label == "rms_slope":
            row = place_of(study, {"surface": labels.surface})
            known = [f"{slope:g}" for slope in slopes_at(study, row) if np.isfinite(slope)]
        listed = ", ".join(map(str, known))
        raise ValueError(f"study {labels.study}: no {label} {wanted[label]!r}; expected one of {listed}") from None


def select_run(tree: xr.DataTree, labels: RunLabels | tuple) -> xr.Dataset:
    """Select one run of a campaign dataset, with all steps and spots of the run.

    The returned dataset has the attributes of the file of the run. Some attributes explain the status of the run:
    `incomplete` (why the run failed), `beyond_model` (why the run ended at the limit of the model), `failed_checks`
    (which checks failed), `failed_loss_checks` (which checks of the loss failed; the run then has no variables of the
    loss), and `applicability` (why the model is not applicable). `attraction` names the law of attraction.

    Raises
    ------
    ValueError
        If the campaign does not have the run; the message lists the available values of the label.
    """
    variables, attrs = variables_of_run(tree, labels)
    of_study = tree.children[RunLabels(*labels).study].dataset.coords
    coords = {name: variables.pop(name) for name in of_study if name not in LABELS}
    return xr.Dataset(variables, coords, attrs)


def variables_of_run(tree: xr.DataTree, labels: RunLabels | tuple) -> tuple[dict[str, xr.Variable], dict]:
    """Return the variables and attributes of a run; faster than `select_run`, because no dataset is built."""
    labels = RunLabels(*labels)
    if labels.study not in tree.children:
        raise ValueError(f"no study {labels.study!r}; expected one of {', '.join(tree.children)}")
    study = tree.children[labels.study].dataset
    index = run_place(study, labels)
    place = tuple(index.values())
    status, steps, failure = (study.variables[name].transpose(*LABELS)[place] for name in _OF_EVERY_CAMPAIGN)
    if int(status) in (MISSING, NOT_IN_DESIGN):
        raise ValueError(f"{labels}: this run is {'missing' if int(status) == MISSING else 'not in the design'}")
    index |= {dim: _ragged_slice(study, dim, place) for dim in RAGGED if dim in study.dims}
    index |= {"step": slice(0, int(steps))}
    ended_early = int(status) in (INCOMPLETE, BEYOND_MODEL)
    lacks_snapshots = False
    if "overlap_fraction" in study.variables:
        # A run without a state of its study has no snapshot of this state.
        overlap = study.variables["overlap_fraction"].transpose(*LABELS, "snapshot")[place].values
        lacks_snapshots = not np.isfinite(overlap).all()
        if lacks_snapshots:
            index["snapshot"] = np.flatnonzero(np.isfinite(overlap))
    left_out = {*_OF_EVERY_CAMPAIGN, *_TEXTS, *(f"{dim}_{label}" for dim in RAGGED for label in LABELS)}
    left_out |= {name for model, names in FURTHER.items() if model != labels.model for name in names}
    left_out |= OF_LOSS if int(status) == FAILED_LOSS else set()
    variables = {}
    for name, of_study in study.variables.items():
        if name in left_out:
            continue
        variable = of_study[tuple(index.get(dim, slice(None)) for dim in of_study.dims)].load()
        may_lack = name in OF_SOME or (ended_early and variable.ndim == 0)
        if may_lack and variable.dtype.kind == "f" and variable.size and np.isnan(variable.values).all():
            continue  # the run lacks this variable
        if variable.dtype.kind == "f" and variable.encoding.get("dtype") == np.dtype("int32"):
            # If some runs lack an integer variable, xarray reads the variable as floats.
            variable = xr.Variable(variable.dims, variable.values.astype(np.int32), variable.attrs)
        if lacks_snapshots and name in ("snapshot", "spot_snapshot"):
            # Renumber the snapshots of the run, because other runs of the study may have more snapshots.
            numbers = np.searchsorted(index["snapshot"], variable.values)
            variable = xr.Variable(variable.dims, numbers, variable.attrs)
        variables[name] = variable
    attrs = study.attrs | {"contact_model": labels.model}
    if int(status) in STATUS_ATTRIBUTES:
        attrs[STATUS_ATTRIBUTES[int(status)]] = failure.item()
    for name in _TEXTS:
        attrs[name] = study.variables[name].transpose(*LABELS)[place].item()
    return variables, attrs


def _ragged_slice(study: xr.Dataset, dim: str, place: tuple[int, ...]) -> slice:
    """Return the slice of the spots or events of a run along `dim`; the dataset stores one run after the other."""
    begin, end = 0, study.sizes[dim]
    for label, k in zip(LABELS, place, strict=True):
        column = study.variables[f"{dim}_{label}"].values[begin:end]
        begin, end = begin + np.searchsorted(column, k, "left"), begin + np.searchsorted(column, k, "right")
    return slice(int(begin), int(end))


def reduced_gap(data: xr.Dataset) -> xr.DataArray:
    """Return the ratio of the mean gap to the unit of heights (rms height); figures show this ratio as the separation.

    On a periodic surface, mean gap and mean separation are equal. The mean separation of a free square is the
    distance to the half-space far from the square. Therefore only the mean gap is comparable among all surfaces.
    """
    gap = (data["mean_gap"] / data["unit_height"]).transpose(*data["reduced_separation"].dims)
    return data["reduced_separation"].where(data["boundary"] != "free", gap)


def loading_stops(data: xr.Dataset) -> xr.DataArray:
    """Return True for the steps of the first loading that have a target, in a run or in all runs of a study."""
    return (data["leg"] == 0) & (data["step_kind"] != BETWEEN)


def runs_with_labels(study: xr.Dataset, **wanted: object) -> xr.DataArray:
    """Return True for the runs of a study with these labels, which include `surface`."""
    chosen = xr.full_like(study["status"], False, bool)
    chosen[place_of(study, wanted)] = True
    return chosen


def runs_with_loop(study: xr.Dataset, name: str) -> xr.DataArray:
    """Return True for the runs of a study that have a valid value `name` of their loop, such as the loss."""
    if name not in study:
        return xr.full_like(study["status"], False, bool)
    invalid = (study["status"] == FAILED_LOSS) & (name in OF_LOSS)
    return study[name].notnull() & ~invalid


def runs_with_snapshot(study: xr.Dataset, kind: str | None = None, target: float | None = None) -> xr.DataArray:
    """Return True for the runs of a study that reach the snapshot of `find_snapshot`."""
    return study["overlap_fraction"].isel(snapshot=find_snapshot(study, kind, target)).notnull()


def runs_with_unloading(study: xr.Dataset) -> xr.DataArray:
    """Return True for the runs of a study that reach their first unloading."""
    return (study["leg"] > 0).any("step")


def whole_runs(study: xr.Dataset) -> xr.DataArray:
    """Return True for the runs of a study whose whole path is a result."""
    return study["status"].isin(WHOLE_RUNS)


def runs_with_all_loads(study: xr.Dataset) -> xr.DataArray:
    """Return True for the runs of a study that reach as many targets in the first loading as any other run."""
    counts = loading_stops(study).sum("step")
    return counts == counts.max()


class NoSnapshot(ValueError):
    """A run does not have a snapshot, for example because it does not reach the state; the message lists others."""


def find_snapshot(run: xr.Dataset, kind: str | None = None, target: float | None = None) -> int:
    """Return the index of the first snapshot with a kind and a target; None means any kind or any target.

    Raise `NoSnapshot` if the run does not have the snapshot.
    """
    snapshots = list(zip(run["snapshot_kind"].values.astype(str), run["snapshot_target"].values, strict=True))
    for k, (found, value) in enumerate(snapshots):
        if kind in (None, found) and (target is None or np.isclose(value, target, rtol=1e-9)):
            return k
    wanted = f"{kind or 'any kind'}{'' if target is None else f' {target:g}'}"
    listed = ", ".join(f"{found} {value:g}" for found, value in snapshots) or "none"
    raise NoSnapshot(f"no snapshot of {wanted}; the run has: {listed}")


def spots_of(run: xr.Dataset, snapshot: int) -> xr.Dataset:
    """Return the spots of one snapshot of a run."""
    names = [name for name, variable in run.variables.items() if variable.dims == ("spot",)]
    return run[names].isel(spot=np.flatnonzero(run["spot_snapshot"].values == snapshot))
