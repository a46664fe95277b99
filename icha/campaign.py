"""The campaign dataset: the runs of every study as full arrays along surface, seed, rms slope and material."""

from __future__ import annotations

import itertools
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from icha.campaign_file import LABELS, RAGGED, write_campaign
from icha.labels import RunLabels
from icha.path import BETWEEN
from icha.records import COMPLETE, INCOMPLETE, MISSING, NOT_IN_DESIGN, read_campaign


def campaign_tree(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    attrs: Mapping[str, str] = {},
    allow_missing: bool = False,
) -> xr.DataTree:
    """The campaign dataset of some runs in memory; arguments and errors as `icha.campaign_file.write_campaign`."""
    if allow_missing:
        runs = list(runs)
        design = [
            labels
            for study in dict.fromkeys(key[0] for key, _ in runs)
            for labels in itertools.product(
                [study], *(dict.fromkeys(key[k] for key, _ in runs if key[0] == study) for k in range(1, 5))
            )
        ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "campaign.nc")
        write_campaign(runs, path, design=design, attrs=attrs)
        return read_campaign(path)


def run_labels(tree: xr.DataTree) -> list[RunLabels]:
    """Labels of all runs in a campaign dataset, complete or not, in its order."""
    found = []
    for study, node in tree.children.items():
        axes = [node[label].values.tolist() for label in LABELS]
        there = np.isin(node["status"].transpose(*LABELS).values, (COMPLETE, INCOMPLETE))
        found += [
            RunLabels(study, *(axis[i] for axis, i in zip(axes, index, strict=True)))
            for index in np.argwhere(there).tolist()
        ]
    return found


def select_run(tree: xr.DataTree, labels: RunLabels | tuple) -> xr.Dataset:
    """Take one run out of a campaign dataset, with the steps that it has and its own spots.

    One that is incomplete has the reason in its attribute `incomplete`, as its file has.

    Raises
    ------
    ValueError
        If the campaign has no such run; the message says what it has.
    """
    labels = RunLabels(*labels)
    if labels.study not in tree.children:
        raise ValueError(f"no study {labels.study!r}; there are {', '.join(tree.children)}")
    dataset = tree[labels.study].to_dataset()
    index = {}
    for label in LABELS:
        values = dataset[label].values
        wanted = getattr(labels, label)
        at = np.flatnonzero(np.isclose(values, wanted, rtol=1e-9) if label == "rms_slope" else values == wanted)
        if not len(at):
            there = ", ".join(f"{value:g}" if label == "rms_slope" else str(value) for value in values)
            raise ValueError(f"study {labels.study}: no {label} {wanted!r}; there are {there}")
        index[label] = int(at[0])
    status = int(dataset["status"].isel(index))
    if status in (MISSING, NOT_IN_DESIGN):
        raise ValueError(f"{labels}: this run is {'missing' if status == MISSING else 'not in the design'}")
    failure = dataset["failure"].isel(index).item()
    run = dataset.isel(index).drop_vars(["status", "failure", "step_count"])
    if "step" in run.dims:
        run = run.isel(step=slice(0, int(dataset["step_count"].isel(index))))
    for dim in (dim for dim in RAGGED if dim in dataset.dims):
        own = np.all([dataset[f"{dim}_{label}"].values == i for label, i in index.items()], axis=0)
        run = run.isel({dim: np.flatnonzero(own)}).drop_vars([f"{dim}_{label}" for label in LABELS])
    if status == INCOMPLETE:
        run = run.assign_attrs(incomplete=failure).isel(snapshot=np.isfinite(run["overlap_fraction"].values))
        run = run.drop_vars([name for name, variable in run.data_vars.items() if _unknown(variable)])
    integers = [name for name, variable in run.variables.items() if _filled_integer(variable)]
    return run.assign({name: run[name].astype(np.int32) for name in integers}).reset_coords(list(LABELS))


def _unknown(variable):
    """Whether a variable of a run that ended early has no value."""
    return variable.dtype.kind == "f" and not variable.dims and np.isnan(variable.values)


def _filled_integer(variable):
    """Whether a variable holds integers that are floats for others that are missing."""
    return variable.dtype.kind == "f" and variable.encoding.get("dtype") == np.dtype("int32")


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
