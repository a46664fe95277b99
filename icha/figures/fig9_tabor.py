"""Fig. 9: contact area and mean separation against the Tabor parameter, at one load."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from icha.figures.curves import AREA_LABEL, gap_label
from icha.figures.declaration import Campaign, Declaration, SnapshotFigure
from icha.figures.ensembles import draw_points, points_handles
from icha.figures.looks import Looks, legend_below, named_handles
from icha.figures.select import NothingToDraw, asked_seeds, is_applicable, snapshot_label, study_runs
from icha.figures.style import GREY, material_label, new_panels, styled
from icha.support.statistics import ensemble
from icha.support.values import Problem

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class TaborFigure(SnapshotFigure):
    """A figure of one snapshot of all runs of a study, whose materials differ in their range of attraction."""

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """A study without adhesion is one more."""
        if not any(campaign.materials[name].surface_energy > 0 for name in study.materials):
            reason = "has no material with adhesion, so no Tabor parameter; allowed: a study with one"
            yield ("study",), self.study, reason
        yield from super().study_problems(campaign, study)


DECLARATION = Declaration(
    description=(
        "Contact area and mean separation against the Tabor parameter. The study needs materials with adhesion that "
        "differ in their `interaction_range`."
    ),
    options=TaborFigure,
)

# The panels reach at least this part of the mean value up and down.
_LEAST_REACH = 0.05


@styled
def figure(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw all runs of a study at one snapshot."""
    curves, bare, shown = _points(campaign, study, kind, target)
    dataset = campaign[study].to_dataset()
    contacts = [contact for contact, _ in curves]
    # Materials that differ only in their range are one line, so that their range is not in its name.
    interfaces = dataset.sel(material=list(dict.fromkeys(material for material, *_ in contacts)))
    looks = Looks(campaign, interfaces, contacts)
    fig, [panels] = new_panels(3.1)
    drawn = []
    for (contact, applicable), points in curves.items():
        name = material_label(interfaces, contact[0]) if looks.scale else looks.name(contact)
        drawn += _draw_curve(panels, points, {"label": name} | looks.look(contact, applicable=applicable))
    for k, (contact, members) in enumerate(bare.items()):
        colour = looks.colour(contact) if looks.by_place else GREY
        name = None if k else "no adhesion"
        for ax, mean in zip(panels, ensemble(members).mean, strict=True):
            ax.axhline(mean, color=colour, ls=(0, (5, 2)), lw=1, label=name, zorder=1)
    for ax, label in zip(panels, (AREA_LABEL, gap_label(dataset)), strict=True):
        _finish(ax, min(drawn), max(drawn))
        ax.set_ylabel(label)
    panels[0].set_title(shown, loc="right")
    counts = [len(members) for points in curves.values() for members, _ in points.values()]
    legend_below(fig, named_handles(panels) | points_handles(counts), scale=looks.scale, panels=panels)
    return fig


def _points(campaign, study, kind, target):
    """Of every curve its points by range of attraction, a (Tabor parameter, area, separation) for each seed, and how
    many seeds were asked for; those without adhesion by contact, (area, separation) for each seed; and what snapshot
    it is. Materials that differ only in their range are a curve, named as the first of them; runs to which the
    asperity model is not applicable are curves of their own.
    """
    from icha.datasets.campaign import find_snapshot

    runs, dataset = study_runs(campaign, study, ragged=False), campaign[study].to_dataset()
    first_of: dict[tuple, str] = {}
    curves: dict[tuple, dict[float, tuple[dict[int, tuple], int]]] = {}
    bare: dict[tuple, list] = {}
    for labels, run in runs:
        at = find_snapshot(run, kind, target)
        step = int(run["snapshot_step"].values[at])
        state = [float(run[name].values[step]) for name in ("contact_area_fraction", "reduced_separation")]
        modulus, energy, reach = (float(run[name]) for name in _INTERFACE)
        contact = first_of.setdefault((modulus, energy), labels.material), labels.surface, labels.rms_slope
        if energy > 0:
            points = curves.setdefault((contact, is_applicable(run)), {})
            members, _ = points.setdefault(reach, ({}, asked_seeds(dataset, labels)))
            members[labels.seed] = (float(run["tabor_parameter"]), *state)
        elif is_applicable(run):
            bare.setdefault(contact, []).append(state)
        shown = snapshot_label(run, at)
    if not curves:
        raise NothingToDraw(f"study {study}: no complete run with adhesion, so none with a Tabor parameter")
    return curves, bare, shown


_INTERFACE = ("contact_modulus", "surface_energy", "interaction_range")


def _draw_curve(panels, points, look):
    """Draw the means over the seeds in both panels; their Tabor parameters."""
    seeds = sorted({seed for members, _ in points.values() for seed in members})
    # Along seeds, points and (Tabor parameter, area, separation); NaN where a point lacks a seed.
    states = np.full((len(seeds), len(points), 3), np.nan)
    for k, (members, _) in enumerate(points.values()):
        states[[seeds.index(seed) for seed in members], k] = list(members.values())
    asked = np.array([asked for _, asked in points.values()])
    mu = np.nanmean(states[..., 0], axis=0)
    order = np.argsort(mu)
    for k, ax in enumerate(panels, 1):
        draw_points(ax, mu[order], states[:, order, k], look, positive=True, asked=asked[order])
    return mu.tolist()


def _finish(ax, smallest, largest):
    """Shade where the jump-in was not verified, and choose the limits of the axes."""
    from icha.asperity.material import WU_HOLDS_FROM

    low, high = ax.get_xlim()
    # A range of attraction that was rounded does not leave what was verified.
    if smallest < WU_HOLDS_FROM / 1.01:
        ax.axvspan(low, WU_HOLDS_FROM, color="0.93", lw=0, zorder=0)
    ax.set_xlim(low, high)
    ax.set_xlabel(r"Tabor parameter  $\mu$")
    bottom, top = ax.get_ylim()
    # Differences of a few per mille are not blown up to fill the panel.
    reach = max(0.65 * (top - bottom), _LEAST_REACH * 0.5 * (top + bottom))
    ax.set_ylim(0.5 * (bottom + top) - reach, 0.5 * (bottom + top) + reach)
