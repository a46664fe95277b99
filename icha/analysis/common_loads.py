"""Compare contact areas and mean separations of the runs of a study at common loads, with means and scatter."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from icha.datasets.attributes import DERIVED, combine_attributes
from icha.datasets.build import make_variable
from icha.datasets.campaign import loading_stops, reduced_gap
from icha.datasets.labels import LABELS
from icha.datasets.variables.campaign import COMPUTED_RUNS, LOADED_RUNS, MISSING
from icha.datasets.variables.terms import TERMS, Variable
from icha.uncertainty.ensembles import ensemble
from icha.uncertainty.left_out import too_few

# Number of loads per decade at which curves are compared.
_POINTS_PER_DECADE = 8
# Loads of two seeds count as equal up to this relative difference.
_SAME_LOAD = 1e-6

_WITHOUT_SEED = tuple(label for label in LABELS if label != "seed")
_SEED_COUNT = Variable(_WITHOUT_SEED, "1", "number of seeds in the mean and the standard deviation", np.int32)
_AVERAGED = (
    ("contact_area_fraction", "area", "A/A0"),
    ("reduced_separation", "separation", "mean separation (of a free square: mean gap) divided by rms height"),
)
_STATISTICS = {
    "mean": "mean over the seeds: {}",
    "deviation": "standard deviation over the seeds: {}",
    "confidence": "half the width of the 95 % confidence interval (Student's t) of the mean over the seeds: {}",
}


def interpolate(load, values, at, *, logarithmic: bool) -> np.ndarray:
    """Interpolate a monotone curve at given loads, with monotone cubic polynomials of the logarithm of the load.

    Parameters
    ----------
    load, values : points of the curve at positive loads, in any order. Only the first of several equal loads is used.
    at : loads within the range of the curve.
    logarithmic : True to interpolate the logarithm of the values, if all values are positive.

    Raises
    ------
    ValueError
        If a load lies outside the range of the curve.
    """
    load, first = np.unique(np.asarray(load, float), return_index=True)
    # If two targets of different kinds define the same state, the loads of the targets differ only by rounding, and
    # the slope of the curve between these loads is meaningless.
    distinct = np.concatenate([[True], np.diff(load) > 1e-9 * load[1:]])
    load, values = load[distinct], np.asarray(values, float)[first][distinct]
    at = np.asarray(at, float)
    if at.size and (at.min() < load[0] * (1 - 1e-9) or at.max() > load[-1] * (1 + 1e-9)):
        raise ValueError(
            f"loads {at.min():g} to {at.max():g} lie outside the curve; expected {load[0]:g} to {load[-1]:g}"
        )
    x = np.log(np.clip(at, load[0], load[-1]))
    if len(load) == 1:
        return np.full(at.shape, values[0])
    logarithmic = logarithmic and bool((values > 0).all())
    curve = PchipInterpolator(np.log(load), np.log(values) if logarithmic else values)
    return np.exp(curve(x)) if logarithmic else curve(x)


def compare_runs(study: xr.Dataset) -> xr.Dataset:
    """Compare contact area and mean separation of all runs of a study at common loads.

    Parameters
    ----------
    study : one group of the campaign dataset (`icha.datasets.campaign.campaign_tree`).

    Returns
    -------
    Dataset on two grids of loads, `reduced_pressure` and `relative_load`. Each grid spans the range of loads that all
    runs cover in the first loading. A grid is empty if the runs have no loads in common. Variables on the second grid
    have the suffix `_at_load`. On each grid the dataset has

    - `contact_area_fraction` and `reduced_separation` along the labels of the runs;
    - the mean of both variables over the seeds, the standard deviation, and half the width of the 95 % confidence
      interval (`area_mean`, `area_deviation`, `area_confidence`, `separation_mean`, …; `icha.uncertainty.ensembles`).

    Incomplete runs (`status`) have no values and do not contribute to means. Runs that left the range of the model have
    values up to the limit of the model. Runs for which the asperity model is not applicable have values, but do not
    contribute to means. `seed_count` is the number of seeds in the means. For a single seed, standard deviation and
    confidence interval are missing. The confidence interval is also missing if more than a tenth of the requested seeds
    is (`icha.uncertainty.left_out`).
    """
    status = study["status"].transpose(*LABELS).values
    loaded, asked = np.isin(status, LOADED_RUNS), np.isin(status, (*COMPUTED_RUNS, MISSING))
    # Adhesion may end a run before its first target.
    loaded &= study["step_count"].transpose(*LABELS).values > 0
    averaged = loaded & (study["applicability"].transpose(*LABELS).values == "")
    seeds = LABELS.index("seed")
    variables = {
        "status": study["status"],
        "seed_count": make_variable(_SEED_COUNT, averaged.sum(axis=seeds)),
    }
    coords = {label: study[label] for label in LABELS}
    for axis, load in _loads(study).items():
        suffix = "" if axis == "reduced_pressure" else "_at_load"
        at, on_grid = _on_common_grid(study, load, loaded)
        coords[axis] = make_variable(TERMS[axis]._replace(dims=(axis,)), at)
        curves = {name: (Variable(LABELS, "1", study[name].attrs["long_name"]), on_grid[name]) for name in on_grid}
        for name, (description, values) in (curves | _statistics(on_grid, averaged, asked)).items():
            along = description._replace(
                dims=(*description.dims, axis), long_name=f"{description.long_name}, at fixed {TERMS[axis].long_name}"
            )
            variables[name + suffix] = make_variable(along, values)
    described = combine_attributes(
        f"Comparison of the runs of study {study.attrs.get('study', '')}".rstrip(),
        "Contact area and mean separation of all runs at common loads. Monotone cubic polynomials (PCHIP) of the "
        "logarithm of the load interpolate the logarithm of the area, and the separation.",
        DERIVED,
        [study.attrs],
    )
    kept = {name: study.attrs[name] for name in ("study", "license") if study.attrs.get(name)}
    return xr.Dataset(variables, coords, described | kept)


def _loads(study):
    """Return reduced pressures and relative loads of steps; NaN except at compressive targets of the first loading."""
    pressure = study["reduced_pressure"].transpose(*LABELS, "step").values
    # The label `rms_slope` may differ from the slope of a run, if its rms height is prescribed.
    unit = study["unit_slope"].broadcast_like(study["status"]).transpose(*LABELS).values[..., None]
    shown = loading_stops(study).transpose(*LABELS, "step").values & (pressure > 0)
    loads = {"reduced_pressure": pressure, "relative_load": pressure * unit}
    return {axis: np.where(shown, load, np.nan) for axis, load in loads.items()}


def _on_common_grid(study, load, loaded):
    """Return common loads of the `loaded` runs, and areas and separations of these runs at the common loads."""
    curves = {
        "contact_area_fraction": study["contact_area_fraction"].transpose(*LABELS, "step").values,
        "reduced_separation": reduced_gap(study).transpose(*LABELS, "step").values,
    }
    runs = [tuple(index) for index in np.argwhere(loaded)]
    shown = ~np.isnan(load)
    at = _common_grid([load[run][shown[run]] for run in runs])
    on_grid = {name: np.full((*loaded.shape, len(at)), np.nan) for name in curves}
    for name, values in curves.items():
        logarithmic = name == "contact_area_fraction"
        for run in runs if len(at) else ():
            steps = shown[run]
            on_grid[name][run] = interpolate(load[run][steps], values[run][steps], at, logarithmic=logarithmic)
    return at, on_grid


def _statistics(on_grid, averaged, asked):
    """Return descriptions and values of statistics over the seeds, by variable name."""
    found, seeds = {}, LABELS.index("seed")
    stated = ~too_few(averaged.sum(axis=seeds), asked.sum(axis=seeds))[..., None]
    for name, short, symbol in _AVERAGED:
        over_seeds = ensemble(np.where(averaged[..., None], on_grid[name], np.nan), seeds)
        over_seeds = over_seeds._replace(confidence=np.where(stated, over_seeds.confidence, np.nan))
        for part, words in _STATISTICS.items():
            missing = "where the mean contains no run" if part == "mean" else "where the mean contains a single seed"
            missing += ", or too few of the requested seeds" if part == "confidence" else ""
            description = Variable(_WITHOUT_SEED, "1", words.format(symbol), further={"missing": missing})
            found[f"{short}_{part}"] = description, getattr(over_seeds, part)
    return found


def at_common_loads(
    curves: Sequence[tuple[np.ndarray, np.ndarray]], *, logarithmic: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate the curves of an ensemble, one for each seed, at common positive loads.

    Parameters
    ----------
    curves : loads and values of every member.
    logarithmic : True to interpolate the logarithm of the values of a member, if all these values are positive.

    Returns
    -------
    loads : (loads,) float, the loads of the members if all members have equal loads. Otherwise loads with equal steps
        of the logarithm in the common range of the members; empty if there is no common range.
    values : (members, loads) float, values of every member at the common loads.
    """
    curves = [(load[load > 0], values[load > 0]) for load, values in curves]
    loads = [np.sort(load) for load, _ in curves]
    if all(load.shape == loads[0].shape and np.allclose(load, loads[0], rtol=_SAME_LOAD, atol=0) for load in loads):
        return loads[0], np.array([values[np.argsort(load, kind="stable")] for load, values in curves])
    at = _common_grid(loads)
    if not len(at):
        return at, np.empty((len(curves), 0))
    return at, np.array([interpolate(load, values, at, logarithmic=logarithmic) for load, values in curves])


def _common_grid(loads):
    """Return loads with equal steps of the logarithm, in the range that the positive loads of every run cover."""
    if not loads or not all(map(len, loads)):
        return np.empty(0)
    lowest = max(float(load.min()) for load in loads)
    highest = min(float(load.max()) for load in loads)
    if highest <= lowest:
        return np.empty(0)
    count = max(2, round(np.log10(highest / lowest) * _POINTS_PER_DECADE) + 1)
    return np.geomspace(lowest, highest, count)


def compare_campaign(tree: xr.DataTree, *, attrs: Mapping[str, str] = {}) -> xr.DataTree:
    """Compare the runs of every study of a campaign with `compare_runs`; return a tree with a group for each study."""
    groups = {f"/{name}": compare_runs(node.to_dataset()) for name, node in tree.children.items()}
    root = combine_attributes(
        "Comparison of the runs of every study",
        "Contact area and mean separation of all runs of a study at common loads, with one group for each study.",
        DERIVED,
        [group.attrs for group in groups.values()],
    )
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root | dict(attrs))} | groups)
