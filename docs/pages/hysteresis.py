"""The page of the documentation on pull-off and hysteresis: words, and tables from the campaign dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from icha.analysis.model_error import run_of_same_contact
from icha.datasets.campaign import run_labels, select_run
from pages.tables import means, table

_TITLE = """# Pull-off and adhesion hysteresis

Ways in and back of the campaign `{campaign}`: on a self-affine surface of {period:g} µm, with roll-off and short
cut-off as in its configuration, E\\* = {modulus:g} MPa, {seeds} seeds. Numbers are means over the seeds and their
standard deviations. Pull-off is the largest tension on the way back, in Pa of nominal area; loss is ∮p dū.
"""

_RULES = """## What undoing coalescence assumes

On the way in, overlapping spots become one equivalent spot of the same area. The model says nothing of the way back.
Two rules are there (`united_until` of a study):

- `detachment`: a united spot keeps its identity until it detaches as a whole; then the asperities that it was made of
  that still have a stable state stay in contact.
- `overlap`: a united spot comes apart into the two that it was made of as soon as its area has fallen to what it was
  when they just touched: the mirror image of the union.

The equivalent spot is one asperity that is taller, and rounder, than either of the two; down to small areas it carries
more load than the two apart would. So under `detachment` the way back does not lie on the way in. The surfaces may give
back more work than was put in, as two equal asperities do, and the loss come out negative, which no passive contact can
do; or, where asperities are unequal, the united spot may let go early, and work is lost for nothing.
Without adhesion nothing should be lost at all; what the loop of the bare surface loses or gains is the error of the
rule, and the table has it in per cent of the largest work done on the way in. With adhesion, the two rules' pull-off
and loss are side by side.
"""

_LOADS = """## Against the largest load

Violano & Afferrante (Lubricants 9 (2021) 7, doi:10.3390/lubricants9010007) report, for self-affine surfaces with the
adhesion of Johnson, Kendall and Roberts, a loss that is linear in the true contact area reached, and a pull-off that
hardly depends on the largest load. Here both are measured: the exponent n of loss ∝ (A/A₀)ⁿ and the coefficient of
determination r² of a straight line, through the means over the seeds, and how far the pull-off varies between the
loads (largest over smallest, less one).
"""

_CONTROL = """## Under load control

The state runs along the same curve and jumps, at constant load, where the load would have to turn back; the last
contacts break together at the largest tension. First seed.
"""

_ELEMENTS = """## Beside boundary elements

On a small surface boundary elements follow the same path: minimum after minimum of the energy at given mean gaps, down
and up. Their range of attraction must be resolved by their grid, so it is long ({tabor}); the contact is then far from
the limit of Johnson, Kendall and Roberts that ICHA's spots obey, and jumps are much smaller than in that limit.
"""


def page(
    campaign: xr.DataTree,
    *,
    slopes: str,
    detachment: str,
    loads: Sequence[str],
    load_control: str,
    loops: Mapping[str, Sequence[xr.Dataset]],
    figures: Mapping[str, str],
    command: str,
) -> str:
    """The page, in Markdown.

    Parameters
    ----------
    campaign : the campaign dataset.
    slopes, detachment : studies of the same surfaces under the rules `overlap` and `detachment`.
    loads : studies that differ in their largest load.
    load_control : study under load control of a part of `slopes`.
    loops : for studies that boundary elements stand beside, their datasets.
    figures : paths, relative to the page, and what they show.
    command : by which the page is written again.
    """
    study = campaign[slopes].to_dataset()
    title = _TITLE.format(
        campaign=campaign.attrs["campaign"],
        period=1e6 * float(study["period"][0]),
        modulus=1e-6 * float(study["contact_modulus"][0]),
        seeds=study.sizes["seed"],
    )
    parts = [
        title,
        f"Every number on this page is computed, and the page written, by `{command}`.\n",
        *(f"![{what}]({path})\n\n*{what}.*\n" for path, what in figures.items()),
        "## Against rms slope and surface energy\n",
        summary(study),
        _RULES,
        rules(study, campaign[detachment].to_dataset()),
        _LOADS,
        largest_loads([campaign[name].to_dataset() for name in loads]),
        _CONTROL,
        controls(study, campaign[load_control].to_dataset()),
    ]
    for name, solved in loops.items():
        if solved:
            tabor = ", ".join(f"μ = {float(one['tabor_parameter']):.2g}" for one in solved)
            parts += [_ELEMENTS.format(tabor=tabor), elements(campaign, name, solved)]
    return "\n".join(parts)


def _cells(study):
    """Rms slope, material, and the study's part that they name."""
    for slope in study["rms_slope"].values:
        for material in study["material"].values:
            yield float(slope), str(material), study.sel(rms_slope=slope, material=material).isel(surface=0)


def _adhesive(study):
    return study.sel(material=study["surface_energy"].values > 0)


def _mean(values, form="{:.3g}"):
    """Mean ± deviation over the seeds."""
    return means([np.array([value]) for value in np.atleast_1d(values)], form)[0]


def _energy(one):
    return f"{1e3 * float(one['surface_energy']):g}"


def summary(study: xr.Dataset) -> str:
    """Pull-off and loss for every slope and surface energy."""
    head = [
        "h′rms",
        "Δγ, mJ/m²",
        "stickiness",
        "A/A₀",
        "pull-off, Pa",
        "over all summits",
        "loss/Δγ",
        "jump-in : jump-off",
    ]
    rows = []
    for slope, _, one in _cells(_adhesive(study)):
        rows.append(
            [
                f"{slope:g}",
                _energy(one),
                f"{float(one['stickiness'].mean()):.2g}",
                _mean(one["largest_contact_area_fraction"].values),
                _mean(one["pull_off_pressure"].values),
                _mean(one["pull_off_over_summits"].values, "{:.4f}"),
                _mean(one["hysteresis_loss_over_surface_energy"].values, "{:.4f}"),
                _mean(one["loss_by_jump_in"].values / one["loss_by_jump_off"].values, "{:.1f}"),
            ]
        )
    return table(head, rows)


def rules(overlap: xr.Dataset, detachment: xr.Dataset) -> str:
    """The two rules side by side: pull-off and loss; without adhesion the loss over the largest work."""
    head = ["h′rms", "Δγ, mJ/m²", "pull-off, Pa: overlap", "detachment", "loss, µJ/m²: overlap", "detachment"]
    rows = []
    for (slope, _, one), (_, _, other) in zip(_cells(overlap), _cells(detachment), strict=True):
        adhesive = float(one["surface_energy"]) > 0
        row = [f"{slope:g}", _energy(one)]
        for name, form, scale in (("pull_off_pressure", "{:.3g}", 1.0), ("hysteresis_loss", "{:+.3g}", 1e6)):
            for each in (one, other):
                if adhesive:
                    row.append(_mean(scale * each[name].values, form))
                elif name == "pull_off_pressure":
                    row.append("–")
                else:
                    part = 100 * each[name].values / each["work"].max("step").values
                    row.append(f"{_mean(part, '{:+.3f}')} % of the work")
        rows.append(row)
    return table(head, rows)


def largest_loads(studies: Sequence[xr.Dataset]) -> str:
    """Pull-off and loss against the largest load, for the first slope that all studies have."""
    slope = min(set.intersection(*(set(study["rms_slope"].values.tolist()) for study in studies)))
    studies = [study.sel(rms_slope=slope).isel(surface=0) for study in studies]
    studies.sort(key=lambda study: float(study["largest_reduced_pressure"].mean()))
    head = ["Δγ, mJ/m²", "", *(f"p\\* = {float(s['largest_reduced_pressure'].mean()):.2g}" for s in studies), ""]
    rows = []
    materials = [m for m in studies[0]["material"].values if all(m in s["material"].values for s in studies)]
    for material in materials:
        own = [study.sel(material=material) for study in studies]
        if not float(own[0]["surface_energy"]) > 0:
            continue
        area, loss, pull = (
            np.array([float(one[name].mean()) for one in own])
            for name in ("largest_contact_area_fraction", "hysteresis_loss_over_surface_energy", "pull_off_pressure")
        )
        fit = np.polyfit(area, loss, 1)
        r2 = 1 - np.sum((loss - np.polyval(fit, area)) ** 2) / np.sum((loss - loss.mean()) ** 2)
        power = f"n = {np.polyfit(np.log(area), np.log(loss), 1)[0]:.2f}" if np.all(loss > 0) else "n –"
        label = _energy(own[0])
        rows += [
            [label, "A/A₀", *(_mean(one["largest_contact_area_fraction"].values) for one in own), ""],
            [
                label,
                "loss/Δγ",
                *(_mean(one["hysteresis_loss_over_surface_energy"].values, "{:.4f}") for one in own),
                f"{power}, r² = {r2:.3f}",
            ],
            [
                label,
                "pull-off, Pa",
                *(_mean(one["pull_off_pressure"].values) for one in own),
                f"varies by {100 * (pull.max() / pull.min() - 1):.0f} %",
            ],
        ]
    return f"h′rms = {slope:g}.\n\n" + table(head, rows)


def controls(separation: xr.Dataset, load: xr.Dataset) -> str:
    """The same runs under separation and under load control."""
    head = [
        "Δγ, mJ/m²",
        "pull-off, Pa: separation",
        "load",
        "last contact at, Pa: separation",
        "load",
        "loss/Δγ: separation",
        "load",
    ]
    rows = []
    for slope, material, one in _cells(_adhesive(load)):
        one = one.isel(seed=0)
        other = separation.sel(rms_slope=slope, material=material, seed=int(one["seed"])).isel(surface=0)
        row = [_energy(one)]
        for name, form in (
            ("pull_off_pressure", "{:.4g}"),
            ("detachment_pressure", "{:.3g}"),
            ("hysteresis_loss_over_surface_energy", "{:.4f}"),
        ):
            row += [form.format(float(each[name])) for each in (other, one)]
        rows.append(row)
    return table(head, rows)


def elements(campaign: xr.DataTree, study: str, loops: Sequence[xr.Dataset]) -> str:
    """Boundary elements both ways, and the study's run of the same contact."""
    head = ["", "A/A₀ at the largest load", "pull-off, Pa", "at ū/h_rms", "loss, µJ/m²", "loss/Δγ"]
    rows = []
    runs = {labels: select_run(campaign, labels) for labels in run_labels(campaign) if labels.study == study}
    for solved in loops:
        run = runs[run_of_same_contact(runs.items(), solved)]
        gamma = float(solved["surface_energy"])
        for name, one in (("boundary elements", solved), ("ICHA", run)):
            loss = float(one["hysteresis_loss"])
            rows.append(
                [
                    f"{name}, Δγ = {1e3 * gamma:g} mJ/m²",
                    f"{float(one['largest_contact_area_fraction']):.3g}",
                    f"{float(one['pull_off_pressure']):.3g}",
                    f"{float(one['pull_off_separation']) / float(one['rms_height']):.2f}",
                    f"{1e6 * loss:.3g}",
                    f"{loss / gamma:.4f}" if gamma else "–",
                ]
            )
    return table(head, rows)
