"""Differences between the model and boundary elements against load: one look for all figures that show them."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.figures.curves import PRESSURE_LABEL, bars_handle
from icha.figures.scale import MOST_COLOURS, places_scale
from icha.figures.select import NothingToDraw, study_errors
from icha.figures.style import (
    COLOURS,
    DASHES,
    GREY,
    MARKERS,
    TWO_COLUMNS,
    legend_handle,
    logarithmic_axes,
    material_label,
    new_figure,
    panel_label,
    slope_label,
)
from icha.support.statistics import ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# More surfaces than this, and every material has panels of its own.
_MOST_LINES = 2
# Points of one load stand this far apart, as a factor, so that their bars do not hide each other.
_APART = 1.025
# Errors against another quantity of the boundary elements.
_OTHER = {"ls": ":", "lw": 0.9, "marker": ".", "ms": 3}


class Quantity(NamedTuple):
    """A variable of the model error, the label of its axis, and its factor and limits on it (None: as they come).

    The variable `other`, if there is one, is a dotted line without markers where there is adhesion.
    """

    name: str
    label: str
    factor: float = 1.0
    limits: tuple[float | None, float | None] = (None, None)
    other: str = ""


def draw_errors(model_error: xr.DataTree, study: str, quantities: tuple[Quantity, ...]) -> Figure:
    """A panel for every quantity, with a curve for every surface, slope and material: means over the seeds.

    Bars are the 95 % confidence of the means. Many surfaces and slopes have colours of a scale.

    Raises
    ------
    NothingToDraw
        If no run of the study that was compared is complete.
    ValueError
        If the model error has nothing of the study.
    """
    entries = study_errors(model_error, study)
    if not entries:
        there = sorted({str(node.attrs["study"]) for node in model_error.children.values()})
        raise ValueError(f"no boundary elements beside study {study!r}; there are some for {', '.join(there)}")
    if not any(np.isfinite(errors[each.name].values).any() for errors in entries.values() for each in quantities):
        raise NothingToDraw(f"study {study}: no run beside boundary elements is complete, so there is nothing to draw")
    places = [
        (entry, surface, slope, material)
        for entry, errors in entries.items()
        for material, surface, slope in itertools.product(
            *(errors[label].values.tolist() for label in ("material", "surface", "rms_slope"))
        )
    ]
    lines = list(dict.fromkeys((surface, slope) for _, surface, slope, _ in places))
    materials = list(dict.fromkeys(material for *_, material in places))
    interfaces = interfaces_of(entries, materials)
    own_rows = len(lines) > _MOST_LINES
    rows = [[material] for material in materials] if own_rows else [materials]

    fig = new_figure(TWO_COLUMNS, 0.55 + 2.35 * len(rows) + 0.085 * _count(lines, materials, places, own_rows))
    panels = fig.subplots(len(rows), len(quantities), sharex=True, sharey="col", squeeze=False)
    letters = iter("abcdefghijklmnopqrstuvwxyz")
    named: dict[str, object] = {}
    against_other = False
    scale = places_scale(lines) if len(lines) > MOST_COLOURS else None
    counts: set[int] = set()
    for row, shown in zip(panels, rows, strict=True):
        mine = [place for place in places if place[-1] in shown]
        for k, (entry, surface, slope, material) in enumerate(mine):
            errors = entries[entry].sel(surface=surface, rms_slope=slope, material=material)
            # Solutions of the same state on another grid, say.
            again = [place[0] for place in places if place[1:] == (surface, slope, material)].index(entry)
            line, kind = lines.index((surface, slope)), materials.index(material)
            colour = scale.colours[line] if scale else COLOURS[(line if own_rows else kind + 1) % len(COLOURS)]
            adhesive = float(errors["surface_energy"]) > 0
            name = [] if own_rows else [material_label(interfaces, material)]
            name += [surface] if not scale and len({surface for surface, _ in lines}) > 1 else []
            name += [slope_label(slope)] if not scale and len({slope for _, slope in lines}) > 1 else []
            name += [entry] if again else []
            look = {
                "color": colour,
                "marker": MARKERS[(0 if own_rows else line) % len(MARKERS)],
                "ls": DASHES[again % len(DASHES)],
                "mfc": colour if adhesive else "white",
                "ms": 4,
                "lw": 0.9,
                "elinewidth": 0.7,
                "capsize": 1.5,
            }
            p = errors["reduced_pressure"].values * _APART ** (k - (len(mine) - 1) / 2)
            for ax, quantity in zip(row, quantities, strict=True):
                over = ensemble(errors[quantity.name].transpose("seed", ...).values)
                bars = quantity.factor * over.confidence if over.count.max() > 1 else None
                handle = ax.errorbar(p, quantity.factor * over.mean, bars, **look)
                counts.update(over.count.tolist())
                if quantity.other and adhesive:
                    others = quantity.factor * errors[f"{quantity.other}_mean"].values
                    ax.plot(p, others, color=colour, **_OTHER)
                    against_other = True
            named.setdefault(", ".join(name), handle)
        if own_rows:
            row[-1].set_title(material_label(interfaces, shown[0]), loc="right")
        for ax, quantity in zip(row, quantities, strict=True):
            logarithmic_axes(ax, "x")
            ax.axhline(0, color="0.6", lw=0.7, zorder=0)
            ax.set_ylabel(quantity.label)
            panel_label(ax, next(letters))
    for ax, quantity in zip(panels[-1], quantities, strict=True):
        ax.set_xlabel(PRESSURE_LABEL)
        ax.set_ylim(*quantity.limits)
    if against_other:
        named["against the energetic area"] = legend_handle(color=GREY, **_OTHER)
    named |= bars_handle(counts)
    if scale:
        scale.draw(fig, panels.ravel().tolist())
        named.pop("", None)
    if named and (len(named) > 1 or "" not in named):
        fig.legend(named.values(), named.keys(), loc="outside lower center", ncols=_columns(named))
    return fig


def _columns(names):
    return 2 if max(map(len, names)) > 24 else 4


def _count(lines, materials, places, own_rows):
    """About how many rows the legend has, in units of half a line."""
    names = len(lines) + len(places) - len({place[1:] for place in places}) if own_rows else len(places)
    return 2 * np.ceil(names / (4 if own_rows else 2))


def interfaces_of(entries, materials):
    """Modulus, energy and range of the materials of all entries."""
    import xarray as xr

    names = ("contact_modulus", "surface_energy", "interaction_range")
    found = {}
    for errors in entries.values():
        for material in errors["material"].values.tolist():
            found.setdefault(material, errors[list(names)].sel(material=material))
    return xr.concat([found[material] for material in materials], "material", coords="minimal", compat="override")
