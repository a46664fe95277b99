"""The page of the documentation on how far the model is from boundary elements."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from pages.tables import means, pressures, table

_TITLE = """# How far the model is from boundary elements

The same topographies are pressed to the same loads by ICHA and by boundary elements (Tamaas, Polonsky & Keer's
conjugate gradients on a refined grid). Errors are ICHA over boundary elements, less one. The area of the boundary
elements is corrected by the perimeter of the contact (Yastrebov, Anciaux & Molinari, Tribol. Int. 114 (2017) 161-171).
Tables have the mean and the standard deviation over the seeds.

With adhesion the traction of the boundary elements decays as exp(−u/ρ) over a range ρ that their grid resolves, and
ICHA jumps into contact at Wu's distance for the same ρ. Such ranges are long: contact is far from the limit of Johnson,
Kendall and Roberts that ICHA's spots obey, and boundary elements that are loaded and unloaded along one path show no
hysteresis (a test of the suite). They bound what adhesion does; they do not prove that limit. Two areas stand for
contact there: that of zero gap, and the energetic area, which is the energy of adhesion over that of full contact. It
is the area that the law of Johnson, Kendall and Roberts means, and tends to it sooner as the range vanishes.
"""

_DISTANCES = """## Distributions and maps

First Wasserstein distances between the distributions over the nominal area: of the contact pressure, in units of the
nominal pressure, and of the gap, in units of the rms height; and of the contact maps the area in contact in both over
the area in contact in either (1: the same contact).
"""

_OWN = """## How exact the boundary elements are

Their area and mean gap with other grids over those of the table above, on one surface; *cells* are those of their grid
per cell of the surface's. The mean gap is exact. What the grid leaves open in the area is larger where contacts are few
nodes wide: at light loads, and where a shortest wave has fewer nodes than the sixteen that it has here.
"""

_RANGES = """## Whether the range of attraction matters

ICHA's area and mean separation hardly depend on the range at a given surface energy: it decides only when contact
forms. To boundary elements it does matter at ranges as long as these: the longer, the less contact of zero gap adhesion
adds, and the more energetic area. Here are the same surfaces at the same loads for several ranges, over the same
without adhesion.
"""


def page(
    model_error: xr.DataTree,
    *,
    entries: Mapping[str, str],
    grids: Mapping[str, str],
    ranges: Mapping[str, list[str]],
    figures: Mapping[str, str],
    command: str,
    further: str = "",
) -> str:
    """The page, in Markdown.

    Parameters
    ----------
    model_error : `icha.analysis.model_error.model_error` of the campaign.
    entries : headings of the entries whose errors are told.
    grids : of these, the entry that is compared with its likes on other grids: its name, and names of the others
        with the words for them.
    ranges : entries in which the range varies, under the name of the entry of the same surfaces without adhesion.
    figures : paths, relative to the page, and what they show.
    command : by which the page is written again.
    further : sections to stand before the last one.
    """
    names = list(entries)
    parts = [
        _TITLE,
        f"Every number on this page is computed, and the page written, by `{command}`.\n",
        *(_summary(model_error[name].to_dataset(), heading) for name, heading in entries.items()),
        *(f"![{what}]({path})\n\n*{what}.*\n" for path, what in figures.items()),
        "## Contact area and mean separation at given load\n",
    ]
    for name in names:
        parts.append(_errors(model_error[name].to_dataset(), entries[name]))
    parts.append(_DISTANCES)
    for name in names:
        parts.append(f"{entries[name]}:\n")
        parts.append(distances(model_error[name].to_dataset()))
    parts += [_OWN, own_error(model_error, grids)]
    for reference, varied in ranges.items():
        parts += [_RANGES, effect_of_range(model_error, reference, varied)]
    return "\n".join([*parts, further]).rstrip() + "\n"


def _summary(errors, heading):
    def range_of(name):
        values = 100 * errors[f"{name}_mean"].values
        low, middle, high = values.min(), np.median(values), values.max()
        return f"{middle:+.1f} % ({low:+.1f} to {high:+.1f} %)"

    surfaces, states = errors.sizes["surface"], errors["area_error"].size
    pressure = errors["reduced_pressure"].values
    tabor = errors["tabor_parameter"].values
    regime = f", Tabor parameters from {tabor.min():.2f} to {tabor.max():.2f}" if _adhesive(errors) else ""
    energetic = f", against the energetic area {range_of('energetic_area_error')}" if _adhesive(errors) else ""
    return (
        f"**{heading}**: {states} states of {surfaces} surfaces, p\\* from {pressure.min():g} to "
        f"{pressure.max():g}{regime}. "
        f"Median and range of the means over the seeds: contact area {range_of('area_error')}{energetic}; mean "
        f"separation {range_of('separation_error')}.\n"
    )


def _adhesive(errors):
    return bool((errors["surface_energy"] > 0).any())


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


def _percent(own, name):
    return means(100 * own[name].transpose("seed", "reduced_pressure").values, "{:+.1f}")


def _errors(errors, heading):
    kinds = [("area_error", "contact area"), ("separation_error", "mean separation")]
    if _adhesive(errors):
        kinds.insert(1, ("energetic_area_error", "energetic area"))
    return "\n".join(
        f"{heading}, error of the {what} in per cent:\n\n{error_table(errors, name)}" for name, what in kinds
    )


def error_table(errors: xr.Dataset, name: str) -> str:
    """Table of an error of one entry in per cent, a row for every surface, a column for every load."""
    rows = [[words, *_percent(own, name)] for words, own in _lines(errors)]
    return table(["surface", *pressures(errors["reduced_pressure"].values)], rows)


def distances(errors: xr.Dataset) -> str:
    """Table of the distances of the distributions and the overlap of the maps: P(p), P(u), overlap in every cell."""
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
    return table(["surface", "", *pressures(errors["reduced_pressure"].values)], rows)


def own_error(model_error: xr.DataTree, grids: Mapping[str, str]) -> str:
    """Table of the area and the mean gap of boundary elements on other grids over those of the first entry named."""
    (reference, own), *others = grids.items()
    truth = model_error[reference].to_dataset()
    rows = []
    for entry, words in others:
        other = model_error[entry].to_dataset()
        at = {axis: other[axis].values for axis in ("surface", "seed", "rms_slope", "material", "reduced_pressure")}
        same = truth.sel(at)
        for name, what in (("contact_area_fraction", "area"), ("reduced_separation", "mean gap")):
            ratio = (other[f"{name}_boundary_elements"] / same[f"{name}_boundary_elements"]).stack(
                case=("surface", "seed", "rms_slope", "material")
            )
            values = 100 * (ratio.transpose("case", "reduced_pressure").values - 1)
            rows.append([f"{words} instead of {own}: {what}, %", *means(values, "{:+.2f}")])
    columns = model_error[others[0][0]]["reduced_pressure"].values
    return table(["", *pressures(columns)], rows)


def effect_of_range(model_error: xr.DataTree, reference: str, varied: list[str]) -> str:
    """Table of areas and separations with adhesion over those without, for every range of attraction."""
    bare = model_error[reference].to_dataset().isel(material=0)
    rows, columns = [], None
    for entry in varied:
        errors = model_error[entry].to_dataset()
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
    return table(["range", "with over without adhesion", *pressures(columns)], rows)
