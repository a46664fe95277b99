"""Picking what a figure shows out of a campaign dataset.

All functions raise ValueError where the campaign has no such study, run or snapshot, naming what there is.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import REFERENCE_MODEL, first_of
from icha.datasets.labels import LABELS, RunLabels, place_of, slopes_of
from icha.datasets.variables.model_error import FINITE_RANGE
from icha.figures.style import number, slope_label

if TYPE_CHECKING:
    import xarray as xr


class NothingToDraw(ValueError):
    """A study has no complete run of the kind that a figure shows; the message says what is lacking."""


def study_runs(
    campaign: xr.DataTree, study: str, *, ragged: bool = True, model: str | None = None
) -> list[tuple[RunLabels, xr.Dataset]]:
    """All complete runs of a study by a model, left out that which is shown (`shown_model`), at least one.

    Without their spots and events, which take long, if not `ragged`.

    Raises
    ------
    NothingToDraw
        If no run of the study is complete.
    """
    import xarray as xr

    from icha.datasets.campaign import reduced_gap, runs_of_status, select_run
    from icha.datasets.variables.campaign import COMPLETE, RAGGED

    _check_study(campaign, study)
    dataset = campaign[study].to_dataset()
    asked = model or shown_model(dataset)
    found = [labels for labels in runs_of_status(dataset, study, (COMPLETE,)) if labels.model == asked]
    if not found:
        raise NothingToDraw(f"study {study}: no run is complete, so there is nothing to draw")
    if not ragged:
        campaign = xr.DataTree.from_dict(
            {f"/{study}": dataset.drop_dims([dim for dim in RAGGED if dim in dataset.dims])}
        )
    runs = [(labels, select_run(campaign, labels)) for labels in found]
    return [(labels, run.assign(reduced_separation=reduced_gap(run))) for labels, run in runs]


def runs_by_boundary_elements(
    campaign: xr.DataTree, study: str, *, ragged: bool = False
) -> list[tuple[RunLabels, xr.Dataset]]:
    """All complete runs of a study by boundary elements, if any, without patches and events if not `ragged`."""
    try:
        return study_runs(campaign, study, ragged=ragged, model=REFERENCE_MODEL)
    except NothingToDraw:
        return []


def asked_seeds(study: xr.Dataset, labels: RunLabels) -> int:
    """Number of seeds that a study asks for of a run's model, surface, slope and material, whatever became of them."""
    from icha.datasets.variables.campaign import COMPUTED_RUNS, MISSING

    at = place_of(study, {label: getattr(labels, label) for label in LABELS if label != "seed"})
    return int(np.isin(study["status"].isel(at).values, (*COMPUTED_RUNS, MISSING)).sum())


def is_applicable(run: xr.Dataset) -> bool:
    """Whether nothing is known that makes the asperity model not applicable to a run."""
    return not run.attrs.get("applicability")


def shown_model(study: xr.Dataset) -> str:
    """The model whose runs figures show first of a study: asperities, or else the study's first."""
    return first_of(study["model"].values.tolist())


def _check_study(campaign, study):
    if study not in campaign.children:
        raise ValueError(f"no study {study!r} in this campaign; there are {', '.join(campaign.children)}")


def pick(labels: str, wanted, there: list):
    """`wanted` if it is there, the first one if nothing is wanted.

    Raises
    ------
    ValueError
        Naming what there is.
    """
    if wanted is None:
        return there[0]
    if wanted not in there:
        raise ValueError(f"no {labels} {wanted!r} in this study; there are {', '.join(map(str, there))}")
    return wanted


def pick_run(
    campaign: xr.DataTree,
    study: str,
    *,
    surface: str | None = None,
    seed: int | None = None,
    rms_slope: float | None = None,
    material: str | None = None,
) -> tuple[RunLabels, xr.Dataset]:
    """The first run asked for of a study and its `shown_model`, with adhesion if there is one and no material is named.

    Raises
    ------
    NothingToDraw
        If it is not complete.
    """
    from icha.datasets.campaign import run_labels, run_place, select_run
    from icha.datasets.variables.campaign import COMPLETE

    _check_study(campaign, study)
    model = shown_model(campaign[study].to_dataset())
    runs = [labels for labels in run_labels(campaign) if (labels.study, labels.model) == (study, model)]
    runs = [labels for labels in runs if surface in (None, labels.surface) and seed in (None, labels.seed)]
    runs = [labels for labels in runs if rms_slope is None or np.isclose(rms_slope, labels.rms_slope)]
    if not runs:
        raise ValueError(f"study {study}: no run of surface {surface}, seed {seed}, rms slope {rms_slope}")
    energy = campaign[study]["surface_energy"]
    adhesive = [labels.material for labels in runs if float(energy.sel(material=labels.material)) > 0]
    material = pick("material", material, adhesive + [labels.material for labels in runs])
    labels = next(labels for labels in runs if labels.material == material)
    status = campaign[study]["status"].isel(run_place(campaign[study].to_dataset(), labels))
    if int(status) != COMPLETE:
        raise NothingToDraw(f"{labels}: this run is not complete, so there is nothing to draw")
    return labels, select_run(campaign, labels)


def run_on_topography(
    campaign: xr.DataTree, study: str, topography: xr.Dataset, *, surface_name: str | None = None, **which: object
) -> tuple[RunLabels, xr.Dataset]:
    """The run that `pick_run` finds, if a surface file's dataset is its topography.

    Raises
    ------
    NothingToDraw
        If it is not complete.
    ValueError
        If there is no such study or run, or the surface is another one's.
    """
    labels, run = pick_run(campaign, study, surface=surface_name, **which)
    same = np.isclose(float(topography["period"]), float(run["period"]), rtol=1e-9)
    if not same or int(topography["grid"]) != int(run["grid"]):
        raise ValueError(f"{labels}: the surface given has another period or grid")
    if "seed" in topography and int(topography["seed"]) != labels.seed:
        raise ValueError(f"{labels}: the surface given has seed {int(topography['seed'])}")
    return labels, run


def path_steps(run: xr.Dataset) -> xr.Dataset:
    """The first loading's stops in the study's list of targets, without those added for snapshots of another kind."""
    from icha.datasets.campaign import loading_stops

    run = run.isel(step=loading_stops(run).values)
    kinds = [str(kind) for kind in run["step_kind"].values]
    main = max(dict.fromkeys(kinds), key=kinds.count, default=None)
    return run.isel(step=[kind == main for kind in kinds])


def branches(run: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Name and steps of every leg of a run, in their order; a leg begins with the last step of the one before."""
    legs = run["leg"].values
    for leg in np.unique(legs):
        own = np.flatnonzero(legs == leg)
        yield str(run["branch"].values[own[0]]), run.isel(step=slice(max(own[0] - 1, 0), own[-1] + 1))


def ways_back(run: xr.Dataset) -> list[xr.Dataset]:
    """The legs on which a run is unloaded, each from its turning point on; none of a run that only loads."""
    return [leg for name, leg in branches(run) if name == "unloading"]


class Snapshots(NamedTuple):
    """The runs of one contact, one for every seed, and where their snapshots of one kind and target are.

    `asked` is the number of seeds asked for, `applicable` whether the asperity model is applicable to the runs.
    """

    labels: RunLabels
    members: list[tuple[xr.Dataset, int]]
    asked: int = 0
    applicable: bool = True


def first_line(
    campaign: xr.DataTree, study: str, kind: str | None = None, target: float | None = None
) -> list[Snapshots]:
    """Of every material on the first surface and slope of a study a snapshot of every seed, by its `shown_model`.

    Runs to which the asperity model is not applicable are apart from the others of their material.
    """
    from icha.datasets.campaign import find_snapshot

    runs, dataset = study_runs(campaign, study), campaign[study].to_dataset()
    first = runs[0][0]
    found: dict[tuple[str, bool], Snapshots] = {}
    for labels, run in runs:
        if (labels.surface, labels.rms_slope) == (first.surface, first.rms_slope):
            key = labels.material, is_applicable(run)
            own = found.setdefault(key, Snapshots(labels, [], asked_seeds(dataset, labels), key[1]))
            own.members.append((run, find_snapshot(run, kind, target)))
    return list(found.values())


def same_snapshots_by_boundary_elements(campaign: xr.DataTree, lines: Sequence[Snapshots]) -> list[Snapshots]:
    """For every line by asperities the same snapshot by boundary elements, of those seeds that keep it, if any."""
    from icha.datasets.campaign import find_snapshot

    found = [line._replace(labels=line.labels._replace(model=REFERENCE_MODEL), members=[]) for line in lines]
    first = lines[0].labels
    if first.model == REFERENCE_MODEL:
        return found
    truths = runs_by_boundary_elements(campaign, first.study, ragged=True)
    for line, beside in zip(lines, found, strict=True):
        run, at = line.members[0]
        asked = str(run["snapshot_kind"].values[at]), float(run["snapshot_target"].values[at])
        for labels, truth in truths:
            if labels._replace(seed=beside.labels.seed) == beside.labels:
                with contextlib.suppress(ValueError):  # a run that does not keep it
                    beside.members.append((truth, find_snapshot(truth, *asked)))
    return found


def name_of_place(dataset: xr.Dataset, surface: str, rms_slope: float) -> str:
    """A surface and rms slope in words, as far as their study has several of them."""
    several = {surface: dataset.sizes["surface"] > 1, slope_label(rms_slope): len(slopes_of(dataset)) > 1}
    return ", ".join(text for text, shown in several.items() if shown)


_KIND_LABELS = {
    "reduced_pressure": r"$F/(E^{\ast}h_{\mathrm{rms}}^{\prime}A_0)$",
    "relative_load": r"$F/(E^{\ast}A_0)$",
    "area_fraction": r"$A/A_0$",
    "mean_separation": r"$\bar{u}$ (m)",
}


def snapshot_label(run: xr.Dataset, snapshot: int) -> str:
    """At which load, area or separation a snapshot was taken, for figures."""
    kind, value = str(run["snapshot_kind"].values[snapshot]), float(run["snapshot_target"].values[snapshot])
    if kind == "pull_off":
        return "pull-off"
    return f"{_KIND_LABELS[kind]} = {number(value)}"


def study_errors(model_error: xr.DataTree | None, study: str) -> dict[str, xr.Dataset]:
    """The entries of a model error that compare the runs of a study, by name; none where no error is given."""
    entries = model_error.children if model_error is not None else {}
    return {name: node.to_dataset() for name, node in entries.items() if node.attrs["study"] == study}


def finite_range_errors(model_error: xr.DataTree | None, study: str) -> dict[str, xr.Dataset]:
    """Those of `study_errors` that compare with boundary elements at a finite range."""
    entries = study_errors(model_error, study)
    return {name: errors for name, errors in entries.items() if errors.attrs["truth"] == FINITE_RANGE}


def asked_of_entry(errors: xr.Dataset) -> np.ndarray:
    """Numbers of seeds that an entry of a model error compares, whatever became of their runs, along other labels."""
    from icha.datasets.variables.campaign import NOT_IN_DESIGN

    return (errors["status"] != NOT_IN_DESIGN).sum("seed").values
