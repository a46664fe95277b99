"""Tables of docs/validation.md: error of the asperity model, from the results of campaign validation.

Run the campaign first; then: python -m validation.model_error
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from icha.analysis.model_error import difference_of_contacts
from icha.configuration.cases import loop_cases
from icha.configuration.load import load_configuration
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.campaign import run_labels, select_run
from icha.datasets.files import read_campaign, read_dataset
from validation.tables import Table, copy_figures, means, pressures, write_tables

# Entries with boundary elements on other grids, and their cells per cell of the grid of the surface.
_GRIDS = {"adhesionless": "2 cells", "coarse": "1 cell", "fine": "4 cells"}


def select_adhesion(errors: xr.Dataset, adhesive: bool) -> xr.Dataset:
    """Return the materials of an entry with surface energy, or those without."""
    return errors.isel(material=np.flatnonzero((errors["surface_energy"].values > 0) == adhesive))


def summary(entries: Mapping[str, xr.Dataset]) -> Table:
    """Table of the median and range, over all states of each entry, of the mean errors over the seeds."""

    def over_all(errors, name):
        values = 100 * errors[f"{name}_mean"].values
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
    """Yield a label and the errors of every surface, slope and material of an entry."""
    for surface in errors["surface"].values:
        for slope in errors["rms_slope"].values:
            for material in errors["material"].values:
                own = errors.sel(surface=surface, rms_slope=slope, material=material)
                words = [f"`{surface}`"]
                if errors.sizes["rms_slope"] > 1:
                    words.append(f"slope {slope:g}")
                if errors.sizes["material"] > 1:
                    words.append(f"`{material}`")
                yield ", ".join(words), own


def errors_by_load(errors: xr.Dataset, name: str) -> Table:
    """Table of an error of one entry in per cent, a row for each surface and a column for each load."""
    rows = [
        [words, *means(100 * own[name].transpose("seed", "reduced_pressure").values, "{:+.1f}")]
        for words, own in _lines(errors)
    ]
    return Table(["surface", *pressures(errors["reduced_pressure"].values)], rows)


def distances(errors: xr.Dataset) -> Table:
    """Table of the distances of the distributions P(p) and P(u) and the overlap of the contact maps."""
    quantities = {
        "pressure_distribution_distance": "P(p)",
        "gap_distribution_distance": "P(u)",
        "jaccard": "maps in common",
    }
    rows = []
    for words, own in _lines(errors):
        for name, what in quantities.items():
            rows.append([words, what, *means(own[name].transpose("seed", "reduced_pressure").values, "{:.3f}")])
            words = ""
    return Table(["surface", "", *pressures(errors["reduced_pressure"].values)], rows)


def short_range_over_tamaas(short_range: xr.Dataset, finite_range: xr.Dataset) -> Table:
    """Table of the difference in per cent between boundary elements in the limit of short range and Tamaas's.

    Both are without adhesion on the same surfaces, at the loads of the second entry.
    """
    rows = []
    for words, other in _lines(finite_range):
        at = {axis: other[axis].values for axis in ("surface", "seed", "rms_slope", "reduced_pressure")}
        own = short_range.isel(material=0).sel(at)
        for name, what in (("contact_area_fraction", "area"), ("reduced_separation", "mean gap")):
            ratio = own[f"{name}_boundary_elements"] / other[f"{name}_boundary_elements"]
            values = 100 * (ratio.transpose("seed", "reduced_pressure").values - 1)
            rows.append([words if what == "area" else "", what, *means(values, "{:+.2f}")])
    return Table(["surface", "%", *pressures(finite_range["reduced_pressure"].values)], rows)


def bounds_and_limit(short_range: xr.Dataset, finite_range: xr.Dataset) -> Table:
    """Table of errors of the contact area with adhesion in per cent, at a finite range and in the limit of short range.

    Means over the seeds, at the loads of both entries.
    """
    columns = [p for p in finite_range["reduced_pressure"].values if p in short_range["reduced_pressure"].values]
    rows = []
    for words, other in _lines(finite_range):
        own = short_range.sel({axis: other[axis].values for axis in ("surface", "rms_slope")}).isel(material=0)
        for what, errors, name in (
            ("bound: area of zero gap", other, "area_error"),
            ("bound: energetic area", other, "energetic_area_error"),
            ("known: short range", own, "area_error"),
        ):
            values = 100 * errors[name].sel(reduced_pressure=columns).transpose("seed", "reduced_pressure").values
            rows.append([words if what.endswith("gap") else "", what, *means(values, "{:+.1f}")])
    return Table(["surface", "", *pressures(columns)], rows)


def other_grids(entries: Mapping[str, xr.Dataset]) -> Table:
    """Table of area and mean gap of boundary elements on other grids, relative to the first of `_GRIDS`."""
    (reference, own), *others = _GRIDS.items()
    rows = []
    for entry, words in others:
        other = entries[entry]
        at = {axis: other[axis].values for axis in ("surface", "seed", "rms_slope", "material", "reduced_pressure")}
        same = entries[reference].sel(at)
        for name, what in (("contact_area_fraction", "area"), ("reduced_separation", "mean gap")):
            ratio = other[f"{name}_boundary_elements"] / same[f"{name}_boundary_elements"]
            ratio = ratio.stack(case=("surface", "seed", "rms_slope", "material"))
            values = 100 * (ratio.transpose("case", "reduced_pressure").values - 1)
            rows.append([f"{words} instead of {own}: {what}, %", *means(values, "{:+.2f}")])
    return Table(["", *pressures(entries[others[0][0]]["reduced_pressure"].values)], rows)


def effect_of_range(entries: Mapping[str, xr.Dataset], reference: str, varied: Sequence[str]) -> Table:
    """Table of areas and separations with adhesion over those without, for each range of attraction."""
    bare = entries[reference].isel(material=0)
    rows = []
    for errors in (entries[entry] for entry in varied):
        same = bare.sel({axis: errors[axis].values for axis in ("surface", "seed", "rms_slope", "reduced_pressure")})
        for material in errors["material"].values:
            own = errors.sel(material=material)
            seeds = own.sizes["seed"]
            label = f"{1e9 * float(own['interaction_range']):.3g} nm, μ = {float(own['tabor_parameter'].mean()):.2f}, "
            label += f"{seeds} seed{'s' if seeds > 1 else ''}"
            area, gap = "contact_area_fraction", "reduced_separation"
            true_area, true_gap = f"{area}_boundary_elements", f"{gap}_boundary_elements"
            for what, values in {
                "A, ICHA": own[area] / same[area],
                "A, boundary elements, zero gap": own[true_area] / same[true_area],
                "A, boundary elements, energetic": own["energetic_area_fraction"] / same[true_area],
                "ū, ICHA": own[gap] / same[gap],
                "ū, boundary elements": own[true_gap] / same[true_gap],
            }.items():
                ratio = values.stack(case=("surface", "seed", "rms_slope")).transpose("case", "reduced_pressure").values
                rows.append([label, what, *means(ratio, "{:.3f}")])
                label = ""
    columns = entries[varied[0]]["reduced_pressure"].values
    return Table(["range", "with over without adhesion", *pressures(columns)], rows)


def loops_of_all_models(campaign: xr.DataTree, study: str, loops: Sequence[xr.Dataset]) -> Table:
    """Table of pull-off and loss with boundary elements at a finite range and with both models of the same contact."""
    rows = []
    runs = {labels: select_run(campaign, labels) for labels in run_labels(campaign) if labels.study == study}
    for solved in loops:
        labels = next(labels for labels, run in runs.items() if not difference_of_contacts(run, solved))
        gamma = float(solved["surface_energy"])
        for name, one in (
            ("boundary elements, finite range", solved),
            ("boundary elements, short range", runs[labels._replace(model=REFERENCE_MODEL)]),
            ("asperities", runs[labels._replace(model=DEFAULT_MODEL)]),
        ):
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
    return Table(["", "A/A₀ at the largest load", "pull-off, Pa", "at ū/h_rms", "loss, µJ/m²", "loss/Δγ"], rows)


def tables(
    entries: Mapping[str, xr.Dataset], campaign: xr.DataTree, study: str, loops: Sequence[xr.Dataset]
) -> dict[str, Table]:
    """Return all tables of the page.

    Parameters
    ----------
    entries : errors of the model by entry (`icha.analysis.model_error`); `short_range` is the limit of short range.
    campaign : the campaign dataset.
    study, loops : the study that unloads, and loops of boundary elements at a finite range.
    """
    bare, adhesive = (select_adhesion(entries["short_range"], energy) for energy in (False, True))
    covered = {
        "without adhesion": bare,
        "with adhesion": adhesive,
        "finite range, without adhesion": entries["adhesionless"],
        "finite range, with adhesion": entries["adhesive"],
    }
    found = {
        "summary": summary(covered),
        "area_bare": errors_by_load(bare, "area_error"),
        "separation_bare": errors_by_load(bare, "separation_error"),
        "area_adhesive": errors_by_load(adhesive, "area_error"),
        "separation_adhesive": errors_by_load(adhesive, "separation_error"),
        "distributions_bare": distances(bare),
        "distributions_adhesive": distances(adhesive),
        "bounds_and_limit": bounds_and_limit(adhesive, entries["adhesive"]),
        "short_range_over_tamaas": short_range_over_tamaas(bare, entries["adhesionless"]),
        "other_grids": other_grids(entries),
        "ranges": effect_of_range(entries, "adhesionless", ["ranges", "shortest_range"]),
        "both_ways": loops_of_all_models(campaign, study, loops),
    }
    return {f"validation_{name}": table for name, table in found.items()}


def main() -> None:
    """Write the tables, and copy the figures of the page, from the results of the campaign."""
    campaign = load_configuration(Path("config/campaigns/validation.yaml")).campaign
    results = Path("results/validation")
    errors = read_campaign(results / "aggregated/model_error.nc")
    ((entry, section),) = campaign.boundary_element_loops.items()
    cases = [case for case in loop_cases(campaign) if case.entry == entry]
    loops = [read_dataset(results / f"references/loops/{case.path}.nc") for case in cases]
    dataset = read_campaign(results / "dataset/validation.nc")
    entries = {name: one.to_dataset() for name, one in errors.children.items()}
    write_tables(tables(entries, dataset, section.study, loops))
    copy_figures("validation", results)


if __name__ == "__main__":
    main()
