"""Select what a figure shows from a campaign dataset.

All functions raise ValueError if the campaign has no such study, run or snapshot; the message names those it has.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS, REFERENCE_MODEL, first_model
from icha.datasets.labels import LABELS, RunLabels, place_of, surfaces_and_slopes
from icha.figures.style import format_number

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


class NothingToDraw(ValueError):
    """A study has no complete run of the kind that a figure shows; the message names what is missing."""


class ContactRuns(NamedTuple):
    """The complete runs of one contact with one model, one for each seed.

    Runs to which the asperity model is not applicable are apart from the others.

    Attributes
    ----------
    labels : labels of the first run.
    by_seed : the runs, by seed.
    asked : number of seeds that the study requests.
    applicable : whether the asperity model is applicable to the runs.
    """

    labels: RunLabels
    by_seed: dict[int, xr.Dataset]
    asked: int
    applicable: bool

    @property
    def contact(self) -> tuple[str, str, float]:
        """Material, surface and rms slope."""
        return self.labels.material, self.labels.surface, self.labels.rms_slope


def group_by_contact(campaign: xr.DataTree, runs: Iterable[tuple[RunLabels, xr.Dataset]]) -> list[ContactRuns]:
    """Group runs of the campaign that differ only in their seed."""
    found: dict[tuple, ContactRuns] = {}
    for labels, run in runs:
        key = labels._replace(seed=None), is_applicable(run)
        if key not in found:
            asked = asked_seeds(campaign[labels.study].to_dataset(), labels)
            found[key] = ContactRuns(labels, {}, asked, key[1])
        found[key].by_seed[labels.seed] = run
    return list(found.values())


def select_runs(
    campaign: xr.DataTree, study: str, *, ragged: bool = True, model: str | None = None
) -> list[tuple[RunLabels, xr.Dataset]]:
    """Return all complete runs of a study with a model.

    Parameters
    ----------
    ragged : whether the runs have their spots and events, which take long to select.
    model : name of the model; left out, the `shown_model` of the study.

    Raises
    ------
    NothingToDraw
        If no run of the `shown_model` is complete.
    """
    import xarray as xr

    from icha.datasets.campaign import reduced_gap, runs_of_status, select_run
    from icha.datasets.variables.campaign import LOADED_RUNS, RAGGED

    if study not in campaign.children:
        raise ValueError(f"no study {study!r} in this campaign; expected one of: {', '.join(campaign.children)}")
    dataset = campaign[study].to_dataset()
    wanted = model or shown_model(dataset)
    found = [labels for labels in runs_of_status(dataset, study, LOADED_RUNS) if labels.model == wanted]
    if not found and model is None:
        raise NothingToDraw(f"study {study}: no run is complete")
    if not ragged:
        campaign = xr.DataTree.from_dict({f"/{study}": dataset.drop_dims(RAGGED, errors="ignore")})
    runs = [(labels, select_run(campaign, labels)) for labels in found]
    return [(labels, run.assign(reduced_separation=reduced_gap(run))) for labels, run in runs]


def asked_seeds(study: xr.Dataset, labels: RunLabels) -> int:
    """Return the number of seeds that a study requests of a run's model, surface, slope and material."""
    from icha.datasets.variables.campaign import COMPUTED_RUNS, MISSING

    at = place_of(study, {label: getattr(labels, label) for label in LABELS if label != "seed"})
    return int(np.isin(study["status"].isel(at).values, (*COMPUTED_RUNS, MISSING)).sum())


def is_applicable(run: xr.Dataset) -> bool:
    """Return whether a run has no known reason against the use of the asperity model."""
    return not run.attrs.get("applicability")


def shown_model(study: xr.Dataset) -> str:
    """Return the model that figures show first of a study: asperities, or else the study's first model."""
    return first_model(study["model"].values.tolist())


def select_by_labels(
    runs: Iterable[tuple[RunLabels, xr.Dataset]], **wanted: object
) -> list[tuple[RunLabels, xr.Dataset]]:
    """Return the runs with the wanted labels; for a label that is None, those with the label of the first such run.

    Raises
    ------
    NothingToDraw
        If no run has a wanted label.
    """
    runs = list(runs)
    for name, value in wanted.items():
        present = [getattr(labels, name) for labels, _ in runs]
        value = present[0] if value is None else value
        if value not in present:
            complete = ", ".join(map(str, dict.fromkeys(present)))
            raise NothingToDraw(f"no run of {name} {value} is complete; complete runs have {name}: {complete}")
        runs = [(labels, run) for labels, run in runs if getattr(labels, name) == value]
    return runs


def select_complete_run(campaign: xr.DataTree, labels: RunLabels) -> xr.Dataset:
    """Return a run of the campaign; raise `NothingToDraw` if it is not complete."""
    from icha.datasets.campaign import run_place, select_run
    from icha.datasets.variables.campaign import COMPLETE

    dataset = campaign[labels.study].to_dataset()
    if dataset["status"].isel(run_place(dataset, labels)) != COMPLETE:
        raise NothingToDraw(f"{labels}: this run is not complete")
    return select_run(campaign, labels)


def path_steps(run: xr.Dataset) -> xr.Dataset:
    """Return the first loading's steps at the study's targets, without those added for snapshots of another kind."""
    from icha.datasets.campaign import loading_stops

    run = run.isel(step=loading_stops(run).values)
    kinds = [str(kind) for kind in run["step_kind"].values]
    main = max(dict.fromkeys(kinds), key=kinds.count, default=None)
    return run.isel(step=[kind == main for kind in kinds])


def branches(run: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the branch and the steps of every leg of a run; a leg begins with the last step of the previous leg."""
    legs = run["leg"].values
    for leg in np.unique(legs):
        steps = np.flatnonzero(legs == leg)
        yield str(run["branch"].values[steps[0]]), run.isel(step=slice(max(steps[0] - 1, 0), steps[-1] + 1))


def unloading_legs(run: xr.Dataset) -> list[xr.Dataset]:
    """Return the legs of a run that unload, each from its turning point on."""
    return [leg for branch, leg in branches(run) if branch == "unloading"]


class Snapshots(NamedTuple):
    """The runs of one contact, and the snapshots of the same state that they keep.

    Attributes
    ----------
    runs : the runs.
    members : each run, and the position of its snapshot.
    truths : the same with boundary elements, of the seeds that have it; empty if `runs` are boundary elements.
    """

    runs: ContactRuns
    members: list[tuple[xr.Dataset, int]]
    truths: list[tuple[xr.Dataset, int]]


def select_snapshots(
    campaign: xr.DataTree, study: str, kind: str | None = None, target: float | None = None
) -> list[Snapshots]:
    """Return a snapshot of every run of the `shown_model` on the first surface and slope of a study."""
    from icha.datasets.campaign import find_snapshot

    groups = group_by_contact(campaign, select_runs(campaign, study))
    reference = [] if groups[0].labels.model == REFERENCE_MODEL else select_runs(campaign, study, model=REFERENCE_MODEL)
    found = []
    for group in groups:
        if group.contact[1:] == groups[0].contact[1:]:
            members = [(run, find_snapshot(run, kind, target)) for run in group.by_seed.values()]
            run, at = members[0]
            state = str(run["snapshot_kind"].values[at]), float(run["snapshot_target"].values[at])
            found.append(Snapshots(group, members, []))
            for labels, truth in reference:
                if labels._replace(model=group.labels.model, seed=group.labels.seed) == group.labels:
                    with contextlib.suppress(ValueError):  # if the run does not keep the snapshot
                        found[-1].truths.append((truth, find_snapshot(truth, *state)))
    return found


_KIND_LABELS = {
    "reduced_pressure": r"$F/(E^{\ast}h_{\mathrm{rms}}^{\prime}A_0)$",
    "relative_load": r"$F/(E^{\ast}A_0)$",
    "area_fraction": r"$A/A_0$",
    "mean_separation": r"$\bar{u}$ (m)",
}


def snapshot_label(run: xr.Dataset, snapshot: int) -> str:
    """Return load, area or separation of a snapshot in words."""
    kind, value = str(run["snapshot_kind"].values[snapshot]), float(run["snapshot_target"].values[snapshot])
    if kind == "pull_off":
        return "pull-off"
    return f"{_KIND_LABELS[kind]} = {format_number(value)}"


def select_errors(model_error: xr.DataTree | None, study: str) -> Iterator[tuple[tuple[str, str, float], xr.Dataset]]:
    """Yield the errors of each contact of a study, along seeds and loads.

    Parameters
    ----------
    model_error : dataset of `icha.analysis.model_error.model_error`; None without boundary elements.

    Yields
    ------
    Material, surface and rms slope; errors of one entry for this contact, all NaN if the entry does not have it.
    """
    for node in model_error.children.values() if model_error is not None else ():
        if node.attrs["study"] != study:
            continue
        errors = node.to_dataset().transpose("seed", ...)
        for material, (surface, slope) in itertools.product(errors["material"].values, surfaces_and_slopes(errors)):
            labels = {"surface": surface, "rms_slope": slope, "material": material}
            yield (str(material), surface, slope), errors.isel(place_of(errors, labels))


def asked_of_entry(errors: xr.Dataset) -> int:
    """Return the number of seeds, complete or not, for which an entry of a model error compares a contact."""
    from icha.datasets.variables.campaign import NOT_IN_DESIGN

    return int((errors["status"] != NOT_IN_DESIGN).sum("seed"))


# --- runs that were unloaded, and pull-offs and losses as lines of points ---

# Tension below this fraction of the largest pressure is rounding.
ROUNDING = 1e-9


def select_unloaded_runs(campaign: xr.DataTree, study: str) -> list[tuple[RunLabels, xr.Dataset]]:
    """Return the runs of a study that unload, without their spots and events, along their mean separation.

    The work of the load is the integral over the mean separation, also on a free square, whose mean gap is different.

    Raises
    ------
    NothingToDraw
        If no run is complete, or none unloads.
    """
    runs = [(labels, run) for labels, run in select_runs(campaign, study, ragged=False) if unloading_legs(run)]
    if not runs:
        raise NothingToDraw(f"study {study}: no run was unloaded; expected a study that unloads")
    return [(labels, run.assign(reduced_separation=run["mean_separation"] / run["rms_height"])) for labels, run in runs]


def select_detached_lines(
    campaign: xr.DataTree, studies: Sequence[str], *, along_slopes: bool = False
) -> dict[tuple[tuple[str, str, float | None], bool], list[ContactRuns]]:
    """Return the runs of some studies that were unloaded to complete separation, as lines of points.

    Parameters
    ----------
    along_slopes : whether rms slopes are points on a line, and not different lines.

    Returns
    -------
    The runs of every point, by contact and whether the asperity model is applicable.

    Raises
    ------
    NothingToDraw
        If no study has any such run.
    """
    found, reasons = {}, []
    for study in studies:
        try:
            runs = [each for each in select_unloaded_runs(campaign, study) if "hysteresis_loss" in each[1]]
        except NothingToDraw as reason:
            reasons.append(str(reason))
            continue
        if not runs:
            reasons.append(f"study {study}: no run was unloaded to complete separation")
        for point in group_by_contact(campaign, runs):
            material, surface, slope = point.contact
            line = (material, surface, None if along_slopes else slope), point.applicable
            found.setdefault(line, []).append(point)
    if reasons and not found:
        raise NothingToDraw("; ".join(reasons))
    return found


def pull_off_step(run: xr.Dataset) -> int | None:
    """Return the step of largest tension on the last unloading, or None without tension."""
    last = unloading_legs(run)[-1]
    lowest = int(np.argmin(last["nominal_pressure"].values))
    step = np.flatnonzero(run["step"].values == last["step"].values[lowest])[0]
    pressure = run["nominal_pressure"].values
    return int(step) if pressure[step] < -ROUNDING * pressure.max() else None


def name_model(axes: Axes, campaign: xr.DataTree, studies: Iterable[str]) -> None:
    """Write the model of some studies above a panel."""
    models = dict.fromkeys(shown_model(campaign[study].to_dataset()) for study in studies)
    axes.set_title(", ".join(MODELS[model].words for model in models), loc="right")
