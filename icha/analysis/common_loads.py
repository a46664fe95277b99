"""Runs of a study side by side: areas and separations at common loads, and what spreads them."""

import warnings
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from icha.datasets.attributes import DERIVED, combine_attributes
from icha.datasets.build import make_variable
from icha.datasets.campaign import loading_stops, reduced_gap
from icha.datasets.labels import LABELS
from icha.datasets.variables.campaign import COMPLETE, COMPUTED_RUNS, MISSING
from icha.datasets.variables.terms import TERMS, Variable
from icha.support.statistics import ensemble

# Loads at which curves are compared, per decade.
_POINTS_PER_DECADE = 8
# Points of a mean loop on every way.
_WAY_POINTS = 200
# Stops whose loads differ by less than this part, from seed to seed, are stops at the same load.
_SAME_LOAD = 1e-6

_WITHOUT_SEED = tuple(label for label in LABELS if label != "seed")
_SEED_COUNT = Variable(_WITHOUT_SEED, "1", "number of seeds that means and deviations are over", np.int32)
_ASKED_SEED_COUNT = Variable(_WITHOUT_SEED, "1", "number of seeds asked for", np.int32)
_AVERAGED = (
    ("contact_area_fraction", "area", "A/A0"),
    ("reduced_separation", "separation", "the mean separation, of a free square the mean gap, over the rms height"),
)
_STATISTICS = {
    "mean": "mean of {} over the seeds",
    "deviation": "standard deviation of {} over the seeds",
    "confidence": "half the width of the 95 % confidence interval of the mean of {} over the seeds (Student's t)",
}


def interpolated(load, values, at, *, logarithmic: bool) -> np.ndarray:
    """Values of a monotone curve at loads `at` within its range, by monotone cubics in the logarithm of the load.

    Parameters
    ----------
    load, values : the curve, in any order; loads positive. Of equal loads the first is kept.
    at : loads within the curve's.
    logarithmic : whether to interpolate the logarithm of the values, which are then positive.

    Raises
    ------
    ValueError
        If a load lies outside the curve's.
    """
    load, first = np.unique(np.asarray(load, float), return_index=True)
    # Targets of two kinds may be one state: what differs by rounding only cannot carry a slope.
    apart = np.concatenate([[True], np.diff(load) > 1e-9 * load[1:]])
    load, values = load[apart], np.asarray(values, float)[first][apart]
    at = np.asarray(at, float)
    if at.size and (at.min() < load[0] * (1 - 1e-9) or at.max() > load[-1] * (1 + 1e-9)):
        raise ValueError(f"loads {at.min():g} to {at.max():g} lie outside the curve's, {load[0]:g} to {load[-1]:g}")
    x = np.log(np.clip(at, load[0], load[-1]))
    if len(load) == 1:
        return np.full(at.shape, values[0])
    curve = PchipInterpolator(np.log(load), np.log(values) if logarithmic else values)
    return np.exp(curve(x)) if logarithmic else curve(x)


def compare_runs(study: xr.Dataset, *, attrs: Mapping[str, str] = {}) -> xr.Dataset:
    """Contact area and mean separation of all runs of a study at common loads, and their spread.

    Parameters
    ----------
    study : one group of the campaign dataset (`icha.datasets.campaign.campaign_tree`).
    attrs : further global attributes.

    Returns
    -------
    Dataset on two grids of loads, `reduced_pressure` and `relative_load`, each over the range that all complete runs
    cover (of length zero where there is no such range) between stops of their first loading. On each, with the suffix
    `_at_load` on the second: `contact_area_fraction` and `reduced_separation` along the labels of the runs; over the
    seeds mean, standard deviation and half the width of the 95 % confidence interval of both (`area_mean`,
    `area_deviation`, `area_confidence`, `separation_mean`, …; `icha.support.statistics`);
    `material_spread` and `slope_spread`, the largest over the smallest area of all materials (slopes), minus one. Runs
    that are not complete lack values, as `status` says, and do not count; runs to which the asperity model is not
    applicable are in no mean. `seed_count` says how many seeds means are over, and `asked_seed_count` how many were
    asked for, of every model, surface, slope and material. A single one has no deviation and no band: they are missing.
    """
    complete = study["status"].transpose(*LABELS).values == COMPLETE
    averaged = complete & _applicable(study)
    asked = np.isin(study["status"].transpose(*LABELS).values, (*COMPUTED_RUNS, MISSING))
    variables = {"status": study["status"]}
    for name, description, counted in (
        ("seed_count", _SEED_COUNT, averaged),
        ("asked_seed_count", _ASKED_SEED_COUNT, asked),
    ):
        variables[name] = make_variable(description, counted.sum(axis=LABELS.index("seed")))
    coords = {label: study[label] for label in LABELS}
    for axis, load in _loads(study).items():
        suffix = "" if axis == "reduced_pressure" else "_at_load"
        at, on_grid = _on_common_grid(study, load, complete)
        coords[axis] = make_variable(TERMS[axis]._replace(dims=(axis,)), at)
        for name, (description, values) in (_curves(study, on_grid) | _spreads(on_grid, averaged)).items():
            along = description._replace(
                dims=(*description.dims, axis), long_name=f"{description.long_name}, at {TERMS[axis].long_name}"
            )
            variables[name + suffix] = make_variable(along, values)
    described = combine_attributes(
        f"Comparison of the runs of study {study.attrs.get('study', '')}".rstrip(),
        "Contact area and mean separation at loads common to all runs, by monotone interpolation.",
        DERIVED,
        [study.attrs],
    )
    kept = {name: study.attrs[name] for name in ("study", "license") if study.attrs.get(name)}
    return xr.Dataset(variables, coords, described | kept | dict(attrs))


def _loads(study):
    """Loads of all steps on both axes, NaN but at the stops of the first loading: tensile ones have no logarithm."""
    pressure = study["reduced_pressure"].transpose(*LABELS, "step").values
    slope = study["rms_slope"].broadcast_like(study["status"]).transpose(*LABELS).values[..., None]
    shown = loading_stops(study).transpose(*LABELS, "step").values & (pressure > 0)
    loads = {"reduced_pressure": pressure, "relative_load": pressure * slope}
    return {axis: np.where(shown, load, np.nan) for axis, load in loads.items()}


def _on_common_grid(study, load, complete):
    """A grid of loads that all complete runs cover, and the curves of all runs on it, by name."""
    curves = {
        "contact_area_fraction": study["contact_area_fraction"].transpose(*LABELS, "step").values,
        "reduced_separation": reduced_gap(study).transpose(*LABELS, "step").values,
    }
    places = [tuple(place) for place in np.argwhere(complete)]
    shown = ~np.isnan(load)
    at = _common_grid([load[place][shown[place]] for place in places])
    on_grid = {name: np.full((*complete.shape, len(at)), np.nan) for name in curves}
    for name, values in curves.items():
        for place in places if len(at) else ():
            own = shown[place]
            logarithmic = name == "contact_area_fraction"
            on_grid[name][place] = interpolated(load[place][own], values[place][own], at, logarithmic=logarithmic)
    return at, on_grid


def _curves(study, on_grid):
    """Descriptions and values of the curves of all runs."""
    return {name: (Variable(LABELS, "1", study[name].attrs["long_name"]), values) for name, values in on_grid.items()}


def _applicable(study):
    """Which runs nothing is known of that makes the asperity model not applicable to them."""
    if "applicability" not in study:  # which campaigns of earlier versions lack
        return True
    return study["applicability"].transpose(*LABELS).values == ""


def _spreads(on_grid, averaged):
    """Descriptions and values of what spreads the curves: the seeds that are averaged, and materials and slopes."""
    found = {}
    for name, short, symbol in _AVERAGED:
        over_seeds = ensemble(np.where(averaged[..., None], on_grid[name], np.nan), LABELS.index("seed"))
        for part, words in _STATISTICS.items():
            none = "where no run counts" if part == "mean" else "where there is a single seed"
            description = Variable(_WITHOUT_SEED, "1", words.format(symbol), further={"missing": none})
            found[f"{short}_{part}"] = description, getattr(over_seeds, part)
    for label, many in (("material", "materials"), ("rms_slope", "rms slopes")):
        description = Variable(
            tuple(each for each in LABELS if each != label), "1", f"largest over smallest A/A0 of all {many}, less 1"
        )
        spread = _spread(on_grid["contact_area_fraction"], LABELS.index(label))
        found[f"{label.removeprefix('rms_')}_spread"] = description, spread
    return found


def at_common_loads(
    curves: Sequence[tuple[np.ndarray, np.ndarray]], *, logarithmic: bool
) -> tuple[np.ndarray, np.ndarray]:
    """The curves of an ensemble, one for each seed, at common positive loads.

    Parameters
    ----------
    curves : load and values of every member.
    logarithmic : whether to interpolate the logarithm of the values, which are then positive.

    Returns
    -------
    The loads, those of the members where they are the same and else evenly spaced by their logarithm over the range
    that all cover (none if there is no such range), and the values (members, loads) at them.
    """
    curves = [(load[load > 0], values[load > 0]) for load, values in curves]
    loads = [np.sort(load) for load, _ in curves]
    if all(load.shape == loads[0].shape and np.allclose(load, loads[0], rtol=_SAME_LOAD, atol=0) for load in loads):
        return loads[0], np.array([values[np.argsort(load, kind="stable")] for load, values in curves])
    at = _common_grid(loads)
    if not len(at):
        return at, np.empty((len(curves), 0))
    return at, np.array([interpolated(load, values, at, logarithmic=logarithmic) for load, values in curves])


def at_common_displacements(ways: Sequence[xr.Dataset]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Reduced pressure and contact area of an ensemble on one leg of a path, at common displacements.

    They are counted from where the leg is loaded most, so that legs that meet there meet in their mean as well. Where a
    member is separated, pressure and area are zero; ways that end in contact end where the first of them does.

    Parameters
    ----------
    ways : the same leg of every member (`icha.figures.select.branches`).

    Returns
    -------
    Means of the mean separations over the rms height, in the order of the leg, and `reduced_pressure` and
    `contact_area_fraction` (members, separations) at them.
    """
    separations = [way["reduced_separation"].values for way in ways]
    closest = [float(separation.min()) for separation in separations]
    falling = separations[0][-1] < separations[0][0]
    apart = all(float(way["contact_area_fraction"].values[0 if falling else -1]) == 0 for way in ways)
    reach = max if apart else min
    at = np.linspace(0, reach(np.ptp(separation) for separation in separations), _WAY_POINTS)
    found = {}
    for name in ("reduced_pressure", "contact_area_fraction"):
        members = []
        for way, separation, least in zip(ways, separations, closest, strict=True):
            order = np.argsort(separation, kind="stable")
            beyond = 0.0 if apart else None
            members.append(np.interp(least + at, separation[order], way[name].values[order], right=beyond))
        found[name] = np.array(members)
    order = slice(None, None, -1 if falling else 1)
    return (at + np.mean(closest))[order], {name: values[:, order] for name, values in found.items()}


def _spread(area, axis):
    """Largest over smallest area, less 1; NaN of no complete run at all."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nanmax(area, axis) / np.nanmin(area, axis) - 1


def _common_grid(loads):
    """Loads, evenly spaced by their logarithm, that every run covers; `loads` are those of each, all positive."""
    if not loads or not all(map(len, loads)):
        return np.empty(0)
    lowest = max(float(own.min()) for own in loads)
    highest = min(float(own.max()) for own in loads)
    if highest <= lowest:
        return np.empty(0)
    count = max(2, round(np.log10(highest / lowest) * _POINTS_PER_DECADE) + 1)
    return np.geomspace(lowest, highest, count)


def compare_campaign(tree: xr.DataTree, *, attrs: Mapping[str, str] = {}) -> xr.DataTree:
    """`compare_runs` for every study of a campaign, as a tree of the same shape."""
    groups = {f"/{name}": compare_runs(node.to_dataset()) for name, node in tree.children.items()}
    root = combine_attributes(
        "Comparison of the runs of every study",
        "Contact area and mean separation of all runs of a study at common loads, a group for each study.",
        DERIVED,
        [group.attrs for group in groups.values()],
    )
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root | dict(attrs))} | groups)
