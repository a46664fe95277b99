"""Runs that were unloaded: their legs, and their pull-offs and losses as lines of points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.figures.looks import Contact
from icha.figures.select import (
    ContactRuns,
    NothingToDraw,
    group_by_contact,
    select_runs,
    shown_model,
    unloading_legs,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Tension below this fraction of the largest pressure is rounding.
ROUNDING = 1e-9


class Leg(NamedTuple):
    """A leg of a run, or the mean of the legs of several seeds.

    Attributes
    ----------
    branch : `loading` or `unloading`.
    values : reduced separation, reduced pressure and contact area fraction along the leg.
    members : reduced pressure and contact area fraction of every seed, (seeds, k) each; empty for a single run.
    """

    branch: str
    values: xr.Dataset
    members: dict[str, np.ndarray]


def average_legs(runs: Sequence[Sequence[tuple[str, xr.Dataset]]]) -> list[Leg]:
    """Return means over the seeds, at common separations, of the legs of runs, given by branch and steps.

    If the runs differ in their number of legs, return all legs.
    """
    from icha.analysis.common_loads import at_common_displacements

    if len(runs) == 1 or len({len(legs) for legs in runs}) > 1:
        return [Leg(branch, leg, {}) for legs in runs for branch, leg in legs]
    found = []
    for members in zip(*runs, strict=True):
        branch, first = members[0]
        separation, values = at_common_displacements([leg for _, leg in members])
        means = {name: ("step", of_seeds.mean(axis=0)) for name, of_seeds in values.items()}
        means["reduced_separation"] = ("step", separation)
        found.append(Leg(branch, first.drop_dims("step").assign(means), values))
    return found


def select_unloaded_runs(campaign: xr.DataTree, study: str) -> list[tuple[RunLabels, xr.Dataset]]:
    """Return the runs of a study that unload, without their spots and events, along their mean separation.

    The work of the load is the integral over the mean separation, also on a free square, whose mean gap is different.

    Raises
    ------
    NothingToDraw
        If no run is complete, or none was unloaded.
    """
    runs = [(labels, run) for labels, run in select_runs(campaign, study, ragged=False) if unloading_legs(run)]
    if not runs:
        raise NothingToDraw(f"study {study}: no run was unloaded; expected a study that unloads")
    return [
        (labels, run.assign(reduced_separation=run["mean_separation"] / run["rms_height"]))
        if str(run["boundary"].values) == "free"
        else (labels, run)
        for labels, run in runs
    ]


def select_detached_lines(
    campaign: xr.DataTree, studies: Sequence[str], *, along_slopes: bool = False
) -> dict[tuple[Contact, bool], list[ContactRuns]]:
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
