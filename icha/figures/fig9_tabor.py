"""Fig. 9: contact area and mean separation against the Tabor parameter, at one load."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.campaign import find_snapshot
from icha.figures.curves import AREA_LABEL, SEPARATION_LABEL
from icha.figures.select import snapshot_label, study_runs
from icha.figures.style import COLOURS, GREY, MARKERS, TWO_COLUMNS, new_figure, panel_label, quantity, styled
from icha.simulation import WU_RANGE

CAPTION = (
    "Real contact area over nominal area (a) and mean separation over rms height (b) at the load given in the figure, "
    "against the Tabor parameter of the surface, (R_c Δγ²/E*²)^(1/3) over the range of attraction, with R_c = 1/rms "
    "curvature. Runs that differ only in the range are joined by a line: at a given surface energy a longer range "
    "(smaller Tabor parameter) lets asperities jump into contact from farther away. Dashed: without adhesion. Shaded: "
    "outside the Tabor parameters for which the jump-in distance was verified; single asperities, whose radii differ, "
    "can lie there for every value of the surface's."
)

# The panels reach at least this part of the mean value up and down.
_LEAST_REACH = 0.05


@styled
def figure(
    campaign: xr.DataTree,
    *,
    study: str,
    kind: str | None = None,
    target: float | None = None,
) -> Figure:
    """Draw all runs of a study at one snapshot.

    Parameters
    ----------
    campaign : the campaign dataset.
    study : name of the study; its materials should differ in their range of attraction.
    kind, target : which snapshot; the first one of this kind, or the first of all, if left out.

    Raises
    ------
    ValueError
        If there is no such study or snapshot, or no run with adhesion.
    """
    curves, bare = {}, {}
    for labels, run in study_runs(campaign, study):
        at = find_snapshot(run, kind, target)
        step = int(run["snapshot_step"].values[at])
        state = [float(run[name].values[step]) for name in ("contact_area_fraction", "reduced_separation")]
        line = (labels.surface, labels.seed, labels.rms_slope)
        if float(run["surface_energy"]) > 0:
            interface = (float(run["contact_modulus"]), float(run["surface_energy"]))
            curves.setdefault((line, interface), []).append((float(run["tabor_parameter"]), *state))
        else:
            bare[line] = state
        shown = snapshot_label(run, at)
    if not curves:
        raise ValueError(f"study {study}: no run with adhesion, so none with a Tabor parameter")

    fig = new_figure(TWO_COLUMNS, 3.1)
    panels = fig.subplots(1, 2)
    lines = list(dict.fromkeys(line for line, _ in curves))
    interfaces = list(dict.fromkeys(interface for _, interface in curves))
    for (line, interface), points in curves.items():
        colour = COLOURS[(interfaces.index(interface) + 1) % len(COLOURS)]
        marker = MARKERS[lines.index(line) % len(MARKERS)]
        mu, *states = np.array(sorted(points)).T
        for ax, values in zip(panels, states, strict=True):
            ax.plot(mu, values, "-", marker=marker, color=colour, lw=0.8, ms=4, label=_name(interface, line, lines))
    for line, state in bare.items():
        for ax, value in zip(panels, state, strict=True):
            name = "no adhesion" if len(bare) == 1 or line == next(iter(bare)) else None
            ax.axhline(value, color=GREY, ls=(0, (5, 2)), lw=1, label=name, zorder=1)
    parameters = [mu for points in curves.values() for mu, *_ in points]
    smallest, largest = min(parameters), max(parameters)
    for ax, letter, label in zip(panels, "ab", (AREA_LABEL, SEPARATION_LABEL), strict=True):
        low, high = ax.get_xlim()
        # A range of attraction that was rounded does not leave what was verified.
        if smallest < WU_RANGE[0] / 1.01:
            ax.axvspan(low, WU_RANGE[0], color="0.93", lw=0, zorder=0)
        if largest > WU_RANGE[1] * 1.01:
            ax.axvspan(WU_RANGE[1], high, color="0.93", lw=0, zorder=0)
        ax.set_xlim(low, high)
        ax.set_xlabel(r"Tabor parameter  $\mu$")
        ax.set_ylabel(label)
        bottom, top = ax.get_ylim()
        # Differences of a few per mille are not blown up to fill the panel.
        reach = max(0.65 * (top - bottom), _LEAST_REACH * 0.5 * (top + bottom))
        ax.set_ylim(0.5 * (bottom + top) - reach, 0.5 * (bottom + top) + reach)
        panel_label(ax, letter)
    panels[0].set_title(shown, loc="right")
    panels[0].legend(loc="best")
    return fig


def _name(interface, line, lines):
    """What a curve is called: modulus and energy, and what tells its surface, seed and slope apart."""
    name = rf"$E^{{\ast}}$ = {quantity(interface[0], 'Pa')}, $\Delta\gamma$ = {quantity(interface[1], 'J/m²')}"
    words = ("{}", "seed {}", r"$h_{{\mathrm{{rms}}}}^{{\prime}}$ = {:g}")
    for k, word in enumerate(words):
        if len({each[k] for each in lines}) > 1:
            name += ", " + word.format(line[k])
    return name
