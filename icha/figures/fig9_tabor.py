"""Fig. 9: contact area and mean separation against the Tabor parameter, at one load."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.figures.curves import AREA_LABEL, gap_label
from icha.figures.declaration import Declaration, SnapshotFigure
from icha.figures.ensembles import Points, points_handles
from icha.figures.looks import Looks, legend_below, named_handles
from icha.figures.select import ContactRuns, NothingToDraw, group_by_contact, select_runs, snapshot_label
from icha.figures.style import GREY, in_style, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


DECLARATION = Declaration(
    description=(
        "Contact area and mean separation against the Tabor parameter, for studies whose materials differ in "
        "`interaction_range`."
    ),
    options=SnapshotFigure,
)

# The axis of the Tabor parameter is logarithmic if the ratio of its largest to its smallest value exceeds this number.
_SPAN = 10.0
_STATE = ("contact_area_fraction", "reduced_separation")


@in_style
def figure(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw contact area and mean separation at one snapshot against the Tabor parameter, for all runs of a study."""
    from icha.analysis.model_error import state_of
    from icha.datasets.campaign import find_snapshot

    groups = group_by_contact(campaign, select_runs(campaign, study, ragged=False))
    run = next(iter(groups[-1].by_seed.values()))
    shown = snapshot_label(run, find_snapshot(run, kind, target))
    # Materials that differ only in the range of attraction form one line with the name of the first material.
    materials: dict[tuple, str] = {}
    curves: dict[tuple, list[ContactRuns]] = {}
    bare: dict[tuple, list[ContactRuns]] = {}
    for group in groups:
        states = {seed: state_of(run, find_snapshot(run, kind, target)) for seed, run in group.by_seed.items()}
        group = group._replace(by_seed=states)
        modulus, energy = (float(next(iter(states.values()))[name]) for name in ("contact_modulus", "surface_energy"))
        contact = (materials.setdefault((modulus, energy), group.labels.material), *group.contact[1:])
        if energy > 0:
            curves.setdefault((contact, group.applicable), []).append(group)
        elif group.applicable:
            bare.setdefault(contact, []).append(group)
    if not curves:
        raise NothingToDraw(f"study {study}: no run with adhesion is complete; the figure needs a surface energy")

    dataset = campaign[study].to_dataset()
    contacts = [contact for contact, _ in curves]
    interfaces = dataset.sel(material=list(dict.fromkeys(material for material, *_ in contacts)))
    looks = Looks(campaign, interfaces, contacts)
    fig, [panels] = new_panels(3.1)
    counts, drawn = [], []
    for (contact, applicable), line in curves.items():
        points = Points(line, "tabor_parameter", *_STATE)
        for quantity, ax in enumerate(panels, 1):
            points.draw(ax, looks.look(contact, applicable=applicable), quantity)
        counts += points.counts
        drawn += points.means[0].tolist()
    for k, (contact, line) in enumerate(bare.items()):
        look = {"color": looks.colour(contact) if looks.by_place else GREY, "label": None if k else "no adhesion"}
        for ax, name in zip(panels, _STATE, strict=True):
            mean = np.mean([float(state[name]) for group in line for state in group.by_seed.values()])
            ax.axhline(mean, ls=(0, (5, 2)), lw=1, zorder=1, **look)
    for ax, label in zip(panels, (AREA_LABEL, gap_label(dataset)), strict=True):
        if max(drawn) > _SPAN * min(drawn):
            logarithmic_axes(ax, "x")
        _finish(ax, min(drawn))
        ax.set_ylabel(label)
    panels[0].set_title(shown, loc="right")
    legend_below(fig, looks.handles() | named_handles(panels) | points_handles(counts))
    return fig


def _finish(ax, smallest):
    """Shade the range of Tabor parameters without verified jump into contact, and set the limits of the axes."""
    from icha.asperity.material import WU_HOLDS_FROM

    low, high = ax.get_xlim()
    # The tolerance allows for a range of attraction that was rounded.
    if smallest < WU_HOLDS_FROM / 1.01:
        ax.axvspan(low, WU_HOLDS_FROM, color="0.93", lw=0, zorder=0, label="jump-in distance not verified")
    ax.set_xlim(low, high)
    ax.set_xlabel(r"Tabor parameter  $\mu$")
    # The limits of the axis are wider than the values, so that differences of a few per mille do not fill the panel.
    bottom, top = ax.get_ylim()
    ax.set_ylim(0.95 * bottom, 1.05 * top)
