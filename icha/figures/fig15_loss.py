"""Fig. 15: energy lost in a cycle against the largest contact area, and the causes of the loss."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.models import REFERENCE_MODEL
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import LOSS_PARTS, label_of
from icha.figures.captions import attractions_of, grid_of_loops, only_model, range_of_attraction
from icha.figures.curves import cross_look
from icha.figures.drawn import Name, plot, record, say
from icha.figures.ensembles import Points, points_handles
from icha.figures.looks import ASPERITIES_NAME, REFERENCE_NAME, legend_below, looks_of_studies, model_handle, pale
from icha.figures.select import ContactRuns, NothingToDraw, names_of_models, select_detached_lines
from icha.figures.style import GREY, in_style, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Look of the bar of each part of the loss. No bar has the colour of a material.
PARTS = dict(
    zip(
        LOSS_PARTS,
        (
            {"fc": "0.25"},
            {"fc": "0.65"},
            {"fc": "white", "hatch": "//////"},
            {"fc": "0.85", "hatch": "xxxx"},
            {"fc": "white", "hatch": "||||"},
            {"fc": "white", "hatch": "...."},
        ),
        strict=True,
    )
)
# Smallest number of points for a fitted line, because a straight line passes through any two points.
_LEAST_POINTS = 3
_FIT_POINTS = 100
# Both axes are logarithmic if, on each axis, the ratio of the largest to the smallest value exceeds this number.
_SPAN = 30.0
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
def figure(campaign: xr.DataTree, *, studies: Sequence[str]) -> Figure:
    """Draw the loss of runs with adhesion (mean over the seeds), and the parts of this loss by cause."""
    from matplotlib.patches import Patch

    studies = list(dict.fromkeys(studies))
    runs = select_detached_lines(campaign, studies, quantity="hysteresis_loss", both_models=True)
    sticky = {key: line for key, line in runs.items() if line[0].surface_energy > 0}
    if not sticky:
        raise NothingToDraw(f"studies {', '.join(studies)}: no run with adhesion; the figure needs a surface energy")
    several = len({model for *_, model in sticky}) > 1
    looks = looks_of_studies(campaign, studies, [contact for contact, *_ in sticky], crosses=several)
    truths = {key: line for key, line in sticky.items() if several and key[-1] == REFERENCE_MODEL}
    sticky = {key: line for key, line in sticky.items() if key not in truths}

    fig, [(loss, parts)] = new_panels(3.1, width_ratios=(1.25, 1))
    models = names_of_models(itertools.chain(*sticky.values(), *truths.values()))
    say(
        fig,
        """Hysteresis loss of runs with adhesion, divided by the surface energy, against the largest contact area on the
        path divided by the nominal area (a). The loss is the energy per nominal area that is dissipated on a path from
        first contact to the largest load and back to complete separation.""",
        "Crosses are boundary elements, other symbols the asperity model." if truths else only_model(models),
    )
    if models != [ASPERITIES_NAME]:
        say(fig, "With boundary elements, the loss is known to 0.1 % of the largest work done in loading.")
    every = (run for line in (*sticky.values(), *truths.values()) for group in line for run in group.by_seed.values())
    say(fig, range_of_attraction(attractions_of(every)))
    handles, counts = _draw_losses(loss, sticky, truths, looks)
    if truths:
        names = {ASPERITIES_NAME: looks.fill(), REFERENCE_NAME: {}}
        handles |= {name: model_handle(name, **look) for name, look in names.items()}
    else:
        loss.set_title(", ".join(names_of_models(itertools.chain(*sticky.values()))), loc="right")
    shown = _draw_parts(parts, sticky, looks)
    say(
        fig,
        """Panel (b) shows the causes of the loss at the largest load of every series of panel (a), with the marker of
        the series below the bar.""",
        "The causes are those of the asperity model." if truths else "",
        """Negative parts are energy gained when spots unite or separate. Each part is divided by the sum of the
        magnitudes of all parts.""",
        "The unattributed loss has none of these causes." if "loss_unattributed" in shown else "",
        grid_of_loops(campaign, studies),
    )
    handles |= {label_of(name): Patch(ec="black", lw=0.5, **PARTS[name]) for name in shown}
    legend_below(fig, handles | points_handles(fig, counts), looks.heading(), rows=looks.slopes_per_surface)
    return fig


def _draw_losses(ax, runs, truths, looks):
    """Draw the losses of runs with fits, and boundary elements; return legend entries and numbers of seeds."""
    drawn = {key: Points(line, *_LOSS) for key, line in (runs | truths).items()}
    handles = looks.handles(ls="none") if looks.many else {}
    for key, line in drawn.items():
        contact, applicable, model = key
        if key in truths:
            look = cross_look(looks, contact)
            line.draw(ax, look if applicable else pale(look, model))
            continue
        handle = line.draw(ax, looks.look(contact, applicable=applicable, model=model) | {"ls": "none"})
        if not applicable:
            continue
        (x, y), words = line.means, ""
        if line.same_seeds and len(np.unique(x)) >= _LEAST_POINTS:
            along = np.linspace(x.min(), x.max(), _FIT_POINTS)
            values, r_squared, exponent = fit_line(x, y, along)
            say(ax, _FIT)
            words = f": $r^2$ = {r_squared:.4f}, exponent {exponent:.2f}"
            plot(
                ax,
                along,
                values,
                line.name._replace(curve="fitted line"),
                color=looks.colour(contact),
                lw=0.9,
                zorder=2,
            )
        if not looks.many:
            handles[looks.name(contact) + words] = handle
    means = np.concatenate([line.means for line in drawn.values()], axis=1)
    if all(values.min() > 0 and values.max() > _SPAN * values.min() for values in means):
        logarithmic_axes(ax)
    ax.axhline(0, color=GREY, lw=0.6, zorder=1)
    ax.set(xlabel=label_of(_LOSS[0]), ylabel=label_of(_LOSS[1]))
    return handles, [count for line in drawn.values() for count in line.counts]


def fit_line(x: np.ndarray, y: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Fit a straight line by least squares.

    Returns
    -------
    Values of the line at `along`; coefficient of determination; exponent of a power law through the same points. The
    exponent is NaN if a value of y is not positive.
    """
    from scipy.stats import linregress

    line = linregress(x, y)
    exponent = linregress(np.log(x), np.log(y)).slope if np.all(y > 0) else np.nan
    return line.intercept + line.slope * along, line.rvalue**2, exponent


def shares(line: Sequence[ContactRuns]) -> dict[str, float]:
    """Return the parts of the loss at the largest load of a line, divided by the sum of the magnitudes of all parts."""
    parts = Points(line, "largest_reduced_pressure", *PARTS).means[1:, -1]
    total = np.abs(parts).sum()
    return dict(zip(PARTS, parts / total if total > 0 else parts, strict=True))


def _draw_parts(ax, runs, looks):
    """Draw the parts of the loss of every line as a stacked bar; return the names of the drawn parts."""
    bars = {key: shares(line) for key, line in runs.items()}
    shown = [name for name in PARTS if any(abs(bar[name]) >= _LEAST_SHARE for bar in bars.values())]
    for position, ((contact, applicable, model), bar) in enumerate(bars.items()):
        above, below = 0.0, 0.0
        for name in shown:
            share = 100 * bar[name]
            part = Name(label_of(name), RunLabels(None, model, contact[1], None, contact[2], contact[0]))
            record(ax, [position], [share], part)
            bar_look = {"ec": "black", "lw": 0.4, "alpha": None if applicable else _PALE} | PARTS[name]
            ax.bar(position, share, 0.8, bottom=above if share > 0 else below, **bar_look)
            above, below = above + max(share, 0), below + min(share, 0)
        look = looks.look(contact, applicable=applicable, model=model)
        ax.plot(position, -0.055, transform=ax.get_xaxis_transform(), clip_on=False, **look | {"ls": "none"})
    ax.axhline(0, color="black", lw=0.6)
    ax.set(xlim=(-0.7, len(bars) - 0.3), ylabel="share of losses and gains (%)")
    ax.set_xticks(range(len(bars)), [looks.place_name(tuple(place)) for (_, *place), *_ in bars], rotation=90)
    ax.tick_params("x", length=0, pad=14, labelsize=7)
    ax.set_xlabel("series of (a), at their largest load", labelpad=2)
    return shown
