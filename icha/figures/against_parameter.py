"""Figures of results against a parameter: Tabor parameter (9), slope and load (14), area (15)."""

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator
from scipy.stats import linregress

from icha.analysis.model_error import snapshot_if_any, state_of
from icha.asperity.material import WU_HOLDS_FROM
from icha.asperity.tabor import sphere_pull_off_factor
from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE
from icha.contact.models import MODELS
from icha.datasets.campaign import find_snapshot, runs_with_loop, runs_with_snapshot
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import LOSS_PARTS, label_of
from icha.figures import select
from icha.figures.captions import attractions_of, grid_of_loops, range_of_attraction
from icha.figures.curves import drop_rounding_errors, gap_name
from icha.figures.drawn import Name, plot, record, say, show_runs
from icha.figures.ensembles import Points, mark_fewer
from icha.figures.looks import (
    ASPERITIES_NAME,
    REFERENCE_NAME,
    TRUTH_LINE,
    UNLOADING_MARKERS,
    Looks,
    legend_below,
    model_handle,
)
from icha.figures.style import (
    GREY,
    ONE_COLUMN,
    TWO_COLUMNS,
    Interface,
    in_style,
    interfaces_of,
    logarithmic_axes,
    new_panels,
)
from icha.support.formatting import choose_unit

_NEEDED = "the figure needs a surface energy"

# --- figure 9 ---

# The axis of the Tabor parameter is logarithmic if the ratio of its largest to its smallest value exceeds this number.
_TABOR_SPAN = 10.0

_TABOR = """The Tabor parameter is (R Δγ²/E*²)^(1/3) divided by the range of attraction. R is the radius of a sphere; on
a rough surface, 1/R is the rms curvature."""


_RANGES = """Contact area and mean separation at the load given in the figure, against the Tabor parameter. A line joins
runs that differ only in the range of attraction."""


@in_style
def tabor(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw contact area and mean separation at one snapshot against the Tabor parameter, for all runs of a study.

    For smooth spheres that are pulled off, draw the pull-off force and the loss instead.
    """
    runs = select.select_runs(campaign, study, ragged=False)
    if all(float(run.get("pull_off_force_over_jkr", 0)) and run["short_wavelength"] == np.inf for _, run in runs):
        return _pull_off_of_spheres(campaign[study].to_dataset(), runs)
    groups = select.group_by_contact(campaign, runs)
    dataset = campaign[study].to_dataset()
    state = select.kind_and_target(dataset, find_snapshot(dataset, kind, target))
    # Materials that differ only in the range of attraction form one line with the name of the first material.
    materials: dict[Interface, str] = {}
    interfaces = interfaces_of([dataset])
    curves: dict[select.Line, list[select.ContactRuns]] = {}
    bare: dict[select.Line, list[select.ContactRuns]] = {}
    for group in groups:
        found = {seed: (run, snapshot_if_any(run, *state)) for seed, run in group.by_seed.items()}
        states = {seed: state_of(run, at) for seed, (run, at) in found.items() if at is not None}
        if not states:
            continue
        group = group._replace(by_seed=states)
        of_material = interfaces[group.labels.material]._replace(interaction_range=None)
        line = group.line._replace(material=materials.setdefault(of_material, group.labels.material))
        if group.surface_energy > 0:
            curves.setdefault(line, []).append(group)
        elif not group.doubt:
            bare.setdefault(line, []).append(group)
    if not curves:
        raise select.NothingToDraw(f"study {study}: no run with adhesion is complete; {_NEEDED}")

    # The name of a material has no range of attraction, because lines of different ranges are one line.
    looks = Looks(campaign, [study], curves, only_drawn=True)
    fig, [panels] = new_panels(3.1)
    quantities = ("contact_area_fraction", gap_name(dataset))
    say(fig, _RANGES, _TABOR)
    model = groups[0].labels.model
    others = [MODELS[each].words for each in dataset["model"].values if each != model]
    left_out = "".join(f"; {words} of the study are left out" for words in others)
    say(fig, f"Curves are of {MODELS[model].words}{left_out}.")
    show_runs(fig, study, runs_with_snapshot(dataset, *state), dataset["model"] == model)
    drawn = []
    for line, found in curves.items():
        points = Points(found, "tabor_parameter", *quantities)
        for number, ax in enumerate(panels, 1):
            points.draw(ax, looks.look(line), number)
        drawn += points.means[0].tolist()
    for k, (line, found) in enumerate(bare.items()):
        look = {"color": looks.colour(line) if looks.by_place else GREY, "label": None if k else "no adhesion"}
        for ax, name in zip(panels, quantities, strict=True):
            values = [float(state[name]) for group in found for state in group.by_seed.values()]
            ends, means = [min(drawn), max(drawn)], np.full(2, np.mean(values))
            record(ax, ends, means, found[0].drawn_name)
            ax.axhline(means[0], ls=(0, (5, 2)), lw=1, zorder=1, **look)
            mark_fewer(ax, ends, means, len(values), sum(group.asked for group in found), look)
    for ax, name in zip(panels, quantities, strict=True):
        if max(drawn) > _TABOR_SPAN * min(drawn):
            logarithmic_axes(ax, "x")
        _shade_unverified(ax, min(drawn))
        ax.set(xlabel=label_of("tabor_parameter"), ylabel=label_of(name))
    panels[0].set_title(select.snapshot_label(dataset, find_snapshot(dataset, *state)), loc="right")
    legend_below(fig, looks.handles())
    return fig


def _shade_unverified(ax, smallest):
    """Shade the range of Tabor parameters without verified jump into contact, and widen the y axis."""
    low, high = ax.get_xlim()
    # The tolerance allows for a range of attraction that was rounded.
    if smallest < WU_HOLDS_FROM / 1.01:
        ax.axvspan(low, WU_HOLDS_FROM, color="0.93", lw=0, zorder=0, label="jump-in distance not verified")
    ax.set_xlim(low, high)
    # The limits of the axis are wider than the values, so that differences of a few per mille do not fill the panel.
    bottom, top = ax.get_ylim()
    ax.set_ylim(0.95 * bottom, 1.05 * top)


def _pull_off_of_spheres(study, runs):
    """Draw pull-off force and loss of smooth spheres against the Tabor parameter, with the limits of JKR and DMT."""
    labels, runs = runs[0][0], [run for _, run in runs]
    runs = sorted(runs, key=lambda run: float(run["tabor_parameter"]))
    names = ("tabor_parameter", "pull_off_force", "hysteresis_loss", "surface_energy", "shape_radius")
    names += ("contact_modulus", "period")
    at, force, loss, energy, R, modulus, side = np.array([[float(run[name]) for name in names] for run in runs]).T
    pull_off = force / (np.pi * energy * R)
    loss *= side**2 / np.cbrt(energy**5 * R**4 / modulus**2)
    resolved = np.array([run.attrs.get("attraction") == FINITE_RANGE for run in runs])
    fig, [panels] = new_panels(3.1)
    say(
        fig,
        "Pull-off force (a) and energy lost from first contact to separation (b) of smooth spheres, by "
        f"{MODELS[labels.model].words}.",
        _TABOR,
        "The theory of Maugis is for a constant attraction; JKR and DMT are its limits.",
    )
    show_runs(fig, labels.study, runs_with_loop(study, "hysteresis_loss"), study["model"] == labels.model)
    for ax, values in zip(panels, (pull_off, loss), strict=True):
        ax.plot(at, values, color=GREY, lw=0.6, zorder=1)
        for chosen, fill, label in ((resolved, "C0", FINITE_RANGE), (~resolved, "white", SHORT_RANGE)):
            if chosen.any():
                plot(ax, at[chosen], values[chosen], ls="none", marker="o", ms=4.5, mec="C0", mfc=fill, label=label)
        logarithmic_axes(ax, "x")
        ax.set_xlabel(label_of("tabor_parameter"))
    along = np.geomspace(at.min(), at.max(), 200)
    theory = [sphere_pull_off_factor(each) for each in along]
    plot(panels[0], along, theory, color="0.3", lw=1, label="theory of Maugis")
    for limit, name, style in ((1.5, "JKR", (0, (5, 2))), (2.0, "DMT", ":")):
        panels[0].axhline(limit, color="0.3", lw=0.9, ls=style, label=name)
    panels[0].set(ylabel=r"pull-off force$\,/\,\pi\Delta\gamma R$", ylim=(1.4, 2.1))
    panels[1].set_ylabel(r"loss$\,/\,(\Delta\gamma^5 R^4/E^{*2})^{1/3}$")
    legend_below(fig, {})
    return fig


# --- figure 14 ---

# The axis is linear if the ratio of the largest to the smallest positive value is at most this number, without and with
# zeros.
_SPAN, _SPAN_WITH_ZEROS = 5.0, 30.0
_LINE = {"lw": 0.9, "ls": "-"}
_TRUTH = {name: TRUTH_LINE[name] for name in ("lw", "ls")}
# Oblique crosses can be told from bars.
_OBLIQUE = UNLOADING_MARKERS[REFERENCE_NAME]
# Points at the same slope or load are drawn side by side. The last and the first of many lines have nearly this ratio,
# or the root of the ratio of the closest different values; values count as the same up to the second ratio.
_SPREAD, _SAME = 1.15, 1.001
# A slope has a tick if its ratio to the next smaller slope is at least this number.
_APART = 1.06
# Size of the markers, divided by the usual size, so that short bars are visible.
_SMALLER = 0.7
# Variable on the y axis.
_Y = "pull_off_pressure"


@in_style
def pull_off(campaign: xr.DataTree, *, study: str, load_studies: Sequence[str] = ()) -> Figure:
    """Draw the pull-off pressure (mean over the seeds) against slope, and against the largest load of the path."""
    studies = list(dict.fromkeys([study, *load_studies]))
    by_slope = select.select_detached_lines(campaign, [study], _Y, along_slopes=True)
    by_load = select.select_detached_lines(campaign, list(dict.fromkeys(load_studies)), _Y)
    groups = list(itertools.chain(*by_slope.values(), *by_load.values()))
    if len({group.labels.rms_slope for group in groups}) == 1:  # the same markers in both panels
        by_load = {line._replace(rms_slope=None): found for line, found in by_load.items()}
    lines = [*by_slope, *by_load]
    looks = Looks(campaign, studies, lines, by_place=None)
    runs = [run for group in groups for run in group.by_seed.values()]
    factor, unit = choose_unit(max(float(run[_Y]) for run in runs), "Pa")

    fig, [panels] = new_panels(2.9, columns=2 if by_load else 1, width=TWO_COLUMNS if by_load else ONE_COLUMN)
    second = " (a) and against the largest reduced pressure F/(E* h'rms A0) of the path (b)" if by_load else ""
    say(
        fig,
        f"""Pull-off pressure against the rms slope{second} of runs that separated completely. The pull-off pressure is
        the largest nominal tension in unloading.""",
    )
    for each in studies:
        show_runs(fig, each, runs_with_loop(campaign[each].to_dataset(), _Y))
    for ax, x, drawn in zip(panels, ("rms_slope", "largest_reduced_pressure"), (by_slope, by_load), strict=False):
        points = {line: Points(found, x, _Y, factor=factor) for line, found in drawn.items()}
        spread = _spread([each.means[0] for each in points.values()])
        for position, (line, each) in enumerate(points.items()):
            beside = looks.is_beside(line)
            look = looks.cross(line, shape=_OBLIQUE) | _TRUTH if beside else looks.look(line) | _LINE
            look["ms"] *= _SMALLER
            each.draw(ax, look, shift=spread ** ((position + 0.5) / len(points) - 0.5))
        loads, values = np.concatenate([each.means for each in points.values()], axis=1)
        _scale_pull_off(ax, values)
        ax.set(xlabel=label_of(x), ylabel=label_of(_Y, unit))
    _scale_slopes(panels[0], sorted({group.labels.rms_slope for found in by_slope.values() for group in found}))
    if by_load and loads.min() > 0:
        logarithmic_axes(panels[1], "x")
        panels[1].set_xlim(loads.min() / 1.6, loads.max() * 1.6)
    handles = looks.handles(**_LINE)
    if crossed := list(filter(looks.is_beside, lines)):
        handles = looks.colour_handles() if looks.by_place else handles
        handles |= {ASPERITIES_NAME: model_handle(ASPERITIES_NAME, **_LINE | looks.fill())}
        handles |= looks.cross_handles(crossed, shape=_OBLIQUE, **_TRUTH)
    say(
        fig,
        range_of_attraction(attractions_of(runs)),
        "Points at one slope or load are drawn side by side; lines guide the eye.",
        """The pull-off force of a shape is the pull-off pressure times the area of the square; it is the variable
        `pull_off_force`."""
        if any(select.has_shape(campaign[each].to_dataset()) for each in studies)
        else "",
        grid_of_loops(campaign, studies),
    )
    title = [*([] if crossed else looks.models), looks.heading()]
    panels[0].set_title(", ".join(filter(None, title)), loc="right", fontsize=8)
    legend_below(fig, handles)
    return fig


def _scale_pull_off(ax, values):
    """Set a linear y axis; if values span much, a logarithmic axis, which is linear near zero if there are zeros."""
    positive = drop_rounding_errors(values)
    zeros = len(positive) < np.isfinite(values).sum()
    if len(positive) and not zeros and positive.max() > _SPAN * positive.min():
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_formatter("")
        return
    if len(positive) and positive.max() > _SPAN_WITH_ZEROS * positive.min():
        least = 10.0 ** np.floor(np.log10(positive.min()))
        ax.set_yscale("symlog", linthresh=least, linscale=0.4)
        ax.set_ylim(-0.3 * least, 2 * ax.dataLim.ymax)  # contains the bars
    elif len(positive):
        ax.set_ylim(bottom=-0.04 * positive.max())
    ax.axhline(0, color=GREY, lw=0.6, zorder=1)


def _scale_slopes(ax, slopes):
    """Set scale, limits and ticks of an axis of slopes, in ascending order."""
    ax.set_xscale("log" if slopes[-1] > 3 * slopes[0] > 0 else "linear")
    room = 0.25 * (slopes[-1] or 1)  # a smooth shape has the slope 0
    ax.set_xlim(slopes[0] / 1.25 if slopes[0] else -room, slopes[-1] + room)
    ticks = [slope for k, slope in enumerate(slopes) if not k or slope > _APART * slopes[k - 1]]
    ax.set_xticks(ticks, [f"{slope:.4g}" for slope in ticks])
    ax.xaxis.minorticks_off()


def _spread(positions):
    """Return the ratio of the last and the first of points side by side, so that points keep their order."""
    values = np.unique(np.concatenate(positions))
    ratios = values[1:] / values[:-1] if values.size and values[0] > 0 else np.empty(0)
    return min([_SPREAD, *np.sqrt(ratios[ratios > _SAME])])


# --- figure 15 ---

# Look of the bar of each part of the loss. No bar has the colour of a material.
_PART_LOOKS = (
    {"fc": "0.25"},
    {"fc": "0.65"},
    {"fc": "white", "hatch": "//////"},
    {"fc": "0.85", "hatch": "xxxx"},
    {"fc": "white", "hatch": "||||"},
    {"fc": "white", "hatch": "...."},
)
PARTS = dict(zip(LOSS_PARTS, _PART_LOOKS, strict=True))
# Smallest number of points for a fitted line, because a straight line passes through any two points.
_LEAST_POINTS = 3
_FIT_POINTS = 100
# Both axes are logarithmic if, on each axis, the ratio of the largest to the smallest value exceeds this number.
_LOSS_SPAN = 30.0
# A part of the loss is drawn if the magnitude of its share reaches this number in at least one bar.
_LEAST_SHARE = 1e-6
# Variables along x and y.
_LOSS = ("largest_contact_area_fraction", "hysteresis_loss_over_surface_energy")
# Opacity of the bars of runs to which the model is not applicable.
_PALE = 0.35

_FIT = """Lines are least-squares fits of a straight line to points that differ only in their largest load. The legend
gives the coefficient of determination r² and the exponent of a power law through the same points; the exponent is 1 if
the loss is proportional to the contact area. Violano and Afferrante (Lubricants 9 (2021) 7) found a linear growth of
the loss."""


@in_style
def loss(campaign: xr.DataTree, *, studies: Sequence[str]) -> Figure:
    """Draw the loss of runs with adhesion (mean over the seeds), and the parts of this loss by cause."""
    studies = list(dict.fromkeys(studies))
    lines = select.select_detached_lines(campaign, studies, "hysteresis_loss")
    lines = {line: found for line, found in lines.items() if found[0].surface_energy > 0}
    if not lines:
        raise select.NothingToDraw(f"studies {', '.join(studies)}: no run with adhesion; {_NEEDED}")
    looks = Looks(campaign, studies, lines, by_place=None)
    truths = {line: lines[line] for line in lines if looks.is_beside(line)}
    lines = {line: found for line, found in lines.items() if line not in truths} | truths
    runs = [run for group in itertools.chain(*lines.values()) for run in group.by_seed.values()]
    several_cycles = any(int(run["leg"].max()) > 1 for run in runs)
    fig, [(left, right)] = new_panels(3.1, width_ratios=(1.25, 1))
    for each in studies:
        dataset = campaign[each].to_dataset()
        show_runs(fig, each, runs_with_loop(dataset, "hysteresis_loss"), dataset["surface_energy"] > 0)
    say(
        fig,
        """Hysteresis loss of runs with adhesion, divided by the surface energy, against the largest contact area on the
        path divided by the nominal area (a). The loss is the energy per nominal area that is dissipated on the whole
        path, from first contact to complete separation.""",
        "With turning points, this is the loss of all loadings and unloadings, inner loops included."
        if several_cycles
        else "",
        """With boundary elements, steps add an error of at most 0.1 % of the largest work done in loading; the error of
        the grid is larger."""
        if looks.models != [ASPERITIES_NAME]
        else "",
        range_of_attraction(attractions_of(runs)),
    )
    handles = _draw_losses(left, lines, looks)
    if truths:
        handles |= {ASPERITIES_NAME: model_handle(ASPERITIES_NAME, **looks.fill())}
        handles |= looks.cross_handles(truths)
    else:
        left.set_title(looks.models[0], loc="right")
    say(
        fig,
        """Panel (b) shows the causes of the loss at the largest load of every series of panel (a), with the marker of
        the series below the bar. Each part is divided by the sum of the magnitudes of all parts. Negative parts by
        coalescence are energy gained when spots unite or separate; a negative unattributed part is an error of steps or
        of interactions without reciprocity.""",
        "Where the asperity model has the same series as boundary elements, the causes are those of the asperity model."
        if truths
        else "",
        grid_of_loops(campaign, studies),
    )
    compared = {line.contact for line in lines if line not in truths}
    alone = {line: found for line, found in lines.items() if line not in truths or line.contact not in compared}
    shown = _draw_parts(right, alone, looks)
    handles |= {label_of(name): Patch(ec="black", lw=0.5, **PARTS[name]) for name in shown}
    legend_below(fig, handles, looks.heading())
    return fig


def _draw_losses(ax, lines, looks):
    """Draw the losses of all lines with fits; return legend entries."""
    drawn = {line: Points(found, *_LOSS) for line, found in lines.items()}
    handles = looks.handles(ls="none") if looks.many else {}
    fitted = [line for line in drawn if not (looks.is_beside(line) or line.doubt)]
    fitted_contacts = {line.contact for line in fitted}
    for line, points in drawn.items():
        handle, name = points.draw(ax, _look_of_loss(looks, line)), looks.name(line)
        (x, y), words = points.means, ""
        if line in fitted and points.same_seeds and len(np.unique(x)) >= _LEAST_POINTS:
            along = np.linspace(x.min(), x.max(), _FIT_POINTS)
            values, r_squared, exponent = fit_line(x, y, along)
            say(ax, _FIT)
            words = f": $r^2$ = {r_squared:.4f}, exponent {exponent:.2f}"
            look = {"color": looks.colour(line), "lw": 0.9, "zorder": 2}
            plot(ax, along, values, points.name._replace(curve="fitted line"), **look)
        if not looks.many and (line in fitted or line.contact not in fitted_contacts):
            handles.setdefault(name + words, handle)
    means = np.concatenate([points.means for points in drawn.values()], axis=1)
    if all(values.min() > 0 and values.max() > _LOSS_SPAN * values.min() for values in means):
        logarithmic_axes(ax)
    ax.axhline(0, color=GREY, lw=0.6, zorder=1)
    ax.set(xlabel=label_of(_LOSS[0]), ylabel=label_of(_LOSS[1]))
    return handles


def _look_of_loss(looks, line):
    """Return the look of the markers of a line: crosses of boundary elements beside another model."""
    return looks.cross(line) if looks.is_beside(line) else looks.look(line) | {"ls": "none"}


def fit_line(x: np.ndarray, y: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Fit a straight line; return its values at `along`, the coefficient of determination, and an exponent.

    The exponent is that of a power law through the same points; NaN if a value of y is not positive.
    """
    line = linregress(x, y)
    exponent = linregress(np.log(x), np.log(y)).slope if np.all(y > 0) else np.nan
    return line.intercept + line.slope * along, line.rvalue**2, exponent


def shares(line: Sequence[select.ContactRuns]) -> dict[str, float]:
    """Return the parts of the loss at the largest load of a line, divided by the sum of the magnitudes of all parts."""
    parts = Points(line, "largest_reduced_pressure", *PARTS).means[1:, -1]
    total = np.abs(parts).sum()
    return dict(zip(PARTS, parts / total if total > 0 else parts, strict=True))


def _draw_parts(ax, lines, looks):
    """Draw the parts of the loss of every line as a stacked bar; return the names of the drawn parts."""
    bars = {line: shares(found) for line, found in lines.items()}
    shown = [name for name in PARTS if any(abs(bar[name]) >= _LEAST_SHARE for bar in bars.values())]
    for position, (line, bar) in enumerate(bars.items()):
        above, below = 0.0, 0.0
        for name in shown:
            share = 100 * bar[name]
            labels = RunLabels(None, line.model, line.surface, None, line.rms_slope, line.material)
            record(ax, [position], [share], Name(label_of(name), labels))
            bar_look = {"ec": "black", "lw": 0.4, "alpha": _PALE if line.doubt else None} | PARTS[name]
            ax.bar(position, share, 0.8, bottom=above if share > 0 else below, **bar_look)
            above, below = above + max(share, 0), below + min(share, 0)
        look = _look_of_loss(looks, line)
        ax.plot(position, -0.055, transform=ax.get_xaxis_transform(), clip_on=False, **look)
    ax.axhline(0, color="black", lw=0.6)
    ax.set(xlim=(-0.7, len(bars) - 0.3), ylabel="share of losses and gains (%)")
    ax.set_xticks(range(len(bars)), [looks.label(line.place) for line in bars], rotation=90)
    ax.tick_params("x", length=0, pad=14, labelsize=7)
    ax.set_xlabel("series of (a), at their largest load", labelpad=2)
    return shown
