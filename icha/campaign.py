"""The campaign dataset: the runs of every study as full arrays along surface, seed, rms slope and material."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr

from icha.labels import RunLabels
from icha.path import BETWEEN
from icha.records import COMPLETE, INCOMPLETE, MISSING, NOT_IN_DESIGN, status_variable

LABELS = ("surface", "seed", "rms_slope", "material")

# What a quantity of a run can depend on; everything else depends on all four labels. The snapshots' targets are those
# of the study's path, the bins are fixed in units of h_rms and of E* h'_rms.
_VARIES_WITH = {
    "contact_modulus": ("material",),
    "surface_energy": ("material",),
    "interaction_range": ("material",),
    "rms_height": ("surface", "seed", "rms_slope"),
    "rms_curvature": ("surface", "seed", "rms_slope"),
    "spectral_moment_0": ("surface", "seed", "rms_slope"),
    "spectral_moment_2": ("surface", "seed", "rms_slope"),
    "spectral_moment_4": ("surface", "seed", "rms_slope"),
    "nayak_parameter": ("surface", "seed", "rms_slope"),
    "period": ("surface",),
    "grid": ("surface",),
    "gap_bin_edges": ("surface", "seed", "rms_slope"),
    "pressure_bin_edges": ("rms_slope", "material"),
    "snapshot_kind": (),
    "snapshot_target": (),
    "control": (),
}
# Of these every run has as many as it has: in the campaign they stand one after the other.
RAGGED = ("spot", "event")


def campaign_tree(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset]],
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    attrs: Mapping[str, str] = {},
    allow_missing: bool = False,
) -> xr.DataTree:
    """Put all runs of a campaign into one tree: a group per study, full arrays along the labels of the runs.

    Parameters
    ----------
    runs : pairs of labels (study, surface, seed, rms_slope, material) and run dataset. Studies, surfaces and
        materials keep the order in which they first come, seeds and slopes are sorted. A run that failed has the
        reason in its attribute `incomplete`; one that did not converge or lacks snapshots that others of its study
        have is incomplete, too.
    design : labels of the runs that were asked for; those given, if left out. Other combinations of their labels are
        not in the design.
    attrs : global attributes of the file (title, summary, campaign, license, …).
    allow_missing : whether all combinations of the labels were asked for.

    Returns
    -------
    DataTree whose groups have the dimensions surface, seed, rms_slope and material, and those of the run
    dataset. A run has `step_count` steps; beyond them, along `step`, numbers are missing and texts empty. Spots and
    events of all runs stand one after the other along `spot` and `event`; `spot_surface`, `spot_seed`,
    `spot_rms_slope` and `spot_material`, `event_surface` and so on, and `spot_snapshot`, are positions along these
    dimensions, from 0. `status(surface, seed, rms_slope, material)` says of every combination whether its run is
    complete, incomplete, missing or not in the design; `failure` says why a run is incomplete. What is not known of an
    incomplete run, and everything of those that are not there, is missing.

    Raises
    ------
    ValueError
        If two runs have the same labels, runs of a study do not fit together, a study has no run, or a run is not in
        the design.
    """
    studies: dict[str, dict[RunLabels, xr.Dataset]] = {}
    for labels, run in runs:
        labels = _plain(labels)
        members = studies.setdefault(labels.study, {})
        if labels in members:
            raise ValueError(f"{labels}: this run is given twice")
        members[labels] = run
    if not studies:
        raise ValueError("a campaign dataset needs at least one run")
    asked = None if design is None else dict.fromkeys(map(_plain, design))
    groups = {}
    for study, members in studies.items():
        own = list(members) if asked is None else [labels for labels in asked if labels.study == study]
        if odd := [labels for labels in members if labels not in set(own)]:
            raise ValueError(f"{odd[0]}: this run is not in the design")
        groups[study] = _study_dataset(members, own, allow_missing)
    for labels in asked or ():
        if labels.study not in studies:
            raise ValueError(f"study {labels.study}: there is no run of it")
    root = {"Conventions": "CF-1.11"} | dict(attrs)
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root)} | {f"/{name}": g for name, g in groups.items()})


def _plain(labels):
    """Labels with numbers of Python's own types."""
    labels = RunLabels(*labels)
    return labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))


def _study_dataset(members: dict[RunLabels, xr.Dataset], design: list[RunLabels], allow_missing: bool) -> xr.Dataset:
    axes = {label: list(dict.fromkeys(getattr(key, label) for key in design)) for label in ("surface", "material")} | {
        label: sorted({getattr(key, label) for key in design}) for label in ("seed", "rms_slope")
    }
    shape = tuple(len(axes[label]) for label in LABELS)
    position = {key: tuple(axes[label].index(getattr(key, label)) for label in LABELS) for key in design}
    study = design[0].study

    # Of runs that ended early some variables may be unknown: what they would have reached at the end.
    template = max(members.values(), key=lambda run: ("incomplete" not in run.attrs, run.sizes.get("step", 0)))
    # Where a run meets its stops in another order than the others (a load and an area, say), so it does its snapshots.
    snapshots = list(dict.fromkeys(itertools.chain(_snapshots(template), *map(_snapshots, members.values()))))
    members = {key: _in_order_of(snapshots, run) for key, run in members.items()}
    snapshot_at = {key: [snapshots.index(each) for each in _snapshots(run)] for key, run in members.items()}
    sizes = {dim: size for dim, size in template.sizes.items() if dim not in RAGGED}
    if "snapshot" in sizes:
        sizes["snapshot"] = len(snapshots)
    if "step" in sizes:
        sizes["step"] = max(run.sizes["step"] for run in members.values())
    status, step_count = np.full(shape, NOT_IN_DESIGN, np.int8), np.zeros(shape, np.int32)
    failure = np.full(shape, "", object)
    status[... if allow_missing else tuple(np.transpose([position[key] for key in design]))] = MISSING
    for key, run in members.items():
        _check_labels(key, run)
        failure[position[key]] = _why_incomplete(run, sizes)
        status[position[key]] = INCOMPLETE if failure[position[key]] else COMPLETE
        step_count[position[key]] = run.sizes.get("step", 0)
        odd = set(run.variables) ^ set(template.variables)
        ended = "incomplete" not in run.attrs and _converged(run)
        if odd - (set() if ended else set(template.variables)):
            raise ValueError(f"{key}: variables differ from those of the study's other runs: {', '.join(sorted(odd))}")

    variables: dict[str, xr.Variable] = {}
    for name, model in template.variables.items():
        if name in LABELS or set(RAGGED) & set(model.dims):
            continue
        if name in sizes:
            variables[name] = xr.Variable(name, np.arange(sizes[name], dtype=np.int32), model.attrs)
            continue
        variables[name] = _stack(name, model, axes, position, members, sizes, snapshot_at)
    variables["status"] = status_variable(LABELS, status)
    variables["failure"] = xr.Variable(
        LABELS, failure, {"units": "1", "long_name": "why the run is incomplete; empty where it is not"}
    )
    variables["step_count"] = xr.Variable(
        LABELS,
        step_count,
        {
            "units": "1",
            "long_name": "number of steps of the run",
            "comment": "from this position on along step, numbers are filled with _FillValue and texts are empty",
        },
    )
    for dim in RAGGED:
        variables |= _one_after_the_other(dim, template, position, members, snapshot_at)
    coords = {
        "surface": ("surface", np.array(axes["surface"], dtype=object), "name of the surface"),
        "seed": ("seed", np.array(axes["seed"], dtype=np.int32), "seed of the surface"),
        "rms_slope": ("rms_slope", np.array(axes["rms_slope"]), "root mean square slope of the surface"),
        "material": ("material", np.array(axes["material"], dtype=object), "name of the material"),
    }
    coords = {
        name: xr.Variable(dim, values, {"units": "1", "long_name": long_name})
        for name, (dim, values, long_name) in coords.items()
    } | {name: variables.pop(name) for name in list(variables) if name in template.coords}
    keep = ("Conventions", "source", "license", "references", "config_sha256")
    attrs = {name: template.attrs[name] for name in keep if name in template.attrs}
    attrs = {"title": f"Study {study}", "study": study} | attrs
    return xr.Dataset(variables, coords, attrs)


def _converged(run):
    return bool(np.all(run["converged"].values == 1)) if "converged" in run else True


def _why_incomplete(run, sizes):
    """Why a run does not hold all of what it was asked for; an empty text if it does."""
    if "incomplete" in run.attrs:
        return str(run.attrs["incomplete"])
    if not _converged(run):
        return f"{int(np.sum(run['converged'].values != 1))} of its steps did not converge"
    lacking = [dim for dim, size in sizes.items() if dim != "step" and run.sizes.get(dim, 0) != size]
    if lacking:
        return "; ".join(f"{run.sizes.get(dim, 0)} of {sizes[dim]} along {dim}" for dim in lacking)
    return ""


def _check_labels(key, run):
    for label, tolerance in (("rms_slope", 1e-6), ("seed", 0)):
        if label in run:
            value, named = float(run[label]), float(getattr(key, label))
            if abs(value - named) > tolerance * abs(named):
                raise ValueError(f"{key}: the dataset's {label} is {value:g}")


def _snapshots(run):
    """Kind and target of a run's snapshots."""
    if "snapshot" not in run.dims:
        return []
    return [(str(k), float(t)) for k, t in zip(run["snapshot_kind"].values, run["snapshot_target"].values, strict=True)]


def _in_order_of(snapshots, run):
    """The run with its snapshots, and their spots, in the given order."""
    own = _snapshots(run)
    order = sorted(range(len(own)), key=lambda k: snapshots.index(own[k]))
    if order == list(range(len(own))):
        return run
    run = run.isel(snapshot=order)
    now = np.argsort(order)[run["spot_snapshot"].values]
    run["spot_snapshot"] = run["spot_snapshot"].copy(data=now)
    return run.isel(spot=np.argsort(now, kind="stable"))


def _stack(name, model, axes, position, members, sizes, snapshot_at):
    """One variable of all runs as a full array along the labels it varies with and its own dimensions."""
    along = _VARIES_WITH.get(name, LABELS)
    dims = along + model.dims
    shape = tuple(len(axes[label]) for label in along) + tuple(sizes[dim] for dim in model.dims)
    filled = np.zeros(shape, bool)
    text = model.dtype.kind in "OUT"
    values = np.empty(shape, object) if text else np.full(shape, np.nan, np.float64)
    chosen = [LABELS.index(label) for label in along]
    for key, run in members.items():
        if name not in run:
            continue
        value = run[name].variable.transpose(*model.dims).values
        own = [
            snapshot_at[key] if dim == "snapshot" else slice(0, size)
            for dim, size in zip(model.dims, value.shape, strict=True)
        ]
        place = (*(position[key][i] for i in chosen), *own)
        known = filled[place]
        there = values[place]
        same = there == value if text else np.isclose(np.asarray(there, float), value, rtol=1e-9, atol=0)
        if np.any(known & ~same):
            raise ValueError(f"{key}: {name} differs between runs that share {', '.join(along) or 'the study'}")
        values[place] = np.where(known, there, value)[()]
        filled[place] = True
    attrs = dict(model.attrs)
    if text:
        values[~filled] = ""
        return xr.Variable(dims, values, attrs)
    if model.dtype.kind == "f":
        return xr.Variable(dims, values, attrs)
    if filled.all():
        return xr.Variable(dims, _narrow(values, model.dtype), attrs)
    # A filled integer is read back as a float with missing values, so it is one here as well.
    return xr.Variable(dims, values, attrs, encoding={"dtype": np.dtype("int32")})


def _narrow(values, dtype):
    """Integers, which were of a type, in the one they are kept in: 32 bits, which every netCDF tool reads, or flags."""
    return values.astype(np.int8 if dtype == np.int8 else np.int32)


def _one_after_the_other(dim, template, position, members, snapshot_at):
    """What all runs have along a ragged dimension, one after the other, and their positions along the labels."""
    names = [name for name, model in template.variables.items() if model.dims == (dim,) and name != dim]
    if not names:
        return {}
    ordered = sorted((key for key, run in members.items() if dim in run.dims), key=position.get)
    stacked = {}
    for name in names:
        parts = [members[key][name].values for key in ordered]
        if name == "spot_snapshot":
            parts = [np.asarray(snapshot_at[key], int)[own] for key, own in zip(ordered, parts, strict=True)]
        values = np.concatenate(parts)
        values = _narrow(values, template[name].dtype) if values.dtype.kind in "iu" else values
        stacked[name] = xr.Variable(dim, values, dict(template[name].attrs))
    counts = [members[key].sizes[dim] for key in ordered]
    for axis, label in enumerate(LABELS):
        stacked[f"{dim}_{label}"] = xr.Variable(
            dim,
            np.repeat(np.array([position[key][axis] for key in ordered], np.int32), counts),
            {"units": "1", "long_name": f"position of the {dim}'s run along {label}, from 0"},
        )
    return stacked


def run_labels(tree: xr.DataTree) -> list[RunLabels]:
    """Labels of all runs in a campaign dataset, complete or not, in its order."""
    found = []
    for study, node in tree.children.items():
        axes = [node[label].values.tolist() for label in LABELS]
        there = np.isin(node["status"].transpose(*LABELS).values, (COMPLETE, INCOMPLETE))
        found += [
            RunLabels(study, *(axis[i] for axis, i in zip(axes, index, strict=True)))
            for index in np.argwhere(there).tolist()
        ]
    return found


def select_run(tree: xr.DataTree, labels: RunLabels | tuple) -> xr.Dataset:
    """Take one run out of a campaign dataset, with the steps that it has and its own spots.

    One that is incomplete has the reason in its attribute `incomplete`, as its file has.

    Raises
    ------
    ValueError
        If the campaign has no such run; the message says what it has.
    """
    labels = RunLabels(*labels)
    if labels.study not in tree.children:
        raise ValueError(f"no study {labels.study!r}; there are {', '.join(tree.children)}")
    dataset = tree[labels.study].to_dataset()
    index = {}
    for label in LABELS:
        values = dataset[label].values
        wanted = getattr(labels, label)
        at = np.flatnonzero(np.isclose(values, wanted, rtol=1e-9) if label == "rms_slope" else values == wanted)
        if not len(at):
            there = ", ".join(f"{value:g}" if label == "rms_slope" else str(value) for value in values)
            raise ValueError(f"study {labels.study}: no {label} {wanted!r}; there are {there}")
        index[label] = int(at[0])
    status = int(dataset["status"].isel(index))
    if status in (MISSING, NOT_IN_DESIGN):
        raise ValueError(f"{labels}: this run is {'missing' if status == MISSING else 'not in the design'}")
    failure = dataset["failure"].isel(index).item()
    run = dataset.isel(index).drop_vars(["status", "failure", "step_count"])
    if "step" in run.dims:
        run = run.isel(step=slice(0, int(dataset["step_count"].isel(index))))
    for dim in (dim for dim in RAGGED if dim in dataset.dims):
        own = np.all([dataset[f"{dim}_{label}"].values == i for label, i in index.items()], axis=0)
        run = run.isel({dim: np.flatnonzero(own)}).drop_vars([f"{dim}_{label}" for label in LABELS])
    if status == INCOMPLETE:
        run = run.assign_attrs(incomplete=failure).isel(snapshot=np.isfinite(run["overlap_fraction"].values))
        run = run.drop_vars([name for name, variable in run.data_vars.items() if _unknown(variable)])
    integers = [name for name, variable in run.variables.items() if _filled_integer(variable)]
    return run.assign({name: run[name].astype(np.int32) for name in integers}).reset_coords(list(LABELS))


def _unknown(variable):
    """Whether a variable of a run that ended early has no value."""
    return variable.dtype.kind == "f" and not variable.dims and np.isnan(variable.values)


def _filled_integer(variable):
    """Whether a variable holds integers that are floats for others that are missing."""
    return variable.dtype.kind == "f" and variable.encoding.get("dtype") == np.dtype("int32")


def loading_stops(data: xr.Dataset) -> xr.DataArray:
    """Which steps of a run, or of all runs of a study, are stops of the first loading, and not between stops."""
    return (data["leg"] == 0) & (data["step_kind"] != BETWEEN)


def find_snapshot(run: xr.Dataset, kind: str | None = None, target: float | None = None) -> int:
    """Position of the snapshot of a kind and target; the first one of the kind, or of all, if nothing more is said.

    Raises
    ------
    ValueError
        If there is none; the message lists the run's snapshots.
    """
    kinds = [str(value) for value in run["snapshot_kind"].values]
    targets = run["snapshot_target"].values
    for k, (own_kind, own_target) in enumerate(zip(kinds, targets, strict=True)):
        if kind in (None, own_kind) and (target is None or np.isclose(own_target, target, rtol=1e-9)):
            return k
    there = ", ".join(f"{k} {t:g}" for k, t in zip(kinds, targets, strict=True)) or "none"
    asked = kind or "any kind"
    raise ValueError(f"no snapshot of {asked}{'' if target is None else f' {target:g}'}; there are: {there}")


def spots_of(run: xr.Dataset, snapshot: int) -> xr.Dataset:
    """The spots of one snapshot of a run."""
    own = [name for name, variable in run.variables.items() if variable.dims == ("spot",)]
    return run[own].isel(spot=np.flatnonzero(run["spot_snapshot"].values == snapshot))
