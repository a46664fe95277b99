"""Runs that were unloaded: their branches, means over their seeds, and one look for all figures that show them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.figures.curves import UNLOADING
from icha.figures.ensembles import draw_means
from icha.figures.looks import Contact, Looks, interfaces_of
from icha.figures.select import NothingToDraw, asked_seeds, is_applicable, shown_model, study_runs, ways_back
from icha.support.statistics import Ensemble, ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Tension of a smaller part of the largest pressure is rounding.
ROUNDING = 1e-9
BRANCH_DASHES = {"loading": "-", "unloading": UNLOADING["ls"]}


def unloaded_runs(campaign: xr.DataTree, study: str) -> list[tuple[RunLabels, xr.Dataset]]:
    """The runs of a study with a way back, without their spots and events.

    Raises
    ------
    NothingToDraw
        If no run is complete, or none was unloaded.
    """
    runs = [(labels, run) for labels, run in study_runs(campaign, study, ragged=False) if ways_back(run)]
    if not runs:
        raise NothingToDraw(f"study {study}: no run was unloaded, so there is no way back to draw")
    return [(labels, _by_separation(run)) for labels, run in runs]


def _by_separation(run):
    """A run along its mean separation also where that is not the mean gap: it is what the load does its work along."""
    if str(run["boundary"].values) != "free":
        return run
    return run.assign(reduced_separation=run["mean_separation"] / run["rms_height"])


def detached_runs(campaign: xr.DataTree, study: str) -> list[tuple[RunLabels, xr.Dataset]]:
    """The runs of a study that were unloaded to complete separation, so that they have a pull-off and a loss.

    Raises
    ------
    NothingToDraw
        If there is no such run in the study.
    """
    runs = [(labels, run) for labels, run in unloaded_runs(campaign, study) if "hysteresis_loss" in run]
    if not runs:
        raise NothingToDraw(f"study {study}: no run was unloaded to complete separation")
    return runs


def detached_lines(
    campaign: xr.DataTree, studies: Sequence[str], *, along_slopes: bool = False
) -> dict[tuple[Contact, bool], dict[RunLabels, dict[int, xr.Dataset]]]:
    """`detached_runs` of the studies that have any, by line, point on it, and seed.

    Parameters
    ----------
    along_slopes : whether rms slopes are points on a line, and not different lines.

    Returns
    -------
    By contact, and whether the asperity model is applicable: by labels without seed: the runs by seed.

    Raises
    ------
    NothingToDraw
        If no study has any such run.
    """
    found, reasons = {}, []
    for study in studies:
        try:
            runs = detached_runs(campaign, study)
        except NothingToDraw as reason:
            reasons.append(str(reason))
            continue
        for labels, run in runs:
            contact = labels.material, labels.surface, None if along_slopes else labels.rms_slope
            line = found.setdefault((contact, is_applicable(run)), {})
            line.setdefault(labels._replace(seed=None), {})[labels.seed] = run
    if reasons and not found:
        raise NothingToDraw("; ".join(reasons))
    return found


def pull_off_step(run: xr.Dataset) -> int | None:
    """The step of largest tension on the last unloading; None where there is no tension on it."""
    back = ways_back(run)[-1]
    lowest = int(np.argmin(back["nominal_pressure"].values))
    step = np.flatnonzero(run["step"].values == back["step"].values[lowest])[0]
    pressure = run["nominal_pressure"].values
    return int(step) if pressure[step] < -ROUNDING * pressure.max() else None


class Averages(NamedTuple):
    """Means over seeds of the points of a line, in the order of x.

    Parameters
    ----------
    members : (seeds, k, 2) float, x and y of every seed; NaN where a point lacks it.
    over : their means, bands and counts, (k, 2) each.
    same_seeds : whether all points are of the same seeds.
    asked : (k,) int, numbers of seeds asked for.
    """

    members: np.ndarray
    over: Ensemble
    same_seeds: bool
    asked: np.ndarray

    @property
    def x(self) -> np.ndarray:
        """Means of x."""
        return self.over.mean[:, 0]

    @property
    def y(self) -> np.ndarray:
        """Means of y."""
        return self.over.mean[:, 1]


def averages(
    points: Sequence[Mapping[int, tuple[float, float]]], factor: float = 1.0, asked: Sequence[int] = ()
) -> Averages:
    """Means over the seeds that all points of a line have, or over each point's own where they share none.

    Parameters
    ----------
    points : for every point of the line x and y of every seed, neither of them negative as a rule.
    factor : unit of y, which it is multiplied by.
    asked : for every point the number of seeds asked for; left out, those that there are.
    """
    common = set.intersection(*(set(point) for point in points))
    seeds = sorted(common or set().union(*points))
    members = np.array([[point.get(seed, (np.nan, np.nan)) for point in points] for seed in seeds]) * (1.0, factor)
    order = np.argsort(ensemble(members).mean[:, 0], kind="stable")
    members, asked = members[:, order], np.array([*(asked or map(len, points))])[order]
    return Averages(members, ensemble(members), bool(common), asked)


def averages_of(
    campaign: xr.DataTree, line: Mapping[RunLabels, Mapping[int, xr.Dataset]], x: str, y: str, factor: float = 1.0
) -> Averages:
    """`averages` of two quantities of the runs of a line of `detached_lines`."""
    points = [{seed: (float(run[x]), float(run[y])) for seed, run in seeds.items()} for seeds in line.values()]
    return averages(points, factor, [asked_seeds(campaign[labels.study].to_dataset(), labels) for labels in line])


def draw_averages(axes: Axes, line: Averages, **look):
    """Draw the points of a line, with bars of their 95 % confidence or with their seeds where these are few."""
    low, high = line.over.band(positive=True)
    # A coordinate that all seeds share, such as a slope, has no bar.
    x_band = (low[:, 0], high[:, 0]) if np.any(high[:, 0] > low[:, 0] * (1 + 1e-9)) else None
    y, counts = (line.y, (low[:, 1], high[:, 1])), line.over.count[:, 0]
    return draw_means(axes, (line.x, x_band), y, counts, np.moveaxis(line.members, -1, 0), look, line.asked)


def looks_of(campaign: xr.DataTree, studies: Sequence[str], contacts: Iterable[Contact]) -> Looks:
    """Looks of the lines of some studies; of a single material they have the colours of surfaces and slopes."""
    contacts = list(contacts)
    interfaces = interfaces_of(campaign[study].to_dataset() for study in studies)
    return Looks(campaign, interfaces, contacts, by_place=len({material for material, *_ in contacts}) == 1)


def say_which_model(axes: Axes, campaign: xr.DataTree, studies: Iterable[str]) -> None:
    """Name above a panel the model whose runs of some studies it shows; those by the other one are not there."""
    models = dict.fromkeys(shown_model(campaign[study].to_dataset()) for study in studies)
    axes.set_title(", ".join(MODELS[model].words for model in models), loc="right")
