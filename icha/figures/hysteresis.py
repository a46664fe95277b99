"""Runs that were unloaded: their branches, means over their seeds, and one look for all figures that show them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.figures.curves import UNLOADING
from icha.figures.ensembles import draw_means
from icha.figures.errors import interfaces_of
from icha.figures.palette import (
    PLACE_MARKERS,
    closed_look,
    material_colours,
    material_layers,
    pale_look,
    place_markers,
)
from icha.figures.scale import MOST_COLOURS, materials_scale, places_scale
from icha.figures.select import NothingToDraw, shown_model, study_runs, ways_back
from icha.figures.style import GREY, legend_handle, material_label, slope_label
from icha.support.statistics import ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

# Tension of a smaller part of the largest pressure is rounding.
ROUNDING = 1e-9
BRANCH_DASHES = {"loading": "-", "unloading": UNLOADING["ls"]}


def unloaded_runs(campaign: xr.DataTree, study: str) -> list[tuple[RunLabels, xr.Dataset]]:
    """The runs of a study with a way back, without their spots and events.

    Raises
    ------
    NothingToDraw
        If no run is complete, or none was unloaded.
    ValueError
        If there is no such study.
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
    ValueError
        If there is no such study.
    """
    runs = [(labels, run) for labels, run in unloaded_runs(campaign, study) if "hysteresis_loss" in run]
    if not runs:
        raise NothingToDraw(f"study {study}: no run was unloaded to complete separation")
    return runs


def detached_runs_of(campaign: xr.DataTree, studies: Sequence[str]) -> Iterator[tuple[RunLabels, xr.Dataset]]:
    """`detached_runs` of the studies that have any.

    Raises
    ------
    NothingToDraw
        If none has.
    """
    reasons = []
    for study in studies:
        try:
            yield from detached_runs(campaign, study)
        except NothingToDraw as reason:
            reasons.append(str(reason))
    if reasons and len(reasons) == len(studies):
        raise NothingToDraw("; ".join(reasons))


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
    x, y : (k,) float, the means.
    x_band, y_band : (2, k) float, lower and upper ends of their 95 % bands; NaN of a single seed.
    counts : (k,) int, numbers of seeds.
    same_seeds : whether all points are of the same seeds.
    members : (seeds, k, 2) float, x and y of every seed; NaN where a point lacks it.
    asked : (k,) int, numbers of seeds asked for.
    """

    x: np.ndarray
    y: np.ndarray
    x_band: np.ndarray
    y_band: np.ndarray
    counts: np.ndarray
    same_seeds: bool
    members: np.ndarray
    asked: np.ndarray


def averages(
    points: Sequence[Mapping[int, tuple[float, float]]], factor: float = 1.0, asked: Sequence[int] | None = None
) -> Averages:
    """Means over the seeds that all points of a line have, or over each point's own where they share none.

    Parameters
    ----------
    points : for every point of the line x and y of every seed, neither of them negative as a rule.
    factor : unit of y, which it is multiplied by.
    asked : for every point the number of seeds asked for; left out, those that there are.

    Returns
    -------
    Averages in the order of x.
    """
    common = set.intersection(*(set(point) for point in points))
    seeds = sorted(common or set().union(*points))
    members = np.full((len(seeds), len(points), 2), np.nan)
    for k, point in enumerate(points):
        for row, seed in enumerate(seeds):
            if seed in point:
                members[row, k] = np.array(point[seed]) * (1.0, factor)
    over = ensemble(members)
    low, high = over.band(positive=True)
    order = np.argsort(over.mean[:, 0], kind="stable")
    bands = (np.array([low[order, axis], high[order, axis]]) for axis in (0, 1))
    asked = np.array([len(point) for point in points] if asked is None else asked)[order]
    return Averages(*over.mean[order].T, *bands, over.count[order, 0], bool(common), members[:, order], asked)


def draw_averages(axes, line: Averages, **look):
    """Draw the points of a line, with bars of their 95 % confidence or with their seeds where these are few."""
    # A coordinate that all seeds share, such as a slope, has no bar.
    x_band = line.x_band if np.any(line.x_band[1] > line.x_band[0] * (1 + 1e-9)) else None
    return draw_means(
        axes, (line.x, x_band), (line.y, line.y_band), line.counts, np.moveaxis(line.members, -1, 0), look, line.asked
    )


class Lines:
    """Look and name of every line of a figure: a colour for every material, a marker for every surface and slope.

    The markers of lines without adhesion are open. A figure of one material has a colour of a map for every surface and
    slope. Of many materials, or many surfaces and slopes, those have colours of a `scale`, which is None otherwise.
    """

    def __init__(self, campaign: xr.DataTree, studies: Sequence[str], keys: Sequence[tuple]):
        """Take the studies that are drawn, and material, surface and slope (None: not told apart) of every line."""
        self.keys = list(dict.fromkeys(keys))
        self.materials = list(dict.fromkeys(material for material, *_ in self.keys))
        self.places = list(dict.fromkeys((surface, slope) for _, surface, slope in self.keys))
        self.interfaces = interfaces_of({study: campaign[study].to_dataset() for study in studies}, self.materials)
        self.palette, self.markers = material_colours(campaign), place_markers(self.places)
        self.layers = material_layers(self.interfaces, self.materials)
        self.many_places = len(self.places) > MOST_COLOURS
        self.scale = places_scale(self.places) if self.many_places else None
        if not self.many_places and len(self.materials) > MOST_COLOURS:
            self.scale = materials_scale(self.interfaces, self.materials)

    def adhesive(self, material: str) -> bool:
        """Whether a material has surface energy."""
        return self.layers[material].adhesive

    def colour(self, key: tuple) -> str:
        """Colour of a line."""
        material, *place = key
        if self.scale:
            at = self.places.index(tuple(place)) if self.many_places else self.materials.index(material)
            return self.scale.colours[at]
        if len(self.materials) == 1 < len(self.places):
            return places_scale(self.places).colours[self.places.index(tuple(place))]
        return self.palette[material]

    def marker(self, key: tuple, *, applicable: bool = True) -> dict:
        """Look of a line's markers, arguments of `Axes.plot`; pale if the asperity model is not applicable."""
        material, *place = key
        marker = self.markers[tuple(place)]
        if self.many_places:
            marker = PLACE_MARKERS[self.materials.index(material) % len(PLACE_MARKERS)]
        look = closed_look(self.colour(key), self.layers[material])
        own = {name: look[name] for name in ("mec", "mfc", "mew", "ms", "zorder")} | {"marker": marker}
        return own if applicable else pale_look(own | {"color": look["color"]})

    def handles(self, **look) -> dict[str, Line2D]:
        """Legend of what tells the lines apart: materials by colour, surfaces and slopes by marker, in `look`.

        What the scale tells is not in it.
        """
        first = self.places[0]
        if self.many_places:
            several = self.materials if 1 < len(self.materials) <= MOST_COLOURS else []
            grey = {"color": GREY, "mec": GREY}
            return {
                material_label(self.interfaces, material): legend_handle(
                    **look | self.marker((material, *first)) | grey
                )
                for material in several
            }
        if len(self.materials) == 1:
            return {
                self.name(key): legend_handle(color=self.colour(key), **look | self.marker(key)) for key in self.keys
            }
        handles = {
            material_label(self.interfaces, material): legend_handle(
                color=self.colour((material, *first)), **look | self.marker((material, *first))
            )
            for material in ([] if self.scale else self.materials)
        }
        # Places that are not told apart by slope have the first marker, which the materials show.
        for place in self.places if len(self.places) > 1 else []:
            name = self._place_name(place)
            if name:
                grey = {"mec": GREY, "mfc": GREY, "ls": "none"}
                handles[name] = legend_handle(**look | self.marker((self.materials[0], *place)) | grey)
        return handles

    def _place_name(self, place):
        surface, slope = place
        parts = [surface] if len({each for each, _ in self.places}) > 1 else []
        if slope is not None and len({each for _, each in self.places}) > 1:
            parts.append(slope_label(slope))
        return ", ".join(parts)

    def name(self, key: tuple) -> str:
        """What a line is called: what tells it apart in this figure."""
        material, *place = key
        parts = [material_label(self.interfaces, material)] if len(self.materials) > 1 else []
        parts.append(self._place_name(place))
        return ", ".join(filter(None, parts)) or material_label(self.interfaces, material)


def say_which_model(axes: Axes, campaign: xr.DataTree, studies: Iterable[str]) -> None:
    """Name above a panel the model whose runs of some studies it shows; those by the other one are not there."""
    models = dict.fromkeys(shown_model(campaign[study].to_dataset()) for study in studies)
    axes.set_title(", ".join(MODELS[model].words for model in models), loc="right")


def several(name: str, studies: Sequence[str]) -> list[str]:
    """The studies of an argument, each once.

    Raises
    ------
    ValueError
        If it is not a list, or empty.
    """
    if isinstance(studies, str) or not studies:
        raise ValueError(f"{name}: {studies!r} is not a list of at least one study")
    return list(dict.fromkeys(studies))
