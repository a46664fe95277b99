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

_AREA, _PULL_OFF, _LOSS = "largest_contact_area_fraction", "pull_off_pressure", "hysteresis_loss_over_surface_energy"
_WORDS = {_AREA: "A/A₀", _PULL_OFF: "pull-off, Pa", _LOSS: "loss/Δγ"}
_FORMS = {_AREA: "{:.3g}", _PULL_OFF: "{:.3g}", _LOSS: "{:.4f}"}


def _adhesive_runs(study):
    """Yield rms slope, energy in mJ/m^2, and the runs with both, of the asperity model on the first surface."""
    runs = study.sel(model=DEFAULT_MODEL).isel(surface=0)
    for slope in study["rms_slope"].values:
        for material in study["material"].values[study["surface_energy"].values > 0]:
            one = runs.sel(rms_slope=slope, material=material)
            yield float(slope), f"{1e3 * float(one['surface_energy']):g}", one


def _mean(values, form):
    """Format mean ± standard deviation over the seeds."""
    return means(np.atleast_1d(values)[:, None], form)[0]


def summary(study: xr.Dataset) -> Table:
    """Table of pull-off and loss for each slope and surface energy."""
    head = ["h′rms", "Δγ, mJ/m²", "stickiness", "A/A₀", "pull-off, Pa", "over all summits", "loss/Δγ"]
    rows = []
    for slope, energy, one in _adhesive_runs(study):
        values = {_AREA: "{:.3g}", _PULL_OFF: "{:.3g}", "pull_off_over_summits": "{:.4f}", _LOSS: "{:.4f}"}
        cells = [_mean(one[name].values, form) for name, form in values.items()]
        ratio = _mean(one["loss_by_jump_in"].values / one["loss_by_jump_off"].values, "{:.1f}")
        rows.append([f"{slope:g}", energy, f"{float(one['stickiness'].mean()):.2g}", *cells, ratio])
    return Table([*head, "jump-in : jump-off"], rows)


def largest_loads(studies: Sequence[xr.Dataset]) -> Table:
    """Table of pull-off and loss against the largest load, for the first slope and the materials in all studies."""
    slope = min(set.intersection(*(set(study["rms_slope"].values.tolist()) for study in studies)))
    found = [{energy: one for at, energy, one in _adhesive_runs(study) if at == slope} for study in studies]
    found.sort(key=lambda runs: float(next(iter(runs.values()))["largest_reduced_pressure"].mean()))
    rows, loads = [], [float(next(iter(runs.values()))["largest_reduced_pressure"].mean()) for runs in found]
    for energy in (each for each in found[0] if all(each in runs for runs in found)):
        runs = [each[energy] for each in found]
        area, pull, loss = (np.array([float(one[name].mean()) for one in runs]) for name in _WORDS)
        residual = loss - np.polyval(np.polyfit(area, loss, 1), area)
        r2 = 1 - np.sum(residual**2) / np.sum((loss - loss.mean()) ** 2)
        power = f"n = {np.polyfit(np.log(area), np.log(loss), 1)[0]:.2f}" if np.all(loss > 0) else "n –"
        notes = {_AREA: "", _LOSS: f"{power}, r² = {r2:.3f}"}
        notes |= {_PULL_OFF: f"varies by {100 * (pull.max() / pull.min() - 1):.0f} %"}
        for name, note in notes.items():
            rows.append([energy, _WORDS[name], *(_mean(one[name].values, _FORMS[name]) for one in runs), note])
    return Table(["Δγ, mJ/m²", "", *(f"p\\* = {load:.2g}" for load in loads), ""], rows)


def controls(separation: xr.Dataset, load: xr.Dataset) -> Table:
    """Table of the same runs under separation and under load control."""
    head = ["Δγ, mJ/m²", "pull-off, Pa: separation", "load", "last contact at, Pa: separation", "load"]
    forms = {_PULL_OFF: "{:.4g}", "detachment_pressure": "{:.3g}", _LOSS: "{:.4f}"}
    others = {(slope, energy): one for slope, energy, one in _adhesive_runs(separation)}
    rows = []
    for slope, energy, runs in _adhesive_runs(load):
        one = runs.isel(seed=0)
        pair = others[slope, energy].sel(seed=int(one["seed"])), one
        rows.append([energy, *(form.format(float(each[name])) for name, form in forms.items() for each in pair)])
    return Table([*head, "loss/Δγ: separation", "load"], rows)


def models(asperities: xr.Dataset, elements: xr.Dataset) -> Table:
    """Table of area, pull-off and loss of both models, means ± standard deviations over the seeds."""
    rows = []
    for slope, energy, one in _adhesive_runs(asperities):
        if slope not in elements["rms_slope"]:
            continue
        exact = elements.isel(surface=0, model=0).sel(rms_slope=slope, material=one["material"])
        for name, words in (_WORDS | {_AREA: "A/A₀ at the largest load"}).items():
            both = [each[name].values for each in (exact, one)]
            error = 100 * (both[1].mean() / both[0].mean() - 1)
            rows.append([f"{slope:g}", energy, words, *(_mean(each, _FORMS[name]) for each in both), f"{error:+.0f}"])
    return Table(["h′rms", "Δγ, mJ/m²", "", "boundary elements", "asperities", "asperities, %"], rows)


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
            "hysteresis_models": models(studies["slopes"], studies["truth"]),
            "hysteresis_load_control": controls(studies["slopes"], studies["load_control"]),
        }
    )
    copy_figures("hysteresis", results)


if __name__ == "__main__":
    main()
