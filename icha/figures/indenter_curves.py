"""Runs of indenters for figures: series of runs, and curves of Hertz and JKR."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.contact.models import REFERENCE_MODEL
from icha.figures import select
from icha.figures.drawn import say
from icha.figures.looks import distinct_colours, graded_colours
from icha.figures.style import BLACK
from icha.references.indentation import sphere_contact, sphere_jump_off
from icha.support.formatting import format_quantity
from icha.support.tables import read_columns

# Look of measured points; measurements differ in their marker.
MEASURED = {"ls": "none", "ms": 3.6, "mew": 0.8, "color": BLACK, "zorder": 5}
CROSSES = "x+1234"

# Points of a theoretical curve.
_POINTS = 400


class Series(NamedTuple):
    """Runs that differ only in their seed.

    Attributes
    ----------
    runs : the runs, their labels and their seeds.
    name : surface, rms height and material, for a legend; a surface or material that tells nothing is left out.
    contact : surface and material of the name; empty if series differ only in their rms height.
    colour : colour of the series. If series differ only in their rms height, black without roughness, brighter for
        higher roughness.
    """

    runs: select.ContactRuns
    name: str
    contact: str
    colour: str

    @property
    def first_run(self) -> xr.Dataset:
        """The first run; all runs of a series have the same shape and material."""
        return next(iter(self.runs.by_seed.values()))


def select_series(campaign: xr.DataTree, study: str, *, only_jkr: bool = False) -> list[Series]:
    """Return the series of a study on free squares that unload, by increasing rms height.

    If the study has boundary elements, the series are those of boundary elements. `only_jkr` leaves out runs without
    adhesion, without a radius, and on layers. Raise `NothingToDraw` if no run is left.
    """
    # Only boundary elements compute shapes; both models compute free squares without a shape.
    unloaded = select.select_unloaded_runs(campaign, study, REFERENCE_MODEL)
    runs = [(labels, run) for labels, run in unloaded if "force" in run]
    if not runs:
        raise select.NothingToDraw(f"study {study}: no run is on a free square; expected surfaces with a shape")
    if only_jkr:
        runs = [(labels, run) for labels, run in runs if (sphere := sphere_of(run)) and sphere[2]]
        if not runs:
            expected = "the figure needs a radius and a surface energy"
            raise select.NothingToDraw(f"study {study}: no sphere with adhesion; {expected}")
    groups = sorted(select.group_by_contact(campaign, runs), key=_roughness)
    several = len({group.labels.material for group in groups}) > 1
    # The rms height tells surfaces apart if they have the same shape and different heights.
    alike = {(group.labels.surface, _roughness(group)) for group in groups}
    shapes = {str(run["shape"].values) if "shape" in run else "" for _, run in runs}
    named = len(shapes) > 1 or len({height for _, height in alike}) < len(alike)
    heights = list(dict.fromkeys(filter(None, map(_roughness, groups))))
    # The darkest colour looks like black, which is that of smooth shapes.
    palette = dict(zip(heights, graded_colours(len(heights) + 1)[1:], strict=True))
    distinct = distinct_colours(len(groups))
    found = []
    for k, group in enumerate(groups):
        height, labels = _roughness(group), group.labels
        words = f"rms height {format_quantity(height, 'm')}" if height else "smooth"
        surface, material = [labels.surface] if named else [], [labels.material] if several else []
        colour = distinct[k] if named or several else palette.get(height, BLACK)
        found.append(Series(group, ", ".join([*surface, words, *material]), ", ".join(surface + material), colour))
    return found


def _roughness(group):
    """Return the mean rms height of a group of runs, m, to three digits; 0 without roughness."""
    return float(f"{np.mean([float(run['rms_height']) for run in group.by_seed.values()]):.3g}")


def sphere_of(run: xr.Dataset) -> tuple[float, float, float] | None:
    """Return radius (m), modulus (Pa) and work of adhesion (J/m^2) of a run; None without a radius or on a layer."""
    if "shape_radius" not in run or np.isfinite(run["layer_thickness"]):
        return None
    return tuple(float(run[name]) for name in ("shape_radius", "contact_modulus", "surface_energy"))


def theory_curves(run: xr.Dataset, largest_radius: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return indentation (m) and force (N) of a smooth sphere up to a contact radius, by name of the theory."""
    sphere = sphere_of(run)
    if sphere is None:
        return {}
    radius, modulus, energy = sphere
    hertz = sphere_contact(np.linspace(0, largest_radius, _POINTS), radius, modulus)
    curves = {"Hertz": (hertz.indentation, hertz.force)}
    receding = float(run["receding_energy"])
    for name, work in (("JKR, receding", receding if receding > energy else 0.0), ("JKR", energy)):
        if work:
            smallest = float(sphere_jump_off(radius, modulus, work).contact_radius)
            jkr = sphere_contact(np.linspace(smallest, largest_radius, _POINTS), radius, modulus, work)
            curves = {name: (jkr.indentation, jkr.force)} | curves
    return curves


class Measured(NamedTuple):
    """A measurement of an indenter.

    Attributes
    ----------
    label : name in the legend.
    material : material of the measurement; None if it is not given.
    works : works of adhesion of the material, advancing and receding, J/m^2; None without a material.
    values : measured values in SI units, arrays of the same length by quantity.
    look : look of the points, with the marker.
    """

    label: str
    material: str | None
    works: tuple[float, float] | None
    values: dict[str, np.ndarray]
    look: dict[str, object]


def read_measured(
    figure: Figure,
    tables: Sequence[str | os.PathLike],
    measurements: Sequence[Mapping],
    *needed: str,
    any_of: Iterable[str] = (),
) -> list[Measured]:
    """Return the measurements that a figure shows, and name them in its caption.

    A measurement has a `label`, a `citation`, `columns` (headings and factors), `quantities` (names by column), a
    `material`, and `works` if the material is known. A shown measurement has all quantities `needed`, and one of
    `any_of`.
    """
    found, sources = [], []
    for k, (table, known) in enumerate(zip(tables, measurements, strict=True)):
        names = known["quantities"]
        if {*needed} <= {*names} and (not any_of or {*any_of} & {*names}):
            columns = read_columns(table, known["columns"], signed=known["columns"])
            look = MEASURED | {"marker": CROSSES[k % len(CROSSES)]}
            values = dict(zip(names, columns, strict=True))
            found.append(Measured(known["label"], known["material"], known.get("works"), values, look))
            sources.append(f"{known['label']} ({known['citation']})")
    say(figure, f"Crosses are measurements: {'; '.join(sources)}." if sources else "")
    return found
