"""Tables of docs/validation.md: error of the asperity model, from the results of campaign validation.

Run the campaign first; then: python -m validation.model_error
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import compress, product
from pathlib import Path

import numpy as np
import xarray as xr

from icha.contact.models import MODELS
from icha.datasets.campaign import run_labels, select_run
from icha.datasets.files import read_campaign
from validation.tables import Table, copy_figures, means, pressures, write_tables

_DISTANCES = {
    "pressure_distribution_distance": "P(p)",
    "gap_distribution_distance": "P(u)",
    "jaccard": "maps in common",
}


def select_adhesion(errors: xr.Dataset, adhesive: bool) -> xr.Dataset:
    """Return the materials of a study with surface energy, or those without."""
    return errors.isel(material=np.flatnonzero((errors["surface_energy"].values > 0) == adhesive))


def summary(entries: Mapping[str, xr.Dataset]) -> Table:
    """Table of the median and range, over all states of each study, of the mean errors over the seeds."""

    def over_all(errors, name):
        values = 100 * errors[name].mean("seed").values
        values = values[np.isfinite(values)]
        low, middle, high = values.min(), np.median(values), values.max()
        return f"{middle:+.1f} ({low:+.1f} to {high:+.1f})"

    rows = []
    for words, errors in entries.items():
        pressure = errors["reduced_pressure"].values
        states = f"{errors['area_error'].size} of {errors.sizes['surface']} surfaces"
        area, energetic, separation = (
            over_all(errors, name) for name in ("area_error", "energetic_area_error", "separation_error")
        )
        # Without a range of attraction both areas are equal.
        cells = [area, "–" if energetic == area else energetic, separation]
        rows.append([words, states, f"{pressure.min():g} to {pressure.max():g}", *cells])
    head = ["", "states", "p\\*", "contact area, %", "against the energetic area, %", "mean separation, %"]
    return Table(head, rows)


def _lines(errors: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield a label and the errors of every surface, slope and material of a study."""
    for surface, slope, material in product(*(errors[name].values for name in ("surface", "rms_slope", "material"))):
        words = [f"`{surface}`", f"slope {slope:g}", f"`{material}`"]
        many = True, errors.sizes["rms_slope"] > 1, errors.sizes["material"] > 1
        yield ", ".join(compress(words, many)), errors.sel(surface=surface, rms_slope=slope, material=material)


def by_load(short_range: xr.Dataset, quantities: Mapping[str, str], form: str, unit: float = 1.0) -> Table:
    """Table of means over the seeds without and with adhesion: a row for each surface and quantity, a column per load.

    `quantities` are words by name; without words, the table has no column for them.
    """
    several, rows = any(quantities.values()), []
    for adhesion in (False, True):
        for words, own in _lines(select_adhesion(short_range, adhesion)):
            for k, (name, what) in enumerate(quantities.items()):
                first = ["with" if adhesion else "without", "" if k else words, *([what] if several else [])]
                values = unit * own[name].transpose("seed", "reduced_pressure").values
                rows.append([*first, *means(values, form)])
    head = ["adhesion", "surface", *([""] if several else [])]
    return Table([*head, *pressures(short_range["reduced_pressure"].values)], rows)


def range_and_limit(short_range: xr.Dataset, finite_range: xr.Dataset) -> Table:
    """Table of errors of the contact area with adhesion in per cent, at a finite range and in the limit of short range.

    Means over the seeds, at the loads of both studies.
    """
    columns = [p for p in finite_range["reduced_pressure"].values if p in short_range["reduced_pressure"].values]
    rows = []
    for words, other in _lines(finite_range):
        own = short_range.sel({axis: other[axis].values for axis in ("surface", "rms_slope")}).isel(material=0)
        for what, errors, name in (
            ("finite range: area of zero gap", other, "area_error"),
            ("finite range: energetic area", other, "energetic_area_error"),
            ("limit of a short range", own, "area_error"),
        ):
            values = 100 * errors[name].sel(reduced_pressure=columns).transpose("seed", "reduced_pressure").values
            rows.append([words if what.endswith("gap") else "", what, *means(values, "{:+.1f}")])
    return Table(["surface", "", *pressures(columns)], rows)


def effect_of_range(errors: xr.Dataset) -> Table:
    """Table of areas and separations with adhesion over those without, for each range of attraction."""
    bare = select_adhesion(errors, False).isel(material=0)
    rows = []
    for material in select_adhesion(errors, True)["material"].values:
        own = errors.sel(material=material)
        label = f"{1e9 * float(own['interaction_range']):.3g} nm, μ = {float(own['tabor_parameter'].mean()):.2f}"
        area, gap = "contact_area_fraction", "reduced_separation"
        true_area, true_gap = f"{area}_boundary_elements", f"{gap}_boundary_elements"
        for what, values in {
            "A, ICHA": own[area] / bare[area],
            "A, boundary elements, zero gap": own[true_area] / bare[true_area],
            "A, boundary elements, energetic": own["energetic_area_fraction"] / bare[true_area],
            "ū, ICHA": own[gap] / bare[gap],
            "ū, boundary elements": own[true_gap] / bare[true_gap],
        }.items():
            ratio = values.stack(case=("surface", "seed", "rms_slope")).transpose("case", "reduced_pressure").values
            rows.append([label, what, *means(ratio, "{:.3f}")])
            label = ""
    columns = errors["reduced_pressure"].values
    return Table(["range", "with over without adhesion", *pressures(columns)], rows)


def loops_of_both_models(campaign: xr.DataTree, study: str) -> Table:
    """Table of pull-off and loss of the runs of a study, for each model and law of attraction."""
    rows = []
    for labels in (labels for labels in run_labels(campaign) if labels.study == study):
        run = select_run(campaign, labels)
        gamma, loss = float(run["surface_energy"]), float(run["hysteresis_loss"])
        words = [MODELS[labels.model].words, run.attrs["attraction"], f"{int(run['grid'])}²"]
        rows.append(
            [
                ", ".join(filter(None, words)),
                f"{float(run['largest_contact_area_fraction']):.3g}",
                f"{float(run['pull_off_pressure']):.3g}",
                f"{float(run['pull_off_separation']) / float(run['rms_height']):.2f}",
                f"{1e6 * loss:.3g}",
                f"{loss / gamma:.4f}" if gamma else "–",
            ]
        )
    return Table(["", "A/A₀ at the largest load", "pull-off, Pa", "at ū/h_rms", "loss, µJ/m²", "loss/Δγ"], rows)


def tables(entries: Mapping[str, xr.Dataset], campaign: xr.DataTree) -> dict[str, Table]:
    """Return all tables of the page.

    Parameters
    ----------
    entries : errors of the model by study (`icha.analysis.model_error`).
    campaign : the campaign dataset; its study `small` unloads.
    """
    bare, adhesive = (select_adhesion(entries["short_range"], energy) for energy in (False, True))
    covered = {
        "without adhesion": bare,
        "with adhesion": adhesive,
        "range of 40 nm, with adhesion": entries["finite_range"],
    }
    found = {
        "summary": summary(covered),
        "area": by_load(entries["short_range"], {"area_error": ""}, "{:+.1f}", 100),
        "separation": by_load(entries["short_range"], {"separation_error": ""}, "{:+.1f}", 100),
        "distributions": by_load(entries["short_range"], _DISTANCES, "{:.3f}"),
        "range_and_limit": range_and_limit(adhesive, entries["finite_range"]),
        "ranges": effect_of_range(entries["ranges"]),
        "both_ways": loops_of_both_models(campaign, "small"),
    }
    return {f"validation_{name}": table for name, table in found.items()}


def main() -> None:
    """Write the tables, and copy the figures of the page, from the results of the campaign."""
    results = Path("results/validation")
    errors = read_campaign(results / "aggregated/model_error.nc")
    entries = {name: node.to_dataset() for name, node in errors.children.items()}
    write_tables(tables(entries, read_campaign(results / "dataset/validation.nc")))
    copy_figures("validation", results)


if __name__ == "__main__":
    main()
