"""Fig. 9: contact at one load, or pull-off of a sphere, against the Tabor parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE
from icha.datasets.quantities import label_of
from icha.figures.curves import gap_name
from icha.figures.drawn import plot, record, say
from icha.figures.ensembles import Points, points_handles
from icha.figures.looks import Looks, legend_below, named_handles
from icha.figures.select import ContactRuns, NothingToDraw, group_by_contact, select_runs, snapshot_label
from icha.figures.style import GREY, in_style, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# The axis of the Tabor parameter is logarithmic if the ratio of its largest to its smallest value exceeds this number.
_SPAN = 10.0
_STATE = ("contact_area_fraction", "reduced_separation")

_TABOR = """The Tabor parameter is (R Δγ²/E*²)^(1/3) divided by the range of attraction. R is the radius of a sphere; on
a rough surface, 1/R is the rms curvature."""


@in_style
def figure(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw contact area and mean separation at one snapshot against the Tabor parameter, for all runs of a study.

    For smooth spheres that are pulled off, draw the pull-off force and the loss instead.
    """
    from icha.analysis.model_error import state_of
    from icha.datasets.campaign import find_snapshot

    runs = select_runs(campaign, study, ragged=False)
    if all(float(run.get("pull_off_force_over_jkr", 0)) and run["short_wavelength"] == np.inf for _, run in runs):
        return _pull_off_of_spheres([run for _, run in runs])
    groups = group_by_contact(campaign, runs)
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
    gap = label_of(gap_name(dataset)).partition("  ")[0]
    say(
        fig,
        f"""Real contact area divided by nominal area (a) and {gap} divided by rms height (b) at the load given in the
        figure.""",
        _TABOR,
        """A line joins runs that differ only in the range of attraction. At a given surface energy, asperities with a
        longer range (smaller Tabor parameter) jump into contact from a larger distance.""",
        "Dashed lines are results without adhesion." if bare else "",
    )
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
            record(ax, [min(drawn), max(drawn)], [mean, mean], line[0].drawn_name)
            ax.axhline(mean, ls=(0, (5, 2)), lw=1, zorder=1, **look)
    for ax, label in zip(panels, map(label_of, ("contact_area_fraction", gap_name(dataset))), strict=True):
        if max(drawn) > _SPAN * min(drawn):
            logarithmic_axes(ax, "x")
        _finish(ax, min(drawn))
        ax.set_ylabel(label)
    panels[0].set_title(shown, loc="right")
    legend_below(fig, looks.handles() | named_handles(panels) | points_handles(fig, counts))
    return fig


def _pull_off_of_spheres(runs):
    """Draw pull-off force and loss of smooth spheres against the Tabor parameter, with the limits of JKR and DMT."""
    from icha.asperity.tabor import sphere_pull_off_factor

    runs = sorted(runs, key=lambda run: float(run["tabor_parameter"]))
    tabor, pull_off, loss = np.array([_values_of_sphere(run) for run in runs]).T
    resolved = np.array([run.attrs.get("attraction") == FINITE_RANGE for run in runs])
    fig, [panels] = new_panels(3.1)
    markers = "Filled markers are boundary elements at the range itself." if resolved.any() else ""
    markers += " Open markers are boundary elements in the limit of a short range." if not resolved.all() else ""
    say(
        fig,
        "Pull-off force (a) and energy lost from first contact to separation (b) of smooth spheres.",
        _TABOR,
        markers,
        "The solid line is the theory of Maugis for a constant attraction. JKR and DMT are its limits.",
    )
    for ax, values in zip(panels, (pull_off, loss), strict=True):
        ax.plot(tabor, values, color=GREY, lw=0.6, zorder=1)
        for chosen, fill, label in ((resolved, "C0", FINITE_RANGE), (~resolved, "white", SHORT_RANGE)):
            if chosen.any():
                plot(ax, tabor[chosen], values[chosen], ls="none", marker="o", ms=4.5, mec="C0", mfc=fill, label=label)
        logarithmic_axes(ax, "x")
        ax.set_xlabel(label_of("tabor_parameter"))
    at = np.geomspace(tabor.min(), tabor.max(), 200)
    plot(panels[0], at, [sphere_pull_off_factor(each) for each in at], color="0.3", lw=1, label="theory of Maugis")
    for limit, name, style in ((1.5, "JKR", (0, (5, 2))), (2.0, "DMT", ":")):
        panels[0].axhline(limit, color="0.3", lw=0.9, ls=style, label=name)
    panels[0].set(ylabel=r"pull-off force$\,/\,\pi\Delta\gamma R$", ylim=(1.4, 2.1))
    panels[1].set_ylabel(r"loss$\,/\,(\Delta\gamma^5 R^4/E^{*2})^{1/3}$")
    legend_below(fig, named_handles(panels))
    return fig


def _values_of_sphere(run):
    """Return Tabor parameter, pull-off force over pi dgamma R, and loss over (dgamma^5 R^4/E*^2)^(1/3)."""
    energy, R, modulus = (float(run[name]) for name in ("surface_energy", "shape_radius", "contact_modulus"))
    loss = float(run["hysteresis_loss"]) * float(run["period"]) ** 2
    unit = np.cbrt(energy**5 * R**4 / modulus**2)
    return float(run["tabor_parameter"]), float(run["pull_off_force"]) / (np.pi * energy * R), loss / unit


def _finish(ax, smallest):
    """Shade the range of Tabor parameters without verified jump into contact, and set the limits of the axes."""
    from icha.asperity.material import WU_HOLDS_FROM

    low, high = ax.get_xlim()
    # The tolerance allows for a range of attraction that was rounded.
    if smallest < WU_HOLDS_FROM / 1.01:
        ax.axvspan(low, WU_HOLDS_FROM, color="0.93", lw=0, zorder=0, label="jump-in distance not verified")
    ax.set_xlim(low, high)
    ax.set_xlabel(label_of("tabor_parameter"))
    # The limits of the axis are wider than the values, so that differences of a few per mille do not fill the panel.
    bottom, top = ax.get_ylim()
    ax.set_ylim(0.95 * bottom, 1.05 * top)
