"""State the validity of the models for a computed campaign, and the error of the asperity model that it measured."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np
import xarray as xr

from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.attributes import reasons_not_applicable
from icha.datasets.campaign import loading_stops
from icha.datasets.labels import LABELS, is_derived_study
from icha.datasets.variables.campaign import COMPLETE, COMPUTED_RUNS, NOT_IN_DESIGN
from icha.planning import statements as stated
from icha.support.formatting import format_count, join_first
from icha.surfaces.resolution import RADIUS, Resolution
from icha.uncertainty.grid_error import cells_of_loops, error_of_area, nodes_of
from icha.uncertainty.left_out import NOT_COMPARED, NOT_REQUESTED, find_left_out

_QUANTITIES = {"area_error": "contact area", "separation_error": "mean separation"}
# Variables of a run that are facts of a `Case`, and those from which further facts follow.
_FACTS = (*stated.VALIDATED, stated.COMPLETE_PRESSURE, stated.STRENGTH, stated.THEORETICAL, stated.RESOLVED)
_FACTS += (stated.TABOR,)
_SOURCES = ("status", "period", "grid", "asperity_count", "unsupported_summit_count", "boundary", "surface_energy")
_SOURCES += ("short_wavelength", "short_wavelength_estimated", "shape")
# Statements name contacts with more than this fraction of single-asperity spots outside the range of Wu's formula.
_FEW = 0.05


def statements_on_results(campaign: xr.DataTree, model_error: xr.DataTree | None) -> list[stated.Statement]:
    """Return statements on the validity of the models, with the measured errors of the asperity model first.

    If all studies with the asperity model have a measured error, the statement on the accuracy on other surfaces is
    left out. `model_error` is None if no study has both models.
    """
    measured = {} if model_error is None else measured_errors(model_error)
    with_asperities = {name for name, node in campaign.children.items() if DEFAULT_MODEL in node["model"].values}
    found = statements_on_dataset(campaign)
    if with_asperities <= measured.keys():
        found = [each for each in found if each.about != "accuracy"]
    return [*measured.values(), *found]


def measured_errors(model_error: xr.DataTree) -> dict[str, stated.Statement]:
    """Return a statement for each study in the dataset `model_error`, by name of the study."""
    found = {}
    for name, node in model_error.children.items():
        errors = node.to_dataset()
        if not np.isfinite(errors["area_error"]).any():
            continue
        known = np.isfinite(errors["area_error"])
        good = known & (errors["applicability"] == "")
        shown = good if good.any() else known
        ranges = ", ".join(
            f"{words} {_range(errors[variable].where(shown).values)}" for variable, words in _QUANTITIES.items()
        )
        seeds = int(shown.any([dim for dim in known.dims if dim != "seed"]).sum())
        among = f"{format_count(seeds, 'seed')}, {format_count(errors.sizes['reduced_pressure'], 'load')}"
        if others := int((known & ~good).any("reduced_pressure").sum()):
            among += f"; without {format_count(others, 'run')}" if good.any() else "; all in runs"
            among += " to which the model is not applicable"
        status = errors["status"].values.ravel()
        causes = np.select([status == NOT_IN_DESIGN, status != COMPLETE], [NOT_REQUESTED, NOT_COMPARED], "")
        among += f"; {words}" if (words := find_left_out("pairs of runs", causes).sentence) else ""
        found[name] = stated.Statement(
            "error", f"of the asperity model in study {name}: {ranges} ({among}, boundary elements)"
        )
    return found


def _range(values: np.ndarray) -> str:
    """Return the range of relative errors in per cent, such as `11 to 18 % too small`."""
    low, high = 100 * np.nanmin(values), 100 * np.nanmax(values)
    if high <= 0:
        return f"{-high:.0f} to {-low:.0f} % too small"
    if low >= 0:
        return f"{low:.0f} to {high:.0f} % too large"
    return f"from {-low:.0f} % too small to {high:.0f} % too large"


def statements_on_dataset(campaign: xr.DataTree) -> list[stated.Statement]:
    """Return statements on the validity of the models for a campaign dataset, including runs that ended early.

    If the dataset is open and not loaded, only a few variables are read from the file.
    """
    models, cases, shares, sticky = {}, [], {}, {}
    for name, node in campaign.children.items():
        if is_derived_study(name, campaign.children):
            continue  # runs for an answer, of which no user asked
        study = node.to_dataset()
        models[name] = [str(model) for model in study["model"].values]
        cases += _cases(study)
        if DEFAULT_MODEL in models[name]:
            for (surface, material), share in _shares_outside(study).items():
                shares[surface, material] = max(share, shares.get((surface, material), 0.0))
                found = study["stickiness"].sel(surface=surface, material=material)
                sticky[surface, material] = max(float(found.max()), sticky.get((surface, material), 0.0))
    outside = _describe_shares(shares) if shares else None
    found = stated.statements(models, cases, outside, stated.describe_sticky(sticky), cells_of_loops(campaign, models))
    found += [*_lightest_state(campaign, models), *stated.describe_layers(_radii_on_layers(campaign))]
    return [*found, *_not_applicable(campaign)]


def _cases(study) -> Iterator[stated.Case]:
    """Yield a `Case` for every computed run of a study."""
    runs = study[[name for name in (*_FACTS, *_SOURCES) if name in study]].broadcast_like(study["status"])
    if "shape" in study:
        runs["contact_radius"] = _smallest_radii(study)
    runs = runs[[*runs.data_vars, *LABELS]].stack(run=LABELS, create_index=False)
    columns = {name: values.values.tolist() for name, values in runs.variables.items() if values.dims == ("run",)}
    for row in (dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)):
        if row["status"] not in COMPUTED_RUNS:
            continue
        facts = {name: float(row[name]) for name in _FACTS if name in row}
        facts[stated.SPACING] = row["period"] / row["grid"]
        if not row["surface_energy"]:
            facts.pop(stated.TABOR, None)
        estimated = bool(row["short_wavelength_estimated"])
        resolution = Resolution(row["short_wavelength"] / facts[stated.SPACING], estimated=estimated)
        facts["nodes_per_short_wave"] = resolution.cells
        if "contact_radius" in row and not row["rms_slope"]:
            resolution = min(resolution, Resolution(row["contact_radius"] / facts[stated.SPACING], RADIUS))
        unsupported = row["unsupported_summit_count"]
        facts["unsupported_summits"] = unsupported / max(row["asperity_count"] + unsupported, 1)
        facts[stated.SHAPED] = float(bool(row.get("shape")))
        facts["free_edges"] = float(row["boundary"] != "periodic")
        yield stated.Case(row["model"], row["surface"], row["material"], facts, resolution)


def _smallest_radii(study):
    """Return the smallest contact radius of each run at a target of the first loading, m; infinite without contact."""
    area = study["contact_area_fraction"].where(loading_stops(study) & (study["contact_area_fraction"] > 0))
    return (study["period"] * np.sqrt(area.min("step") / np.pi)).fillna(np.inf)


def _describe_shares(shares):
    """Describe surfaces and materials with many single-asperity spots outside Wu's range, largest fraction first."""
    cases = [
        f"{material} on {surface} ({100 * share:.0f} % of single spots)"
        for (surface, material), share in sorted(shares.items(), key=lambda item: -item[1])
        if share > _FEW
    ]
    return f"outside this range: {join_first(cases)}" if cases else ""


def _shares_outside(study):
    """Return the fraction of single-asperity spots outside the range of Wu's formula, by surface and material.

    The fraction is the largest value of all seeds and slopes, at the end of the first loading.
    Materials without adhesion are left out, because their spots do not jump into contact.
    """
    runs = study[["status", "leg", "outside_wu_fraction", "surface_energy"]].sel(model=DEFAULT_MODEL).load()
    end = (runs["leg"] == 0).sum("step") - 1
    counted = runs["status"].isin(COMPUTED_RUNS) & (end >= 0) & (runs["surface_energy"] > 0)
    shares = runs["outside_wu_fraction"].isel(step=end.clip(min=0)).where(counted).max(("seed", "rms_slope"))
    return shares.transpose("surface", "material").to_series().dropna().to_dict()


def _lightest_state(campaign: xr.DataTree, studies: Iterable[str]) -> Iterator[stated.Statement]:
    """Yield the statement on the error of the area with the fewest cells, at targets of boundary elements.

    Only targets of the first loading count.
    """
    least, text = math.inf, ""
    for study in (campaign[name].to_dataset() for name in studies):
        if REFERENCE_MODEL not in study["model"].values:
            continue
        runs = study.sel(model=REFERENCE_MODEL)
        cells = (runs["contact_area_fraction"] * nodes_of(runs)).where(loading_stops(runs) & (runs["spot_count"] > 0))
        if cells.min() < least:
            least, at = float(cells.min()), cells.argmin(cells.dims)
            names = " on ".join(str(runs[label].isel({label: at[label]}).item()) for label in ("material", "surface"))
            patches = float(runs["spot_count"].transpose(*cells.dims).isel(at))
            text = f"{error_of_area(patches, least)[1]} ({names}, at the smallest load)"
    if text:
        yield stated.Statement("grid", text)


def _radii_on_layers(campaign):
    """Return the largest contact radius of shapes on layers, over the thickness, by names of material and surface."""
    shares = {}
    for node in campaign.children.values():
        if "layer_thickness" in node and "shape" in node:
            study = node.to_dataset()[["contact_radius", "layer_thickness"]].load()
            share = study["contact_radius"] / study["layer_thickness"]
            share = share.max([name for name in share.dims if name not in ("surface", "material")])
            share = share.where(share > 0).transpose("surface", "material")
            for (surface, material), value in share.to_series().dropna().items():
                name = f"{material} on {surface}"
                shares[name] = max(value, shares.get(name, 0.0))
    return shares


def _not_applicable(campaign) -> Iterator[stated.Statement]:
    """Yield the statement on the runs for which the asperity model is not applicable."""
    reasons = sum(map(reasons_not_applicable, campaign.children.values()), Counter())
    if reasons:
        text = f"a model is not applicable to {format_count(reasons.total(), 'run')}: {join_first(reasons, '. ')}"
        yield stated.Statement("applicability", text, False)
