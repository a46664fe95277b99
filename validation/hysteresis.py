"""Tables of docs/hysteresis.md: pull-off and loss of the asperity model, from the results of campaign hysteresis.

Run the campaign first; then: python -m validation.hysteresis
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from icha.configuration.load import load_configuration
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.files import read_campaign
from validation.tables import Table, copy_figures, means, write_tables


def _cells(study):
    """Yield rms slope, material, and the runs of the study with both."""
    for slope in study["rms_slope"].values:
        for material in study["material"].values:
            yield float(slope), str(material), _asperity_runs(study, slope).sel(material=material)


def _asperity_runs(study, slope):
    """Return the runs of the asperity model on the first surface at a slope."""
    return study.sel(model=DEFAULT_MODEL, rms_slope=slope).isel(surface=0)


def _adhesive(study):
    return study.sel(material=study["surface_energy"].values > 0)


def _mean(values, form="{:.3g}"):
    """Format mean ± standard deviation over the seeds."""
    return means([np.array([value]) for value in np.atleast_1d(values)], form)[0]


def _energy(one):
    return f"{1e3 * float(one['surface_energy']):g}"


def summary(study: xr.Dataset) -> Table:
    """Table of pull-off and loss for each slope and surface energy."""
    head = ["h′rms", "Δγ, mJ/m²", "stickiness", "A/A₀", "pull-off, Pa", "over all summits", "loss/Δγ"]
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
    return Table([*head, "jump-in : jump-off"], rows)


def largest_loads(studies: Sequence[xr.Dataset]) -> Table:
    """Table of pull-off and loss against the largest load, for the first slope in all studies."""
    slope = min(set.intersection(*(set(study["rms_slope"].values.tolist()) for study in studies)))
    studies = [_asperity_runs(study, slope) for study in studies]
    studies.sort(key=lambda study: float(study["largest_reduced_pressure"].mean()))
    head = ["Δγ, mJ/m²", "", *(f"p\\* = {float(s['largest_reduced_pressure'].mean()):.2g}" for s in studies), ""]
    rows = []
    materials = [m for m in studies[0]["material"].values if all(m in s["material"].values for s in studies)]
    for material in materials:
        runs = [study.sel(material=material) for study in studies]
        if not float(runs[0]["surface_energy"]) > 0:
            continue
        area, loss, pull = (
            np.array([float(one[name].mean()) for one in runs])
            for name in ("largest_contact_area_fraction", "hysteresis_loss_over_surface_energy", "pull_off_pressure")
        )
        fit = np.polyfit(area, loss, 1)
        r2 = 1 - np.sum((loss - np.polyval(fit, area)) ** 2) / np.sum((loss - loss.mean()) ** 2)
        power = f"n = {np.polyfit(np.log(area), np.log(loss), 1)[0]:.2f}" if np.all(loss > 0) else "n –"
        label = _energy(runs[0])
        rows += [
            [label, "A/A₀", *(_mean(one["largest_contact_area_fraction"].values) for one in runs), ""],
            [
                label,
                "loss/Δγ",
                *(_mean(one["hysteresis_loss_over_surface_energy"].values, "{:.4f}") for one in runs),
                f"{power}, r² = {r2:.3f}",
            ],
            [
                label,
                "pull-off, Pa",
                *(_mean(one["pull_off_pressure"].values) for one in runs),
                f"varies by {100 * (pull.max() / pull.min() - 1):.0f} %",
            ],
        ]
    return Table(head, rows)


def controls(separation: xr.Dataset, load: xr.Dataset) -> Table:
    """Table of the same runs under separation and under load control."""
    head = ["Δγ, mJ/m²", "pull-off, Pa: separation", "load", "last contact at, Pa: separation", "load"]
    rows = []
    for slope, material, one in _cells(_adhesive(load)):
        one = one.isel(seed=0)
        other = _asperity_runs(separation, slope).sel(material=material, seed=int(one["seed"]))
        row = [_energy(one)]
        for name, form in (
            ("pull_off_pressure", "{:.4g}"),
            ("detachment_pressure", "{:.3g}"),
            ("hysteresis_loss_over_surface_energy", "{:.4f}"),
        ):
            row += [form.format(float(each[name])) for each in (other, one)]
        rows.append(row)
    return Table([*head, "loss/Δγ: separation", "load"], rows)


def main() -> None:
    """Write the tables, and copy the figures of the page, from the results of the campaign."""
    campaign = load_configuration(Path("config/campaigns/hysteresis.yaml")).campaign
    results = Path("results/hysteresis")
    dataset = read_campaign(results / "dataset/hysteresis.nc")
    studies = {name: study.to_dataset() for name, study in dataset.children.items()}
    write_tables(
        {
            "hysteresis_summary": summary(studies["slopes"]),
            "hysteresis_largest_loads": largest_loads(
                [studies[name] for name in campaign.figures.fig14_pull_off.load_studies]
            ),
            "hysteresis_load_control": controls(studies["slopes"], studies["load_control"]),
        }
    )
    copy_figures("hysteresis", results)


if __name__ == "__main__":
    main()
