"""The campaign dataset: the runs of every study as full arrays along model, surface, seed, rms slope and material."""

import os
import tempfile
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from icha.datasets.campaign_file import write_campaign
from icha.datasets.files import read_campaign
from icha.datasets.labels import LABELS, RunLabels, labels_at, place_of, slopes_at
from icha.datasets.variables.campaign import COMPUTED_RUNS, FAILED_CHECKS, INCOMPLETE, MISSING, NOT_IN_DESIGN, RAGGED
from icha.datasets.variables.run import FURTHER
from icha.path.targets import BETWEEN

# What the dataset of a campaign says of a run.
_OF_EVERY_CAMPAIGN = ("status", "step_count", "failure")


def campaign_tree(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    attrs: Mapping[str, str] = {},
) -> xr.DataTree:
    """The campaign dataset of some runs in memory; arguments and errors as `campaign_file.write_campaign`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "campaign.nc")
        write_campaign(runs, path, design=design, attrs=attrs)
        return read_campaign(path).load()


def run_labels(tree: xr.DataTree) -> list[RunLabels]:
    """Labels of all runs in a campaign dataset, complete or not, in its order."""
    found = []
    for study, node in tree.children.items():
        found += runs_of_status(node.to_dataset(), study, COMPUTED_RUNS)
    return found


def runs_of_status(study: xr.Dataset, name: str, asked: Collection[int]) -> list[RunLabels]:
    """Labels of the runs of a study whose status is one of those asked for, in the order of the dataset."""
    there = np.isin(study["status"].transpose(*LABELS).values, tuple(asked))
    return [RunLabels(name, *labels_at(study, place, LABELS)) for place in np.argwhere(there).tolist()]


def run_place(study: xr.Dataset, labels: RunLabels) -> dict[str, int]:
    """Position of a run along the labels of its study's dataset.

    Raises
    ------
    ValueError
        If the study has no such value of a label; the message says what it has.
    """
    wanted = {label: getattr(labels, label) for label in LABELS}
    try:
        return place_of(study, wanted)
    except KeyError as error:
        (label,) = error.args
        known = study[label].values.tolist()
        if label == "rms_slope":
            row = place_of(study, {"surface": labels.surface})
            known = [f"{slope:g}" for slope in slopes_at(study, row) if np.isfinite(slope)]
        there = ", ".join(map(str, known))
        raise ValueError(f"study {labels.study}: no {label} {wanted[label]!r}; there are {there}") from None


def select_run(tree: xr.DataTree, labels: RunLabels | tuple) -> xr.Dataset:
    """Take one run out of a campaign dataset, with the steps that it has and its own spots.

    Its attributes give reasons, as those of its file do: `incomplete` why it ended early, `failed_checks` which checks
    failed, `applicability` why its model is not applicable.

    Raises
    ------
    ValueError
        If the campaign has no such run; the message says what it has.
    """
    variables, attrs = variables_of_run(tree, labels)
    of_study = tree.children[RunLabels(*labels).study].dataset.coords
    coords = {name: variables.pop(name) for name in of_study if name not in LABELS}
    return xr.Dataset(variables, coords, attrs)


def variables_of_run(tree: xr.DataTree, labels: RunLabels | tuple) -> tuple[dict[str, xr.Variable], dict]:
    """Variables and attributes of `select_run`; for thousands of runs the dataset itself would take too long."""
    labels = RunLabels(*labels)
    if labels.study not in tree.children:
        raise ValueError(f"no study {labels.study!r}; there are {', '.join(tree.children)}")
    study = tree.children[labels.study].dataset
    index = run_place(study, labels)
    place = tuple(index.values())
    status, steps, failure = (study.variables[name].transpose(*LABELS)[place] for name in _OF_EVERY_CAMPAIGN)
    if int(status) in (MISSING, NOT_IN_DESIGN):
        raise ValueError(f"{labels}: this run is {'missing' if int(status) == MISSING else 'not in the design'}")
    part = (
        index | {"step": slice(0, int(steps))} | {dim: _own(study, dim, place) for dim in RAGGED if dim in study.dims}
    )
    incomplete = int(status) == INCOMPLETE
    if incomplete:
        there = study.variables["overlap_fraction"].transpose(*LABELS, "snapshot")[place].values
        part["snapshot"] = np.flatnonzero(np.isfinite(there))
    of_others = {name for model, names in FURTHER.items() if model != labels.model for name in names}
    left_out = {
        *_OF_EVERY_CAMPAIGN,
        "applicability",
        *of_others,
        *(f"{dim}_{label}" for dim in RAGGED for label in LABELS),
    }
    variables = {}
    for name, variable in study.variables.items():
        if name in left_out:
            continue
        own = variable[tuple(part.get(dim, slice(None)) for dim in variable.dims)].load()
        if incomplete and own.ndim == 0 and own.dtype.kind == "f" and np.isnan(own.values):
            continue  # not known of a run that ended early
        if own.dtype.kind == "f" and own.encoding.get("dtype") == np.dtype("int32"):
            own = xr.Variable(own.dims, own.values.astype(np.int32), own.attrs)  # a float for other runs that lack it
        if incomplete and name in ("snapshot", "spot_snapshot"):
            # Its snapshots are counted without those that only others have.
            own = xr.Variable(own.dims, np.searchsorted(part["snapshot"], own.values), own.attrs)
        variables[name] = own
    attrs = study.attrs | {"contact_model": labels.model}
    if incomplete:
        attrs["incomplete"] = failure.item()
    if int(status) == FAILED_CHECKS:
        attrs["failed_checks"] = failure.item()
    if "applicability" in study.variables:  # which campaigns of earlier versions lack
        attrs["applicability"] = study.variables["applicability"].transpose(*LABELS)[place].item()
    return variables, attrs


def _own(study, dim, place):
    """Where a run's spots or events are: all runs' follow each other in the order of the labels."""
    begin, end = 0, study.sizes[dim]
    for label, k in zip(LABELS, place, strict=True):
        column = study.variables[f"{dim}_{label}"].values[begin:end]
        begin, end = begin + np.searchsorted(column, k, "left"), begin + np.searchsorted(column, k, "right")
    return slice(int(begin), int(end))


def reduced_gap(data: xr.Dataset) -> xr.DataArray:
    """Mean gap over rms height: what figures and comparisons show as separation of a run or of all runs of a study.

    Of a periodic surface it is the mean separation over the rms height; of a free square, whose separation is that of
    the half-space far away, it is the one that can be compared with others.
    """
    gap = (data["mean_gap"] / data["rms_height"]).transpose(*data["reduced_separation"].dims)
    return data["reduced_separation"].where(data["boundary"] != "free", gap)


def loading_stops(data: xr.Dataset) -> xr.DataArray:
    """Which steps of a run, or of all runs of a study, are stops of the first loading, and not between stops."""
    return (data["leg"] == 0) & (data["step_kind"] != BETWEEN)


def find_snapshot(run: xr.Dataset, kind: str | None = None, target: float | None = None) -> int:
    """Position of the snapshot of a kind and target; the first one of the kind, or of all, if nothing more is said.

    Raises
    ------
    ValueError
        If there is none; the message lists the run's snapshots.
    """
    kinds = [str(value) for value in run["snapshot_kind"].values]
    targets = run["snapshot_target"].values
    for k, (own_kind, own_target) in enumerate(zip(kinds, targets, strict=True)):
        if kind in (None, own_kind) and (target is None or np.isclose(own_target, target, rtol=1e-9)):
            return k
    there = ", ".join(f"{k} {t:g}" for k, t in zip(kinds, targets, strict=True)) or "none"
    asked = kind or "any kind"
    raise ValueError(f"no snapshot of {asked}{'' if target is None else f' {target:g}'}; there are: {there}")


def spots_of(run: xr.Dataset, snapshot: int) -> xr.Dataset:
    """The spots of one snapshot of a run."""
    own = [name for name, variable in run.variables.items() if variable.dims == ("spot",)]
    return run[own].isel(spot=np.flatnonzero(run["spot_snapshot"].values == snapshot))
