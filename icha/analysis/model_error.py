"""Compute errors of the asperity model with respect to boundary elements on the same topography at the same load.

The reference of a run is the run of the same study with boundary elements.
"""

import itertools
from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd
import xarray as xr
from scipy.stats import wasserstein_distance

from icha.contact.attraction import FINITE_RANGE
from icha.contact.model import GAP_BINS, PRESSURE_BINS
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.attributes import DERIVED, combine_attributes, why_no_result
from icha.datasets.build import bin_values, describe_variables, make_variable
from icha.datasets.campaign import NoSnapshot, find_snapshot, loading_stops, run_place, select_run, spots_of
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.variables.campaign import COMPLETE, INCOMPLETE, NOT_IN_DESIGN, RAGGED, STATUS
from icha.datasets.variables.model_error import ASKED, BINS, MODEL_ERROR
from icha.datasets.variables.terms import MATERIAL, Variable
from icha.equilibrium.distributions import cover_grid
from icha.path.targets import REDUCED_PRESSURE
from icha.uncertainty.ensembles import ensemble

_TITLE = "Error of the model against boundary elements"
_SUMMARY = "Results of the model and of boundary elements for the same topographies, loads and materials."

# Labels of the runs except the model.
_LABELS = tuple(label for label in LABELS if label != "model")
AXES = (*_LABELS, "reduced_pressure")


# Variables that must be equal in a run and its reference, up to the relative difference `_ROUNDING`. An inverted
# surface has another skewness, which is of the order of one. Only runs on layers have the last two.
SHARED = ("period", "rms_height", "height_skewness", "rms_curvature", "contact_modulus", "surface_energy")
SHARED += ("receding_energy", "interaction_range", "flaw_radius", "layer_thickness", "layer_poisson_ratio")
_ROUNDING = 1e-6
# Quantities of which a relative error is taken.
_POSITIVE = ("mean_separation", "contact_area_fraction")
# A cell of a contact map counts as in contact if at least this fraction of the cell is in contact.
_HALF = 0.5

# Variables with a mean and a standard deviation over the seeds.
SUMMARISED = (
    "area_error",
    "energetic_area_error",
    "separation_error",
    "gap_distribution_distance",
    "pressure_distribution_distance",
    "jaccard",
)


def model_error(
    campaign: xr.DataTree, runs: Iterable[tuple[RunLabels | tuple, xr.Dataset]], *, attrs: Mapping[str, str] = {}
) -> xr.DataTree:
    """Compare the runs of the asperity model with boundary elements at each load.

    Parameters
    ----------
    campaign : the campaign dataset.
    runs : labels and dataset of each run with boundary elements, with contact maps. Areas and separations are compared
        at the targets of kind `reduced_pressure` of the first loading. Distributions and contact maps are compared
        where both models have a snapshot.
    attrs : further global attributes.

    Returns
    -------
    DataTree with one group for every study in `runs`. Dimensions are surface, seed, rms_slope, material and the target
    of the reduced pressure. A group has

    - the variables of `icha.datasets.variables.model_error`;
    - for each name in `SUMMARISED`, the mean `<name>_mean` over the seeds; with two seeds or more, also the standard
      deviation `<name>_deviation`;
    - modulus, surface energy, range of attraction and Tabor parameter of the runs;
    - `attraction(surface, seed, rms_slope, material)`, the law of attraction of the boundary elements;
    - `status(surface, seed, rms_slope, material)`, which is complete if both a run and its reference are complete.
      Otherwise the values are missing.

    Raises
    ------
    ValueError
        If a run with boundary elements has no asperity run, or if both differ in topography or material. The message
        names the run.
    """
    origins: dict[str, list[dict[str, str]]] = {}
    studies: dict[str, list[dict]] = {}
    for labels, truth in runs:
        labels = RunLabels(*labels)
        compared = labels._replace(model=DEFAULT_MODEL)
        run, place = select_run(campaign, compared), run_place(campaign[labels.study].dataset, compared)
        try:
            rows = [place | row for row in _compare_stops(run, truth)]
        except ValueError as error:
            raise ValueError(f"{labels}: {error}") from None
        studies.setdefault(labels.study, []).extend(rows)
        origins.setdefault(labels.study, []).extend((run.attrs, truth.attrs))
    groups = {}
    for name, rows in studies.items():
        if rows:
            attributes = combine_attributes(f"{_TITLE}, study {name}", _SUMMARY, DERIVED, origins[name])
            found = _study_dataset(campaign[name].to_dataset(), rows)
            groups[f"/{name}"] = found.assign_attrs(attributes | {"study": name})
    root = combine_attributes(_TITLE, _SUMMARY, DERIVED, itertools.chain(*origins.values()))
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root | dict(attrs))} | groups)


def _compare_stops(run, truth):
    """Yield a row for each load; it has no values of a state that is missing or in full contact."""
    if difference := difference_of_contacts(run, truth):
        raise ValueError(difference)
    failed = why_no_result(run.attrs) or why_no_result(truth.attrs)
    stops, true_stops = _stops(run), _stops(truth)
    for load in dict.fromkeys((*stops, *true_stops)):
        row = {"reduced_pressure": load}
        in_both = not failed and load in stops and load in true_stops
        # In full contact the mean separation is zero, and without contact the area: relative errors are undefined.
        if in_both and all(truth[name].values[true_stops[load]] > 0 for name in _POSITIVE):
            row |= _amounts(run.isel(step=stops[load]), truth.isel(step=true_stops[load]), load)
            snapshots = [snapshot_if_any(each, REDUCED_PRESSURE, load) for each in (run, truth)]
            if None not in snapshots:
                row |= _shapes(run, truth, *snapshots)
        yield row


def _stops(run):
    """Return the index of each step of the first loading at a target of reduced pressure, by value of the target."""
    targets = loading_stops(run) & (run["step_kind"] == REDUCED_PRESSURE)
    return {float(run["step_target"].values[step]): step for step in np.flatnonzero(targets.values).tolist()}


def snapshot_if_any(run: xr.Dataset, kind: str | None, target: float | None) -> int | None:
    """Return the index of the snapshot of a kind and target in a run; None if the run has no such snapshot."""
    try:
        return find_snapshot(run, kind, target)
    except NoSnapshot:
        return None


def _amounts(state, truth, load):
    """Return areas, separations and errors of a state, with residual and grid of the state with boundary elements."""
    area, true_area = (float(each["contact_area_fraction"]) for each in (state, truth))
    separation, true_separation = (float(each["reduced_separation"]) for each in (state, truth))
    # At a short range, attraction acts only in contact, so both areas are equal. At a finite range, attraction also
    # acts outside the area of zero gap. As the range decreases, both areas approach the area of JKR theory. The
    # energetic area is closer to this limit.
    finite = truth.attrs.get("attraction") == FINITE_RANGE
    energetic = float(truth["energetic_area_fraction"]) if finite else true_area
    return {
        "contact_area_fraction": area,
        "contact_area_fraction_boundary_elements": true_area,
        "energetic_area_fraction": energetic,
        "reduced_separation": separation,
        "reduced_separation_boundary_elements": true_separation,
        "area_error": area / true_area - 1,
        "energetic_area_error": area / energetic - 1,
        "separation_error": separation / true_separation - 1,
        "load_error": float(truth["reduced_pressure"]) / load - 1,
        "residual": float(truth["front_residual"]),
        "solution_grid": int(truth["grid"]),
    }


def _shapes(run, truth, snapshot, true_snapshot):
    """Return differences of distributions and contact maps between models, and the densities of boundary elements."""
    state, true_state = state_of(run, snapshot), state_of(truth, true_snapshot)
    contact = true_state["contact_map"].transpose("row", "column").values >= _HALF
    spots = contact_of_spots(run, snapshot, len(contact))
    height, nominal = float(truth["rms_height"]), float(state["nominal_pressure"])
    pressure = float(truth["contact_modulus"]) * float(truth["rms_slope"])
    gaps = true_state["gap_density"].values * height
    # The last bin of boundary elements contains all larger gaps, so it may be wider than the last bin of `GAP_BINS`.
    gaps[-1] *= np.diff(true_state["gap_bin_edges"].values)[-1] / np.diff(GAP_BINS * height)[-1]
    return {
        "gap_distribution_distance": distribution_distance("gap", state, true_state) / height,
        "pressure_distribution_distance": distribution_distance("pressure", state, true_state) / nominal,
        "jaccard": jaccard(spots, contact),
        "shared_of_icha": shared(spots, contact),
        "shared_of_boundary_elements": shared(contact, spots),
        "gap_density": gaps,
        "pressure_density": true_state["pressure_density"].values * pressure,
    }


def difference_of_contacts(run: xr.Dataset, other: xr.Dataset) -> str:
    """Describe the first difference in topography or material between two runs; "" if there is none."""
    for name in (*SHARED, "seed"):
        value, expected = (float(each.get(name, np.nan)) for each in (run, other))
        least = _ROUNDING if name == "height_skewness" else 0
        if not np.isclose(value, expected, rtol=_ROUNDING, atol=least, equal_nan=True):
            units = (run if name in run else other)[name].attrs.get("units", "1")
            return f"{name} is {value:.7g} for the run, {expected:.7g} for the other run (in {units})"
    for name in ("adhesion_map_kind", "shape"):
        text, expected_text = (str(each.get(name, xr.DataArray("")).item()) for each in (run, other))
        if text != expected_text:
            return f"{name} is {text!r} for the run, {expected_text!r} for the other run"
    return ""


def state_of(run: xr.Dataset, snapshot: int) -> xr.Dataset:
    """Return the variables of a run at one snapshot, without spots and events."""
    step = int(run["snapshot_step"].values[snapshot])
    return run.drop_dims(RAGGED, errors="ignore").isel(snapshot=snapshot, step=step)


def contact_of_spots(run: xr.Dataset, snapshot: int, grid: int) -> np.ndarray:
    """Return the contact map of a snapshot, an array along y and x that is True for nodes inside a spot."""
    spots = spots_of(run, snapshot)
    centres = np.column_stack([spots["spot_x"].values, spots["spot_y"].values])
    return cover_grid(float(run["period"]), grid, centres, spots["spot_radius"].values)[1]


def jaccard(one: np.ndarray, other: np.ndarray) -> float:
    """Return the number of nodes in contact in both maps, divided by the number in at least one; 1 without contact."""
    return shared(one | other, one & other)


def shared(one: np.ndarray, other: np.ndarray) -> float:
    """Return the fraction of the contact nodes of `one` that are also in contact in `other`; 1 if `one` has none."""
    count = np.count_nonzero(one)
    return np.count_nonzero(one & other) / count if count else 1.0


def distribution_distance(quantity: str, one: xr.Dataset, other: xr.Dataset) -> float:
    """Return the first Wasserstein distance between two distributions of the gap (in m) or of the pressure (in Pa).

    Both distributions cover the nominal area. The distance is the area between the cumulative distributions. The gap
    counts as zero in contact, and where surfaces overlap outside contact. The pressure counts as zero outside contact,
    also where attraction acts. All gaps in a bin count as the geometric mean of the edges of the bin. All pressures in
    a bin count as the mean pressure of the bin.

    Parameters
    ----------
    quantity : "gap" or "pressure".
    one, other : states with the densities and their bins.
    """
    (u, weights), (v, other_weights) = (_values_and_weights(quantity, state) for state in (one, other))
    return float(wasserstein_distance(u, v, weights, other_weights))


def _values_and_weights(quantity, state):
    """For each bin, return the value and the fraction of the nominal area; the rest of the area has the value zero."""
    edges = state[f"{quantity}_bin_edges"].values
    content = state[f"{quantity}_density"].values * np.diff(edges)
    values = np.sqrt(edges[1:] * edges[:-1]) if quantity == "gap" else state["pressure_bin_mean"].values
    rest = max(1.0 - float(content.sum()), 0.0)
    return np.concatenate([[0.0], values]), np.concatenate([[rest], content])


def _study_dataset(study, rows):
    """Arrange the compared states of a study as a dataset along `AXES`.

    Each row has the indices of its run along the labels of the study, the load, and the values of its state, if any.
    """
    bins = {"gap_bin": len(GAP_BINS) - 1, "pressure_bin": len(PRESSURE_BINS) - 1}
    # The comparison of a run is complete if states were compared at one load or more.
    columns = {"status": ("state", [COMPLETE if "area_error" in row else INCOMPLETE for row in rows])}
    for name, described in MODEL_ERROR.items():
        unknown = np.full([bins[dim] for dim in described.dims], np.nan)
        columns[name] = ("state", *described.dims), np.array([row.get(name, unknown) for row in rows])
    index = pd.MultiIndex.from_frame(pd.DataFrame(rows)[list(AXES)])
    states = xr.Dataset(columns, xr.Coordinates.from_pandas_multiindex(index, "state"))
    states = states.unstack("state", fill_value={"status": NOT_IN_DESIGN}).transpose(*AXES, ...)
    runs = study.isel({label: states[label].values for label in _LABELS})
    applicability, tabor = (_of_model(runs, DEFAULT_MODEL, name) for name in ("applicability", "tabor_parameter"))
    variables = {"status": make_variable(STATUS._replace(dims=_LABELS), states["status"].min("reduced_pressure"))}
    missing = {"missing": "where a run has no state at the load"} if states["area_error"].isnull().any() else {}
    for name, described in MODEL_ERROR.items():
        variables[name] = xr.Variable((*AXES, *described.dims), states[name].values, described.attributes | missing)
        if described.dtype is int and missing:
            variables[name].encoding["dtype"] = np.dtype("int32")
    variables |= _summarise_over_seeds(variables, applicability.values[..., None] == "")
    variables |= describe_variables(BINS, bin_values("gap", GAP_BINS) | bin_values("pressure", PRESSURE_BINS))
    coords = {label: runs[label] for label in _LABELS}
    coords |= {"reduced_pressure": make_variable(ASKED, states["reduced_pressure"])}
    coords |= {name: variables.pop(name) for name in BINS if BINS[name].coordinate}
    of_runs = {name: runs[name] for name in MATERIAL} | {"tabor_parameter": tabor}
    of_runs |= {"attraction": _of_model(runs, REFERENCE_MODEL, "attraction"), "applicability": applicability}
    return xr.Dataset(variables | {name: each.variable for name, each in of_runs.items()}, coords)


def _of_model(runs, model, name):
    """Return a variable of the runs of a model along all labels."""
    return runs[name].broadcast_like(runs["status"]).sel(model=model).transpose(*_LABELS)


def _summarise_over_seeds(variables, applicable):
    """Return means and standard deviations of `SUMMARISED` over the seeds to which the model is applicable."""
    seeds = AXES.index("seed")
    others = tuple(axis for axis in AXES if axis != "seed")
    found = {}
    for name in SUMMARISED:
        values, long_name = np.where(applicable, variables[name].values, np.nan), MODEL_ERROR[name].long_name
        over_seeds = ensemble(values, seeds)
        further = {"missing": "where the mean contains no run"} | MODEL_ERROR[name].further
        mean = Variable(others, "1", f"mean over the seeds: {long_name}", further=further)
        found[f"{name}_mean"] = make_variable(mean, over_seeds.mean)
        if values.shape[seeds] > 1:
            further = {"missing": "where fewer than two runs are complete"}
            deviation = Variable(others, "1", f"standard deviation over the seeds: {long_name}", further=further)
            found[f"{name}_deviation"] = make_variable(deviation, over_seeds.deviation)
    return found
