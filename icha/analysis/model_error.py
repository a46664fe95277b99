"""Compute errors of the asperity model with respect to boundary elements on the same topography at the same load.

In the limit of a short range of attraction, the reference is a run of the same study with boundary elements. At finite
ranges of attraction, the reference is a solution of the code Tamaas.
"""

import contextlib
import itertools
from collections.abc import Iterable, Mapping
from functools import cache

import numpy as np
import xarray as xr
from scipy.stats import wasserstein_distance

from icha.contact.model import GAP_BINS, PRESSURE_BINS
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.attributes import DERIVED, combine_attributes, why_no_result
from icha.datasets.build import bin_values, describe_variables, make_variable
from icha.datasets.campaign import find_snapshot, loading_stops, select_run, spots_of
from icha.datasets.labels import LABELS, RunLabels, SolutionLabels, arrange_slopes, labels_at, place_of, slope_dims
from icha.datasets.variables.campaign import COMPLETE, INCOMPLETE, NOT_IN_DESIGN, RAGGED, STATUS
from icha.datasets.variables.model_error import ASKED, BINS, FINITE_RANGE, MODEL_ERROR, SHORT_RANGE
from icha.datasets.variables.run import CELLS
from icha.datasets.variables.terms import MATERIAL, Variable
from icha.equilibrium.distributions import cover_grid
from icha.path.targets import REDUCED_PRESSURE
from icha.support.statistics import ensemble

_TITLE = "Error of the model against boundary elements"
_SUMMARY = "Results of the model and of boundary elements for the same topographies, loads and materials."

# Labels of the runs except the model.
_LABELS = tuple(label for label in LABELS if label != "model")
AXES = (*_LABELS, "reduced_pressure")

# Variables that must be equal in a run and its reference, up to the relative difference `_ROUNDING`.
SHARED = ("period", "rms_height", "rms_curvature", "contact_modulus", "surface_energy", "interaction_range")
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
    campaign: xr.DataTree,
    solutions: Iterable[tuple[SolutionLabels | tuple, xr.Dataset]] = (),
    *,
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset]] = (),
    attrs: Mapping[str, str] = {},
) -> xr.DataTree:
    """Compare the runs of the asperity model with boundary elements at each load.

    Parameters
    ----------
    campaign : the campaign dataset; asperity runs must have a `reduced_pressure` snapshot at the load of each solution.
    solutions : labels and dataset of each solution at a finite range of attraction (`icha.references.finite_range`).
    runs : labels and dataset of each run with boundary elements in the limit of a short range, with contact maps. Areas
        and separations are compared at the targets of kind `reduced_pressure` of the first loading. Distributions and
        contact maps are compared where both models have a snapshot.
    attrs : further global attributes.

    Returns
    -------
    DataTree with one group for every study in `runs` and one group for every entry in `solutions`. The attribute
    `truth` of a group names the reference (`SHORT_RANGE` or `FINITE_RANGE`). Dimensions are surface, seed, rms_slope,
    material and the target of the reduced pressure. A group has

    - the variables of `icha.datasets.variables.model_error`;
    - for each name in `SUMMARISED`, the mean `<name>_mean` over the seeds; with two seeds or more, also the standard
      deviation `<name>_deviation`;
    - modulus, surface energy, range of attraction and Tabor parameter of the runs;
    - `status(surface, seed, rms_slope, material)`, which is complete if both a run and its reference are complete.
      Otherwise the values are missing.

    Raises
    ------
    ValueError
        If a solution has no asperity run, if this run has no snapshot at the load, or if run and reference differ in
        topography or material. The message names entry, run and load.
    """
    origins: dict[str, list[dict[str, str]]] = {}
    select = cache(lambda labels: select_run(campaign, labels))
    short_range = _short_range_entries(select, runs, origins)
    finite_range = _finite_range_entries(select, solutions, origins)
    groups = {}
    for truth, word, entries in ((SHORT_RANGE, "study", short_range), (FINITE_RANGE, "entry", finite_range)):
        for entry, states in entries.items():
            title = f"{_TITLE}, {word} {entry}"
            attributes = combine_attributes(title, _SUMMARY, DERIVED, origins.get(entry, [])) | {"truth": truth}
            groups[f"/{entry}"] = _entry_dataset(campaign, entry, states).assign_attrs(attributes)
    root = combine_attributes(_TITLE, _SUMMARY, DERIVED, itertools.chain(*origins.values()))
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root | dict(attrs))} | groups)


def _short_range_entries(select, runs, origins):
    """Compare the boundary elements in `runs` with the asperity runs of their studies; add attributes to `origins`."""
    entries: dict[str, dict[SolutionLabels, dict | None]] = {}
    for labels, truth in runs:
        labels = RunLabels(*labels)
        run = select(labels._replace(model=DEFAULT_MODEL))
        try:
            entries.setdefault(labels.study, {}).update(_compare_stops(labels, run, truth))
        except ValueError as error:
            raise ValueError(f"{labels}: {error}") from None
        origins.setdefault(labels.study, []).extend((run.attrs, truth.attrs))
    for states in entries.values():
        # If a run has no state at a load of other runs of the study, its state at this load is None.
        loads = {labels.reduced_pressure for labels in states}
        for place in [labels._replace(reduced_pressure=load) for labels in states for load in loads]:
            states.setdefault(place, None)
    return {study: states for study, states in entries.items() if states}


def _finite_range_entries(select, solutions, origins):
    """Compare asperity runs of entries with `solutions` at finite ranges; collect attributes in `origins`."""
    entries: dict[str, dict[SolutionLabels, dict | None]] = {}
    for labels, solution in solutions:
        labels = SolutionLabels(*labels)
        states = entries.setdefault(labels.entry, {})
        try:
            run = select(labels.run)
            if why_no_result(run.attrs):
                states[labels] = None
                continue
            state = REDUCED_PRESSURE, labels.reduced_pressure
            if "beyond_model" in run.attrs and snapshot_if_any(run, *state) is None:
                states[labels] = None
                continue
            snapshot = find_snapshot(run, *state)
            target = float(solution["target_reduced_pressure"])
            if not np.isclose(target, labels.reduced_pressure, rtol=1e-9):
                raise ValueError(
                    f"the solution is for reduced pressure {target:g}; expected {labels.reduced_pressure:g}"
                )
            states[labels] = compare_state(run, snapshot, solution)
        except ValueError as error:
            name = f"entry {labels.entry}, run {labels.run}, reduced pressure {labels.reduced_pressure:g}"
            raise ValueError(f"{name}: {error}") from None
        origins.setdefault(labels.entry, []).extend((run.attrs, solution.attrs))
    return entries


def compare_state(run: xr.Dataset, snapshot: int, solution: xr.Dataset) -> dict[str, float | np.ndarray]:
    """Return the variables of `MODEL_ERROR` for one snapshot of an asperity run and the solution at the same load.

    Raises
    ------
    ValueError
        If run and solution differ in topography or material, or if the contact area or the mean separation of the
        solution is not positive.
    """
    if difference := difference_of_contacts(run, solution):
        raise ValueError(difference)
    return _amounts(state_of(run, snapshot), solution) | _shapes(run, snapshot, solution)


def _compare_stops(labels, run, truth):
    """Compare an asperity run with boundary elements at each load; None if a state is missing or if contact is full."""
    if difference := difference_of_contacts(run, truth):
        raise ValueError(difference)
    failed = why_no_result(run.attrs) or why_no_result(truth.attrs)
    found = {}
    stops, true_stops = _stops(run), _stops(truth)
    for load in dict.fromkeys((*stops, *true_stops)):
        state = None
        in_both = not failed and load in stops and load in true_stops
        # In full contact the mean separation is zero, and without contact the area: relative errors are undefined.
        positive = in_both and all(truth[name].values[true_stops[load]] > 0 for name in _POSITIVE)
        if positive:
            solution = _as_solution(truth, true_stops[load], load)
            state = _amounts(run.isel(step=stops[load]), solution)
            if "contact" in solution and (snapshot := snapshot_if_any(run, REDUCED_PRESSURE, load)) is not None:
                state |= _shapes(run, snapshot, solution)
        found[SolutionLabels(labels.study, labels.study, *labels[2:], load)] = state
    return found


def _stops(run):
    """Return the index of each step of the first loading at a target of reduced pressure, by value of the target."""
    targets = loading_stops(run) & (run["step_kind"] == REDUCED_PRESSURE)
    return {float(run["step_target"].values[step]): step for step in np.flatnonzero(targets.values).tolist()}


def snapshot_if_any(run: xr.Dataset, kind: str, target: float) -> int | None:
    """Return the index of the snapshot of a kind and target in a run; None if the run has no such snapshot."""
    try:
        return find_snapshot(run, kind, target)
    except ValueError:
        return None


def _as_solution(run, step, load):
    """Convert a step of a boundary-element run to the variables of a solution at a finite range.

    If the step has a snapshot, the distributions and the contact map are included. In the limit of a short range, no
    stress acts outside contact, so all definitions of the contact area give the same value.
    """
    state = run.drop_dims([*RAGGED, "snapshot"], errors="ignore").isel(step=step)
    snapshot = snapshot_if_any(run, REDUCED_PRESSURE, load)
    if snapshot is not None:
        contact = run["contact_map"].isel(snapshot=snapshot).transpose("row", "column").values >= _HALF
        state = state_of(run, snapshot).drop_dims(CELLS).assign(contact=(("y", "x"), contact))
    area = state["contact_area_fraction"]
    return state.assign(
        contact_area_fraction_raw=area,
        energetic_area_fraction=area,
        residual=state["front_residual"],
        load_error=state["reduced_pressure"] / load - 1,
    )


def _amounts(state, solution):
    """Return areas, separations and errors of a state, with residual and grid of the boundary-element solution."""
    area, truth = (float(each["contact_area_fraction"]) for each in (state, solution))
    separation, true_separation = (float(each["reduced_separation"]) for each in (state, solution))
    for name, value in (("contact area", truth), ("mean separation", true_separation)):
        if not value > 0:
            raise ValueError(f"the {name} of boundary elements is {value:g}; expected a positive value")
    # At a finite range, attraction also acts outside the area of zero gap. As the range decreases, both the energetic
    # area and the area of zero gap approach the area of JKR theory. The energetic area is closer to this limit.
    adhesive = float(solution["surface_energy"]) > 0
    raw, energetic = float(solution["contact_area_fraction_raw"]), float(solution["energetic_area_fraction"])
    return {
        "contact_area_fraction": area,
        "contact_area_fraction_boundary_elements": truth,
        "contact_area_fraction_raw": raw,
        "perimeter_correction": raw / truth - 1,
        "energetic_area_fraction": energetic,
        "reduced_separation": separation,
        "reduced_separation_boundary_elements": true_separation,
        "area_error": area / truth - 1,
        "energetic_area_error": area / (energetic if adhesive else truth) - 1,
        "separation_error": separation / true_separation - 1,
        "load_error": float(solution["load_error"]),
        "residual": float(solution["residual"]),
        "solution_grid": int(solution["grid"]),
    }


def _shapes(run, snapshot, solution):
    """Return differences of distributions and contact maps between models, and the densities of the solution."""
    state, spots = state_of(run, snapshot), contact_of_spots(run, snapshot, solution.sizes["x"])
    contact = solution["contact"].transpose("y", "x").values == 1
    height, nominal = float(solution["rms_height"]), float(state["nominal_pressure"])
    pressure = float(solution["contact_modulus"]) * float(solution["rms_slope"])
    gaps = solution["gap_density"].values * height
    # The last bin of the solution contains all larger gaps, so it may be wider than the last bin of `GAP_BINS`.
    gaps[-1] *= np.diff(solution["gap_bin_edges"].values)[-1] / np.diff(GAP_BINS * height)[-1]
    return {
        "gap_distribution_distance": distribution_distance("gap", state, solution) / height,
        "pressure_distribution_distance": distribution_distance("pressure", state, solution) / nominal,
        "jaccard": jaccard(spots, contact),
        "shared_of_icha": shared(spots, contact),
        "shared_of_boundary_elements": shared(contact, spots),
        "gap_density": gaps,
        "pressure_density": solution["pressure_density"].values * pressure,
    }


def difference_of_contacts(run: xr.Dataset, solution: xr.Dataset) -> str:
    """Describe the first difference in topography or material between a run and a solution; "" if there is none."""
    for name in (*SHARED, "seed"):
        value, expected = float(run[name]), float(solution[name])
        if not np.isclose(value, expected, rtol=_ROUNDING, atol=0):
            units = run[name].attrs.get("units", "1")
            return f"{name} is {value:.7g} for the run, {expected:.7g} for the solution (in {units})"
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


def _entry_dataset(campaign, entry, states):
    """Arrange the compared states of one entry as a dataset along `AXES`; a missing state is None."""
    name = next(labels.study for labels in states)
    study = campaign[name].to_dataset()
    axes = _axes(study, states)
    slopes = axes["rms_slope"]
    coords = {
        label: (
            slope_dims(slopes) if label == "rms_slope" else label,
            np.array(axes[label], dtype=study[label].dtype),
            study[label].attrs,
        )
        for label in _LABELS
    }
    coords["reduced_pressure"] = make_variable(ASKED, axes["reduced_pressure"])
    labelled = xr.Dataset(coords=coords)
    shape = tuple(labelled.sizes[axis] for axis in AXES)
    grid = [SolutionLabels(entry, name, *labels_at(labelled, place, AXES)) for place in np.ndindex(shape)]
    # The comparison of a run is complete if states were compared at one load or more.
    statuses = [
        NOT_IN_DESIGN if labels not in states else INCOMPLETE if states[labels] is None else COMPLETE for labels in grid
    ]
    variables = {"status": make_variable(STATUS._replace(dims=_LABELS), np.reshape(statuses, shape).min(axis=-1))}
    variables |= _arrange(shape, [states.get(labels) for labels in grid])
    applicability = _of_asperities(study["applicability"], labelled)
    variables |= _summarise_over_seeds(variables, applicability.values[..., None] == "")
    bins = describe_variables(BINS, bin_values("gap", GAP_BINS) | bin_values("pressure", PRESSURE_BINS))
    coords |= {name: bins.pop(name) for name in BINS if BINS[name].coordinate}
    result = xr.Dataset(variables | bins, coords, {"entry": entry, "study": name})
    for quantity in MATERIAL:
        result[quantity] = study[quantity].sel(material=axes["material"])
    result["tabor_parameter"] = _of_asperities(study["tabor_parameter"], labelled)
    return result.assign(applicability=applicability)


def _of_asperities(quantity, labelled):
    """Return a quantity of the asperity runs along the labels of the dataset `labelled`; NaN for missing runs."""
    none = "" if quantity.dtype.kind in "OSU" else np.nan
    values = np.full([labelled.sizes[label] for label in _LABELS], none, object if none == "" else float)
    for place in np.ndindex(values.shape):
        labels = dict(zip(_LABELS, labels_at(labelled, place, _LABELS), strict=True))
        with contextlib.suppress(KeyError):
            values[place] = quantity.isel(place_of(quantity.to_dataset(), {"model": DEFAULT_MODEL} | labels)).item()
    return xr.Variable(_LABELS, values, quantity.attrs)


def _axes(study, states):
    """Return the values along each of `AXES` in the states of an entry; `arrange_slopes` gives the rms slopes."""
    asked = {axis: {getattr(labels, axis) for labels in states} for axis in AXES}
    axes = {
        label: [value for value in study[label].values.tolist() if value in asked[label]]
        for label in ("surface", "seed", "material")
    }
    order = axes["surface"].index
    pairs = sorted({(labels.surface, labels.rms_slope) for labels in states}, key=lambda pair: order(pair[0]))
    axes |= {"rms_slope": arrange_slopes(pairs), "reduced_pressure": sorted(asked["reduced_pressure"])}
    return {axis: axes[axis] for axis in AXES}


def _arrange(shape, states):
    """Return the variables of all states as arrays along `AXES` with the given shape; NaN where a state is None."""
    bins = {"gap_bin": len(GAP_BINS) - 1, "pressure_bin": len(PRESSURE_BINS) - 1}
    variables = {}
    for name, description in MODEL_ERROR.items():
        unknown = np.full([bins[dim] for dim in description.dims], np.nan)
        values = np.array([unknown if state is None else state.get(name, unknown) for state in states])
        values = values.reshape(shape + values.shape[1:])
        missing = {"missing": "where a run has no state at the load"} if None in states else {}
        variables[name] = xr.Variable(AXES + description.dims, values, description.attributes | missing)
        if description.dtype is int and values.dtype.kind == "f":
            variables[name].encoding["dtype"] = np.dtype("int32")
    return variables


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
