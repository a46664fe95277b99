"""Figures of indenters: force against indentation (17), straight line of JKR (18), apparent work of adhesion (19)."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.contact.models import REFERENCE_MODEL
from icha.datasets.campaign import runs_with_unloading, whole_runs
from icha.datasets.quantities import label_of
from icha.figures import select
from icha.figures.curves import panel_in_units
from icha.figures.drawn import Name, plot, record, say, show_runs
from icha.figures.ensembles import mark_fewer
from icha.figures.looks import BRANCH_DASHES, distinct_colours, graded_colours, legend_below
from icha.figures.measured import Measured, name_sources
from icha.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ONE_COLUMN,
    VERMILLION,
    in_style,
    legend_handle,
    limits_around,
    new_figure,
    new_grid,
    new_panels,
)
from icha.references.indentation import sphere_contact, sphere_jump_off
from icha.references.indenter_runs import BRANCHES, reason_without_fit, spaced_states, steps_of
from icha.support.formatting import choose_unit, format_quantity

# --- runs and measurements of all three figures ---

# Look of measured points; measurements differ in their marker.
_MEASURED = {"ls": "none", "ms": 3.6, "mew": 0.8, "color": BLACK, "zorder": 5}
_CROSSES = "x+1234"
_FITS = """Where a fit is missing, the Tabor parameter of the sphere is below 3, the value from which JKR holds; there
are fewer than three states; or the contact is so small that Hertz's law without adhesion fits better. Where the
tension exceeds the pull-off force of a fit, which happens on rough spheres, the square root in its radius is set to
zero. Runs without adhesion, on shapes without a radius, and on layers are left out."""
_EQUIVALENT = """The radius R of a paraboloid is the geometric mean of its two radii, sqrt(R1 R2); the pull-off force of
JKR with R is 0.5 % larger than that of the paraboloid for R1 = 2 R2, and 2 % larger for R1 = 5 R2."""


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


def select_series(campaign: xr.DataTree, study: str, *, only_jkr: bool = False) -> list[Series]:
    """Return the series of a study on free squares that unload, by increasing rms height.

    If the study has boundary elements, the series are those of boundary elements. `only_jkr` leaves out runs without
    adhesion, without a radius, on layers, and those that ended before their last target. Raise `NothingToDraw` if no
    run is left.
    """
    # Only boundary elements compute shapes; both models compute free squares without a shape.
    unloaded = select.select_unloaded_runs(campaign, study, REFERENCE_MODEL)
    runs = [(labels, run) for labels, run in unloaded if "force" in run]
    if not runs:
        raise select.NothingToDraw(f"study {study}: no run is on a free square; expected surfaces with a shape")
    if only_jkr:
        runs = [(labels, run) for labels, run in runs if has_radius(run) and run["surface_energy"] > 0]
        if not runs:
            expected = "the figure needs a radius and a surface energy"
            raise select.NothingToDraw(f"study {study}: no sphere with adhesion; {expected}")
        runs = [(labels, run) for labels, run in runs if not select.early_end(run)]
        if not runs:
            raise select.NothingToDraw(f"study {study}: no sphere with adhesion reached the end of its path")
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


def _show_runs(figure, campaign, series, *, only_jkr=False):
    """Record the runs of some series, and those of the study that should be in a series; arguments as above."""
    labels = series[0].runs.labels
    study = campaign[labels.study].to_dataset()
    wanted = study["model"] == labels.model
    if only_jkr:
        wanted = wanted & (study["surface_energy"] > 0)
    show_runs(figure, labels.study, whole_runs(study) if only_jkr else runs_with_unloading(study), wanted)


def _roughness(group):
    """Return the mean rms height of a group of runs, m, to three digits; 0 without roughness."""
    return float(f"{np.mean([float(run['rms_height']) for run in group.by_seed.values()]):.3g}")


def has_radius(run: xr.Dataset) -> bool:
    """Return True if a run can be compared with a sphere: its shape has a radius, and the half-space no layer."""
    return "shape_radius" in run and not select.has_layer(run)


def _select_measured(figure, measurements, *needed):
    """Return the measurements with all quantities `needed` and their looks, and name them in the caption."""
    looks = [_MEASURED | {"marker": _CROSSES[k % len(_CROSSES)]} for k in range(len(measurements))]
    found = [each for each in zip(measurements, looks, strict=True) if {*needed} <= each[0].values.keys()]
    sources = name_sources(each for each, _ in found)
    say(figure, f"Crosses are measurements: {sources}." if found else "")
    return found


def _radius_of_paraboloids(series):
    """Return what the radius of a paraboloid is, if a run of some series has this shape."""
    shapes = {str(run["shape"].values) for each in series for run in each.runs.by_seed.values() if "shape" in run}
    return _EQUIVALENT if any(shape.startswith("paraboloid of radii") for shape in shapes) else ""


# --- figure 17 ---

# Largest number of series in a panel.
_MOST_SERIES = 3
# Points of a theoretical curve.
_POINTS = 400
_LOOP = {"lw": 0.9, "alpha": 0.85}
_THEORIES = {
    "JKR": {"color": GREY, "lw": 2.4, "alpha": 0.45},
    "JKR, receding": {"color": GREY, "lw": 2.4, "alpha": 0.25},
    "Hertz": {"color": GREY, "lw": 0.9, "ls": ":"},
}
_INDENTATION = """Force against indentation. The indentation is the distance by which the apex of the shape without
roughness has moved beyond the undeformed plane of the elastic body. Tension is negative. Every seed that
reaches its unloading is a line of its own."""
_SPHERES = """The theories of Hertz, and of Johnson, Kendall and Roberts (JKR), are for a smooth sphere with the radius,
the modulus and the works of adhesion of the runs in the same panel. The line of JKR includes states that are unstable
under load control, up to the jump-off under displacement control. Runs without adhesion have no line of JKR; shapes
without a radius and layers have no line."""


@in_style
def force_indentation(campaign: xr.DataTree, *, study: str, measurements: Sequence[Measured] = ()) -> Figure:
    """Draw force against indentation for all runs of a study, with the theories for each radius and material.

    Series have a panel each if they are many, or if they differ in more than the rms height. Measurements with forces
    and indentations are shown too.
    """
    series = select_series(campaign, study)
    runs = [run for each in series for run in each.runs.by_seed.values()]
    names = "indentation", "force"
    panel = panel_in_units(*names, *runs)
    together = len(series) <= _MOST_SERIES and not any(each.contact for each in series)
    shown = [series] if together else [[each] for each in series]
    labels = {f"{axis}label": label_of(name, unit) for axis, name, unit in zip("xy", names, panel.units, strict=True)}
    fig, panels = new_grid(len(shown), 2, 2.7, 3.55, least=1.3, **labels, sharex=True, sharey=True)
    say(fig, _INDENTATION)
    _show_runs(fig, campaign, series)
    measured = _select_measured(fig, measurements, *names)
    if measured and not together:
        say(fig, "Measurements are drawn beside all series of their material, whatever the shape.")
    points = map(panel.points, [*runs, *(each.values for each, _ in measured)])
    limits = [limits_around(np.concatenate(values)) for values in zip(*points, strict=True)]
    largest = max(float(run["contact_radius"].max()) for run in runs)
    theories = {}
    for ax, of_panel in zip(panels, shown, strict=True):
        of_sphere = _theory_curves(of_panel[0].runs.first, 1.5 * largest)
        theories |= of_sphere
        for name, states in of_sphere.items():
            plot(ax, *panel.points(dict(zip(names, states, strict=True))), name, zorder=1, **_THEORIES[name])
        for each in of_panel:
            for of_seed, run in each.runs.members:
                for branch, leg in select.branches(run):
                    look = {"color": each.colour, "ls": BRANCH_DASHES[branch], **_LOOP}
                    plot(ax, *panel.points(leg), Name(branch, of_seed), **look)
        for each, look in measured:
            if each.material in (None, *(one.runs.labels.material for one in of_panel)):
                plot(ax, *panel.points(each.values), each.label, **look)
        ax.axhline(0, color=GREY, lw=0.5, zorder=0)
        if len(shown) > 1:
            ax.set_title(of_panel[0].name, loc="right")
        ax.set(xlim=limits[0], ylim=limits[1])
    if theories:
        say(fig, _SPHERES, _radius_of_paraboloids(series))
    named = [] if len(shown) > 1 else series
    handles = {each.name: legend_handle(color=each.colour, **_LOOP) for each in named}
    handles |= {name: legend_handle(color=BLACK, ls=dashes, **_LOOP) for name, dashes in BRANCH_DASHES.items()}
    handles |= {f"{name}, smooth sphere": legend_handle(**_THEORIES[name]) for name in theories}
    handles |= {each.label: legend_handle(**look) for each, look in measured}
    legend_below(fig, handles)
    return fig


def _theory_curves(run, largest_radius):
    """Return indentation (m) and force (N) of a smooth sphere up to a contact radius, by name of the theory."""
    if not has_radius(run):
        return {}
    names = ("shape_radius", "contact_modulus", "surface_energy", "receding_energy")
    radius, modulus, energy, receding = (float(run[name]) for name in names)
    hertz = sphere_contact(np.linspace(0, largest_radius, _POINTS), radius, modulus)
    curves = {"Hertz": (hertz.indentation, hertz.force)}
    for name, work in (("JKR, receding", receding if receding > energy else 0.0), ("JKR", energy)):
        if work:
            smallest = float(sphere_jump_off(radius, modulus, work).contact_radius)
            jkr = sphere_contact(np.linspace(smallest, largest_radius, _POINTS), radius, modulus, work)
            curves = {name: (jkr.indentation, jkr.force)} | curves
    return curves


# --- figure 18 ---


# Variables of the works of adhesion; title of the panel and marker of the states.
_TITLES = {"approach": ("loading", "o"), "retraction": ("unloading", "s")}
_STATES = {"ls": "none", "ms": 2.8, "mew": 0.6, "mfc": "white"}
_FIT = {"lw": 0.9, "ls": "-"}

_LINE = """Linearised plot of the equation of Johnson, Kendall and Roberts (JKR), for the first loading (a) and the
last unloading up to the largest tension (b). Here F is the force, R the radius of the smooth sphere, and a the radius
of a circle with the true contact area. A smooth sphere with a Tabor parameter of 3 or more gives a straight line of
slope 3/(4 E*), and the work of adhesion w follows from the value at F = 0, 3 sqrt(8 π E* w)/(4 E*). Markers are states
of the runs, at most one hundred of each run at equal steps of the indentation. States with F/a^(3/2) below -sqrt(8 π
E* Δγ), where no sphere of JKR has contact (Δγ of receding edges), are not shown; in unloading with two works of
adhesion, neither are states whose edge stands. A fit minimises the squared differences of a³ at given F, with the given
E* and R, so states with a large radius have most weight. The legend gives means over the seeds, with the
number of seeds if it is smaller than requested."""


@in_style
def jkr_plot(campaign: xr.DataTree, *, study: str, measurements: Sequence[Measured] = ()) -> Figure:
    """Draw a^(3/2)/R against F/a^(3/2) for loading and unloading, with the fitted JKR lines.

    The equation of JKR, F = 4 E* a^3/(3 R) - sqrt(8 pi E* w a^3), is the straight line y = 3 (x + sqrt(8 pi E* w))/(4
    E*) with x = F/a^(3/2) and y = a^(3/2)/R. Runs without adhesion, without a radius R, and on a layer are left out.
    Measurements with forces and contact radii are shown too. The largest force is the end of loading, and R is that of
    the runs.
    """
    series = select_series(campaign, study, only_jkr=True)
    drawn = []
    for each in series:
        for labels, run in each.runs.members:
            for branch, choose in BRANCHES.items():
                states = choose(steps_of(run))
                chosen = [states[k] for k in spaced_states([state["indentation"] for state in states])]
                x, y = _straight(*([state[name] for state in chosen] for name in ("force", "contact_radius")), run)
                # The line of JKR is zero here. States beyond it, of little contact area, would hide the others.
                work = max(float(run["surface_energy"]), float(run["receding_energy"]))
                inside = x > -np.sqrt(8 * np.pi * float(run["contact_modulus"]) * work)
                drawn.append((branch, each, labels, run, x[inside], y[inside]))
    scale, unit = choose_unit(max(float(np.abs(x).max(initial=0.0)) for *_, x, _ in drawn), "N")
    fig, [panels] = new_panels(3.0, sharex=True, sharey=True)
    say(fig, _LINE, _FITS, _radius_of_paraboloids(series))
    _show_runs(fig, campaign, series, only_jkr=True)
    for branch, each, labels, run, x, y in drawn:
        ax = panels[list(_TITLES).index(branch)]
        plot(ax, x * scale, y * 1e3, Name("states", labels), marker=_TITLES[branch][1], mec=each.colour, **_STATES)
        if (name := f"work_of_adhesion_{branch}") in run:
            modulus = float(run["contact_modulus"])
            line = 0.75 / modulus * (x + np.sqrt(8 * np.pi * modulus * float(run[name])))
            plot(ax, x * scale, line * 1e3, Name("fit of JKR", labels), color=each.colour, **_FIT)
    measured = _select_measured(fig, measurements, "force", "contact_radius")
    say(fig, "All measured states are shown, also those whose edge stands." if measured else "")
    for each, look in measured:
        force = each.values["force"]
        x, y = _straight(force, each.values["contact_radius"], series[0].runs.first)
        top = int(np.argmax(force))
        for ax, part in zip(panels, (slice(top + 1), slice(top, None)), strict=True):
            plot(ax, x[part] * scale, y[part] * 1e3, each.label, **look)
    for ax, (name, _) in zip(panels, _TITLES.values(), strict=True):
        ax.set_title(name, loc="right")
        ax.set(xlabel=rf"$F/a^{{3/2}}$  ({unit} m$^{{-3/2}}$)", ylabel=r"$a^{3/2}/R$  ($10^{-3}$ m$^{1/2}$)")
        ax.label_outer()
    handles = {f"{each.name}: {_works(each)}": legend_handle(color=each.colour, **_FIT) for each in series}
    states = {"states": legend_handle(marker="o", mec=GREY, **_STATES), "fit of JKR": legend_handle(color=GREY, **_FIT)}
    legend_below(fig, handles | states | {each.label: legend_handle(**look) for each, look in measured})
    return fig


def _straight(force, radius, run):
    """Return F/a^(3/2) and a^(3/2)/R of forces and contact radii; R is the radius of the shape of a run."""
    power = np.asarray(radius) ** 1.5
    return np.asarray(force) / power, power / float(run["shape_radius"])


def _works(series):
    """Return the mean fitted works of adhesion of a series as text, or why there are none."""
    words, runs = [], list(series.runs.by_seed.values())
    for branch, (title, _) in _TITLES.items():
        name = f"work_of_adhesion_{branch}"
        values = [float(run[name]) for run in runs if name in run]
        if values:
            asked = series.runs.asked
            fewer = f" ({len(values)} of {asked} seeds)" if len(values) < asked else ""
            words.append(f"{title} {format_quantity(float(f'{np.mean(values):.3g}'), 'J/m²')}{fewer}")
        else:
            words.append(f"{title} no fit ({reason_without_fit(runs[0], branch)})")
    return ", ".join(words)


# --- figure 19 ---

# For each quantity: its name in the legend, its marker, its colour, and the variable that is its unit.
_WORKS = {
    "work_of_adhesion_approach": ("JKR fit to loading", "o", BLUE, "surface_energy"),
    "work_of_adhesion_retraction": ("JKR fit to unloading", "s", VERMILLION, "receding_energy"),
    "pull_off_force_over_jkr": ("pull-off force over that of JKR", "^", GREEN, None),
}
# Measured quantities, with the branch for the legend.
_MEASURED_WORKS = {"advancing_work": "loading", "receding_work": "unloading"}
_ONE_SEED = {"ls": "none", "ms": 3.2, "mew": 0.6, "mfc": "white"}
_MEAN = {"lw": 0.9, "ms": 5.0}

_WORK = """Apparent work of adhesion of rough spheres, divided by the work of adhesion Δγ of the material, against the
rms height of the roughness. The theory of Johnson, Kendall and Roberts (JKR) is fitted to the first loading, and to the
last unloading up to the largest tension. Each fit compares cubes of contact radii at given forces, with the given E*
and R. The pull-off force of a smooth sphere by JKR is 3/2 π Δγ R. Closed markers are means over the seeds; open markers
are the single seeds. With two works of adhesion, Δγ of loading is that of advancing edges, and Δγ of unloading and
pull-off that of receding edges; fits to unloading then leave out states whose edge stands."""


@in_style
def work_of_adhesion(campaign: xr.DataTree, *, study: str, measurements: Sequence[Measured] = ()) -> Figure:
    """Draw works of adhesion of fits and of pull-off, divided by the surface energy.

    Lines join means over seeds of series that differ only in their rms height. Measurements with rms heights are shown
    too.
    """
    series = select_series(campaign, study, only_jkr=True)
    runs = [run for each in series for run in each.runs.by_seed.values()]
    if not any("pull_off_force_over_jkr" in run for run in runs):
        raise select.NothingToDraw(
            f"study {study}: no sphere with adhesion was pulled off; see the surfaces and materials"
        )
    largest = max(float(run["rms_height"]) for run in runs)
    scale, unit = choose_unit(largest, "m")
    contacts = list(dict.fromkeys(each.contact for each in series))
    colours = dict(zip(contacts, distinct_colours(len(contacts)), strict=True))
    fig = new_figure(1.25 * ONE_COLUMN, 2.9)
    ax = fig.subplots()
    say(fig, _WORK, _FITS)
    _show_runs(fig, campaign, series, only_jkr=True)
    handles = {name: legend_handle(color=colour, lw=4) for name, colour in colours.items() if name}
    for (quantity, (name, marker, own, unit_of_work)), contact in itertools.product(_WORKS.items(), contacts):
        # Colours distinguish the quantities, or surfaces and materials if there are several.
        colour, means, counts = colours[contact] if contact else own, [], []
        for group in (each.runs for each in series if each.contact == contact):
            points = []
            for labels, run in group.members:
                if quantity in run:
                    value = float(run[quantity]) / (float(run[unit_of_work]) if unit_of_work else 1.0)
                    points.append((float(run["rms_height"]) * scale, value))
                    record(ax, *np.transpose(points[-1:]), Name(f"{name}, single seeds", labels))
            if points:
                ax.plot(*np.transpose(points), marker=marker, mec=colour, **_ONE_SEED)
                means.append(np.mean(points, axis=0))
                counts.append((len(points), group.asked))
                of_mean = Name(f"{name}, mean", group.labels._replace(seed=None))
                record(ax, *np.transpose(means[-1:]), of_mean, seeds=len(points))
        if means:
            ax.plot(*np.transpose(means), marker=marker, color=colour, **_MEAN)
            mark_fewer(ax, *np.transpose(means), *np.transpose(counts), {"color": colour, **_MEAN})
            handles[name] = legend_handle(color=GREY if contact else colour, marker=marker, **_MEAN)
    markers = itertools.cycle(_CROSSES)
    for each, look in _select_measured(fig, measurements, "rms_height"):
        for (name, branch), work in zip(_MEASURED_WORKS.items(), each.works, strict=True):
            if name in each.values:
                label, look = f"{each.label}, {branch}", look | {"marker": next(markers)}
                plot(ax, each.values["rms_height"] * scale, each.values[name] / work, label, **look)
                handles[label] = legend_handle(**look)
    ax.axhline(1, color=GREY, lw=0.6, zorder=0)
    ax.set(xlabel=f"rms height of the roughness ({unit})", ylabel=r"work of adhesion over $\Delta\gamma$")
    ax.margins(y=0.15)
    if not largest:
        ax.set_xticks([0])
    legend_below(fig, handles)
    return fig
