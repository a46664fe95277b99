"""Differences between the model and boundary elements against load: one look for all figures that show them."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.datasets.labels import place_of, surfaces_and_slopes
from icha.datasets.variables.model_error import FINITE_RANGE
from icha.figures.curves import PRESSURE_LABEL
from icha.figures.ensembles import draw_points, points_handles
from icha.figures.legends import legend_below, words_handle
from icha.figures.palette import (
    PLACE_MARKERS,
    closed_look,
    material_colours,
    material_layers,
    pale_look,
    place_markers,
)
from icha.figures.scale import MOST_COLOURS, Scale, places_scale
from icha.figures.select import NothingToDraw, asked_of_entry, study_errors
from icha.figures.style import (
    DASHES,
    GREY,
    TWO_COLUMNS,
    legend_handle,
    logarithmic_axes,
    material_label,
    new_figure,
    number,
    panel_label,
    slope_label,
    styled,
)
from icha.support.statistics import ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# More surfaces than this, and every material has panels of its own.
_MOST_LINES = 2
# Points of one load stand this far apart, as a factor, so that their bars do not hide each other.
_APART = 1.025
# Where loads span less than this factor, it is one load, and the axis shows as much to both sides.
_ONE_LOAD = 1.3
# Errors against another quantity of the boundary elements.
_OTHER = {"ls": ":", "lw": 0.9, "marker": ".", "ms": 3}


class Quantity(NamedTuple):
    """A variable of the model error, the label of its axis, and its factor and limits on it (None: as they come).

    The variable `other`, if there is one, is a dotted line without markers where boundary elements with adhesion have a
    finite range. `positive` says whether it cannot be negative, and `words` explain it in the legend.
    """

    name: str
    label: str
    factor: float = 1.0
    limits: tuple[float | None, float | None] = (None, None)
    other: str = ""
    positive: bool = False
    words: str = ""


class _Curves(NamedTuple):
    """Curves (entry, surface, slope and material of each, and whether the asperity model is applicable to its runs),
    and what tells them apart.

    Of more surfaces and slopes than a few every material has a row of panels of its own, and they have colours of a
    scale, for those of the palette are the materials'.
    """

    entries: dict[str, xr.Dataset]
    keys: list[tuple]
    places: list[tuple]
    materials: list[str]
    interfaces: xr.Dataset
    own_rows: bool
    scale: Scale | None
    palette: dict[str, str]

    def look(self, key: tuple) -> tuple[str, dict]:
        """Name of a curve in the legend, and arguments of `Axes.errorbar`."""
        entry, surface, slope, material, applicable = key
        # Solutions of the same state at a finite range, or on another grid.
        same = [each[0] for each in self.keys if each[1:] == key[1:]]
        again, truths = same.index(entry), [self.entries[each].attrs["truth"] for each in same]
        colour = self.palette[material]
        if self.own_rows:
            colour = places_scale(self.places).colours[self.places.index((surface, slope))]
        markers = place_markers(self.places) if not self.scale else {}
        name = [] if self.own_rows else [material_label(self.interfaces, material)]
        if not self.scale:
            name += [surface] if len({each for each, _ in self.places}) > 1 else []
            name += [slope_label(slope)] if len({each for _, each in self.places}) > 1 else []
        name += ["at finite range"] if len(set(truths)) > 1 and truths[again] == FINITE_RANGE else []
        name += [entry] if truths.index(truths[again]) < again else []
        layers = material_layers(self.interfaces, [material] if self.own_rows else self.materials)
        look = closed_look(colour, layers[material]) | {
            "marker": markers.get((surface, slope), PLACE_MARKERS[0]),
            "ls": DASHES[again % len(DASHES)],
        }
        return ", ".join(name), look if applicable else pale_look(look)


@styled
def draw_errors(
    campaign: xr.DataTree, model_error: xr.DataTree, *, study: str, quantities: tuple[Quantity, ...]
) -> Figure:
    """A panel for every quantity, with a curve for every surface, slope and material: means over the seeds.

    Parameters
    ----------
    campaign : the campaign dataset, from which materials have their colours.
    model_error : `icha.analysis.model_error.model_error` of the campaign.
    study : name of the study; all entries that compare its runs are drawn.
    quantities : what is drawn of them.

    Raises
    ------
    NothingToDraw
        If no run of the study that was compared is complete.
    ValueError
        If the study has no boundary elements beside it.
    """
    curves = _curves(model_error, study, quantities, material_colours(campaign))
    rows = [[material] for material in curves.materials] if curves.own_rows else [curves.materials]
    fig = new_figure(TWO_COLUMNS, 0.55 + 2.35 * len(rows))
    panels = fig.subplots(len(rows), len(quantities), sharex=True, sharey="col", squeeze=False)
    letters = iter("abcdefghijklmnopqrstuvwxyz")
    named: dict[str, object] = {}
    counts: set[int] = set()
    for row, shown in zip(panels, rows, strict=True):
        own = [key for key in curves.keys if key[3] in shown]
        for k, (entry, surface, slope, material, applicable) in enumerate(own):
            errors = of_applicability(curves.entries[entry], applicable)
            errors = errors.isel(place_of(errors, {"surface": surface, "rms_slope": slope, "material": material}))
            name, look = curves.look(own[k])
            handle = _draw_curve(row, errors, quantities, look, _APART ** (k - (len(own) - 1) / 2), counts)
            if applicable:
                named.setdefault(name, handle)
        if curves.own_rows:
            row[-1].set_title(material_label(curves.interfaces, shown[0]), loc="right")
        for ax, quantity in zip(row, quantities, strict=True):
            logarithmic_axes(ax, "x")
            ax.axhline(0, color="0.6", lw=0.7, zorder=0)
            ax.set_ylabel(quantity.label)
            panel_label(ax, next(letters))
    low, high = panels[0, 0].dataLim.intervalx
    if high < _ONE_LOAD * low:
        load = float(f"{np.sqrt(low * high):.3g}")
        panels[0, 0].set_xlim(load / _ONE_LOAD, load * _ONE_LOAD)
        panels[0, 0].set_xticks([load], [number(load)])
        for ax in panels.ravel():
            ax.minorticks_off()
    for ax, quantity in zip(panels[-1], quantities, strict=True):
        ax.set_xlabel(PRESSURE_LABEL)
        ax.set_ylim(*quantity.limits)
    if any(each.other for each in quantities) and any(map(has_cohesive_zone, curves.entries.values())):
        named["relative to the energetic area (energy of adhesion / that of full contact)"] = legend_handle(
            color=GREY, **_OTHER
        )
    named |= points_handles(counts)
    if curves.scale:
        curves.scale.draw(fig, panels.ravel().tolist())
        named.pop("", None)
    if len(named) == 1:
        named.pop("", None)
    for quantity in quantities:
        named |= words_handle(quantity.words) if quantity.words else {}
    legend_below(fig, named)
    return fig


def _curves(model_error, study, quantities, palette):
    """What there is to be drawn of a study; raises what `draw_errors` does."""
    entries = study_errors(model_error, study)
    if not entries:
        there = sorted({str(node.attrs["study"]) for node in model_error.children.values()})
        raise ValueError(f"no boundary elements beside study {study!r}; there are some for {', '.join(there)}")
    if not any(_compared(errors, quantities) for errors in entries.values()):
        raise NothingToDraw(f"study {study}: no run beside boundary elements is complete, so there is nothing to draw")
    keys = [
        (entry, surface, slope, material, applicable)
        for entry, errors in entries.items()
        for applicable in (True, False)
        for material, (surface, slope) in itertools.product(
            errors["material"].values.tolist(), surfaces_and_slopes(errors)
        )
        # Not all combinations of an entry are asked for.
        if _compared(
            of_applicability(errors, applicable), quantities, material=material, surface=surface, rms_slope=slope
        )
    ]
    places = list(dict.fromkeys((surface, slope) for _, surface, slope, _, _ in keys))
    materials = list(dict.fromkeys(material for *_, material, _ in keys))
    scale = places_scale(places) if len(places) > MOST_COLOURS else None
    interfaces = interfaces_of(entries, materials)
    return _Curves(entries, keys, places, materials, interfaces, len(places) > _MOST_LINES, scale, palette)


def _compared(errors, quantities, **at):
    """Whether there is a state of a quantity at given labels."""
    own = errors.isel(place_of(errors, at)) if at else errors
    return any(np.isfinite(own[each.name].values).any() for each in quantities)


def _draw_curve(row, errors, quantities, look, apart, counts):
    """Draw a curve in all panels of a row; returns its handle, and adds to `counts` numbers of seeds of its points."""
    p, asked = errors["reduced_pressure"].values * apart, int(asked_of_entry(errors))
    for ax, quantity in zip(row, quantities, strict=True):
        members = quantity.factor * errors[quantity.name].transpose("seed", ...).values
        handle = draw_points(ax, p, members, look, positive=quantity.positive, asked=asked)
        counts.update(np.isfinite(members).sum(axis=0).tolist())
        if quantity.other and has_cohesive_zone(errors):
            mean = ensemble(errors[quantity.other].transpose("seed", ...).values).mean
            ax.plot(p, quantity.factor * mean, color=look["color"], **_OTHER)
    return handle


def of_applicability(errors: xr.Dataset, applicable: bool) -> xr.Dataset:
    """An entry with the values of the runs to which the asperity model is applicable, or of the others, alone."""
    if "applicability" not in errors:
        return errors if applicable else errors.where(False)
    keep = (errors["applicability"] == "") == applicable
    along_seeds = [
        name for name, values in errors.data_vars.items() if "seed" in values.dims and values.dtype.kind == "f"
    ]
    return errors.assign({name: errors[name].where(keep) for name in along_seeds})


def has_cohesive_zone(errors):
    """Whether boundary elements attract out of contact, so that they have a second area."""
    return errors.attrs["truth"] == FINITE_RANGE and bool((errors["surface_energy"] > 0).any())


def interfaces_of(entries, materials):
    """Modulus, energy and range of the materials of all entries."""
    import xarray as xr

    names = ("contact_modulus", "surface_energy", "interaction_range")
    found = {}
    for errors in entries.values():
        for material in errors["material"].values.tolist():
            found.setdefault(material, errors[list(names)].sel(material=material))
    return xr.concat([found[material] for material in materials], "material", coords="minimal", compat="override")
