"""Numbers of the page on how far the model is from boundary elements.

They are computed from the entries of `icha.analysis.model_error.model_error` of a campaign.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from icha.analysis.model_error import run_of_same_contact
from icha.contact.models import ASPERITIES, BOUNDARY_ELEMENTS
from icha.datasets.campaign import run_labels, select_run
from pages.tables import Table, means, pressures


def of_energy(errors: xr.Dataset, adhesive: bool) -> xr.Dataset:
    """The part of an entry with materials that have surface energy, or that have none."""
    return errors.isel(material=np.flatnonzero((errors["surface_energy"].values > 0) == adhesive))


def summary(errors: xr.Dataset) -> dict:
    """What an entry covers, and the median and the range of its errors' means over the seeds."""

    def over_all(name):
        values = 100 * errors[f"{name}_mean"].values
        values = values[np.isfinite(values)]
        low, middle, high = values.min(), np.median(values), values.max()
        return f"{middle:+.1f} % ({low:+.1f} to {high:+.1f} %)"

    pressure, tabor = errors["reduced_pressure"].values, errors["tabor_parameter"].values
    found = {
        "adhesive": bool((errors["surface_energy"] > 0).any()),
        "surfaces": errors.sizes["surface"],
        "states": errors["area_error"].size,
        "least_pressure": f"{pressure.min():g}",
        "most_pressure": f"{pressure.max():g}",
        "area": over_all("area_error"),
        "separation": over_all("separation_error"),
        "residual": f"{float(errors['residual'].max()):.1e}",
    }
    if found["adhesive"]:
        found |= {
            "tabor": f"from {tabor.min():.2f} to {tabor.max():.2f}",
            "energetic_area": over_all("energetic_area_error"),
        }
    return found


def _lines(errors):
    """Every surface, slope and material of an entry, with what tells it apart."""
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


def errors(model_error: xr.Dataset, name: str) -> Table:
    """An error of one entry in per cent, a row for every surface, a column for every load."""
    rows = [
        [words, *means(100 * own[name].transpose("seed", "reduced_pressure").values, "{:+.1f}")]
        for words, own in _lines(model_error)
    ]
    return Table(["surface", *pressures(model_error["reduced_pressure"].values)], rows)


def distances(errors: xr.Dataset) -> Table:
    """Distances of the distributions and the overlap of the maps: P(p), P(u), overlap in every cell."""
    rows = []
    for words, own in _lines(errors):
        columns = [
            means(own[name].transpose("seed", "reduced_pressure").values, "{:.3f}")
            for name in ("pressure_distribution_distance", "gap_distribution_distance", "jaccard")
        ]
        rows += [
            [words if first else "", what, *cells]
            for first, what, cells in zip(
                (True, False, False), ("P(p)", "P(u)", "maps in common"), columns, strict=True
            )
        ]
    return Table(["surface", "", *pressures(errors["reduced_pressure"].values)], rows)


def both_truths(short_range: xr.Dataset, finite_range: xr.Dataset) -> Table:
    """Boundary elements in the limit of a short range over those of Tamaas, without adhesion, in per cent less 100.

    Both entries are of the same surfaces, and of the loads of the first those are shown that the second has.
    """
    columns = finite_range["reduced_pressure"].values
    rows = []
    for words, other in _lines(finite_range):
        at = {axis: other[axis].values for axis in ("surface", "seed", "rms_slope", "reduced_pressure")}
        own = short_range.isel(material=0).sel(at)
        for name, what in (("contact_area_fraction", "area"), ("reduced_separation", "mean gap")):
            ratio = own[f"{name}_boundary_elements"] / other[f"{name}_boundary_elements"]
            values = 100 * (ratio.transpose("seed", "reduced_pressure").values - 1)
            rows.append([words if what == "area" else "", what, *means(values, "{:+.2f}")])
    return Table(["surface", "%", *pressures(columns)], rows)


def known_now(short_range: xr.Dataset, finite_range: xr.Dataset) -> Table:
    """Errors of the contact area with adhesion in per cent: against what bounded it, a finite range, and what is known.

    Means over the seeds, at the loads that both entries have.
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


def own_error(model_error: Mapping[str, xr.Dataset], grids: Mapping[str, str]) -> Table:
    """Area and the mean gap of boundary elements on other grids over those of the first entry named."""
    (reference, own), *others = grids.items()
    truth = model_error[reference]
    rows = []
    for entry, words in others:
        other = model_error[entry]
        at = {axis: other[axis].values for axis in ("surface", "seed", "rms_slope", "material", "reduced_pressure")}
        same = truth.sel(at)
        for name, what in (("contact_area_fraction", "area"), ("reduced_separation", "mean gap")):
            ratio = (other[f"{name}_boundary_elements"] / same[f"{name}_boundary_elements"]).stack(
                case=("surface", "seed", "rms_slope", "material")
            )
            values = 100 * (ratio.transpose("case", "reduced_pressure").values - 1)
            rows.append([f"{words} instead of {own}: {what}, %", *means(values, "{:+.2f}")])
    columns = model_error[others[0][0]]["reduced_pressure"].values
    return Table(["", *pressures(columns)], rows)


def effect_of_range(model_error: Mapping[str, xr.Dataset], reference: str, varied: list[str]) -> Table:
    """Areas and separations with adhesion over those without, for every range of attraction."""
    bare = model_error[reference].isel(material=0)
    rows, columns = [], None
    for entry in varied:
        errors = model_error[entry]
        columns = errors["reduced_pressure"].values if columns is None else columns
        same = bare.sel({axis: errors[axis].values for axis in ("surface", "seed", "rms_slope", "reduced_pressure")})
        for material in errors["material"].values:
            own = errors.sel(material=material)
            label = (
                f"{1e9 * float(own['interaction_range']):.3g} nm, μ = {float(own['tabor_parameter'].mean()):.2f}, "
                f"{own.sizes['seed']} seed{'s' if own.sizes['seed'] > 1 else ''}"
            )
            truth, true_gap = "contact_area_fraction_boundary_elements", "reduced_separation_boundary_elements"
            for what, values in (
                ("A, ICHA", own["contact_area_fraction"] / same["contact_area_fraction"]),
                ("A, boundary elements, zero gap", own[truth] / same[truth]),
                ("A, boundary elements, energetic", own["energetic_area_fraction"] / same[truth]),
                ("ū, ICHA", own["reduced_separation"] / same["reduced_separation"]),
                ("ū, boundary elements", own[true_gap] / same[true_gap]),
            ):
                ratio = values.stack(case=("surface", "seed", "rms_slope")).transpose("case", "reduced_pressure").values
                rows.append([label, what, *means(ratio, "{:.3f}")])
                label = ""
    return Table(["range", "with over without adhesion", *pressures(columns)], rows)


def both_ways(campaign: xr.DataTree, study: str, loops: Sequence[xr.Dataset]) -> Table:
    """Pull-off and loss by boundary elements of a finite range, and by the study's runs of the same contact."""
    head = ["", "A/A₀ at the largest load", "pull-off, Pa", "at ū/h_rms", "loss, µJ/m²", "loss/Δγ"]
    rows = []
    runs = {labels: select_run(campaign, labels) for labels in run_labels(campaign) if labels.study == study}
    for solved in loops:
        labels = run_of_same_contact(runs.items(), solved)
        gamma = float(solved["surface_energy"])
        for name, one in (
            ("boundary elements, finite range", solved),
            ("boundary elements, short range", runs[labels._replace(model=BOUNDARY_ELEMENTS)]),
            ("asperities", runs[labels._replace(model=ASPERITIES)]),
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
    return Table(head, rows)


def tabor_parameters(loops: Sequence[xr.Dataset]) -> str:
    """Tabor parameters of boundary elements both ways."""
    return ", ".join(f"μ = {float(one['tabor_parameter']):.2g}" for one in loops)
