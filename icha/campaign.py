"""The campaign dataset: the runs of every study as full arrays along surface, seed, rms slope and material."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr

from icha.labels import RunLabels
from icha.path import BETWEEN
from icha.records import COMPLETE, INCOMPLETE, MISSING, STATUS_MEANINGS

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
    attrs: Mapping[str, str] = {},
    allow_missing: bool = False,
) -> xr.DataTree:
    """Put all runs of a campaign into one tree: a group per study, full arrays along the labels of the runs.

    Parameters
    ----------
    runs : pairs of labels (study, surface, seed, rms_slope, material) and run dataset. Studies, surfaces and
        materials keep the order in which they first come, seeds and slopes are sorted.
    attrs : global attributes of the file (title, summary, campaign, license, …).
    allow_missing : whether a study may lack combinations of its labels, or have runs that are incomplete: marked so
        by their attribute `incomplete`, not converged, or without some of the study's snapshots. If so,
        `status(surface, seed, rms_slope, material)` says which, and their values are missing.

    Returns
    -------
    DataTree whose groups have the dimensions surface, seed, rms_slope and material, and those of the run
    dataset. A run has `step_count` steps; beyond them, along `step`, numbers are missing and texts empty. Spots and
    events of all runs stand one after the other along `spot` and `event`; `spot_surface`, `spot_seed`,
    `spot_rms_slope` and `spot_material`, `event_surface` and so on, and `spot_snapshot`, are positions along these
    dimensions, from 0.

    Raises
    ------
    ValueError
        If two runs have the same labels, runs of a study do not fit together, or one is missing and may not be.
    """
    studies: dict[str, dict[RunLabels, xr.Dataset]] = {}
    for labels, run in runs:
        labels = RunLabels(*labels)
        labels = labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))
        members = studies.setdefault(labels.study, {})
        if labels in members:
            raise ValueError(f"{labels}: this run is given twice")
        members[labels] = run
    if not studies:
        raise ValueError("a campaign dataset needs at least one run")
    groups = {study: _study_dataset(members, allow_missing) for study, members in studies.items()}
    root = {"Conventions": "CF-1.11"} | dict(attrs)
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root)} | {f"/{name}": g for name, g in groups.items()})


def _study_dataset(members: dict[RunLabels, xr.Dataset], allow_missing: bool) -> xr.Dataset:
    axes = {label: list(dict.fromkeys(getattr(key, label) for key in members)) for label in ("surface", "material")} | {
        label: sorted({getattr(key, label) for key in members}) for label in ("seed", "rms_slope")
    }
    shape = tuple(len(axes[label]) for label in LABELS)
    position = {key: tuple(axes[label].index(getattr(key, label)) for label in LABELS) for key in members}
    study = next(iter(members)).study

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
    status, step_count = np.full(shape, MISSING, np.int8), np.zeros(shape, np.int32)
    for key, run in members.items():
        _check_labels(key, run)
        whole = all(run.sizes.get(dim, 0) == size for dim, size in sizes.items() if dim != "step")
        ended = "incomplete" not in run.attrs and _converged(run)
        status[position[key]] = COMPLETE if whole and ended else INCOMPLETE
        step_count[position[key]] = run.sizes.get("step", 0)
        odd = set(run.variables) ^ set(template.variables)
        if odd - (set() if ended else set(template.variables)):
            raise ValueError(f"{key}: variables differ from those of the study's other runs: {', '.join(sorted(odd))}")
    if not allow_missing and (status != COMPLETE).any():
        bad = []
        for index in np.argwhere(status != COMPLETE):
            values = [axes[label][i] for label, i in zip(LABELS, index, strict=True)]
            bad.append(f"{RunLabels(study, *values)} ({STATUS_MEANINGS[status[tuple(index)]]})")
        raise ValueError(f"study {study}: not all runs are there and complete: {', '.join(bad)}")

    variables: dict[str, xr.Variable] = {}
    for name, model in template.variables.items():
        if name in LABELS or set(RAGGED) & set(model.dims):
            continue
        if name in sizes:
            variables[name] = xr.Variable(name, np.arange(sizes[name], dtype=np.int32), model.attrs)
            continue
        variables[name] = _stack(name, model, axes, position, members, sizes, snapshot_at)
    variables["status"] = xr.Variable(
        LABELS,
        status,
        {
            "units": "1",
            "long_name": "status of the run",
            "flag_values": np.arange(len(STATUS_MEANINGS), dtype=np.int8),
            "flag_meanings": " ".join(STATUS_MEANINGS),
            "comment": "values of a run that is incomplete or missing are filled with _FillValue",
        },
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
    """Labels of all runs in a campaign dataset that are not missing, in its order."""
    found = []
    for study, node in tree.children.items():
        axes = [node[label].values.tolist() for label in LABELS]
        for index in itertools.product(*(range(len(axis)) for axis in axes)):
            if node["status"].values[index] != MISSING:
                found.append(RunLabels(study, *(axis[i] for axis, i in zip(axes, index, strict=True))))
    return found


def select_run(tree: xr.DataTree, labels: RunLabels | tuple) -> xr.Dataset:
    """Take one run out of a campaign dataset, with the steps that it has and its own spots.

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
    if dataset["status"].isel(index) == MISSING:
        raise ValueError(f"{labels}: this run is missing")
    run = dataset.isel(index).drop_vars(["status", "step_count"])
    if "step" in run.dims:
        run = run.isel(step=slice(0, int(dataset["step_count"].isel(index))))
    for dim in (dim for dim in RAGGED if dim in dataset.dims):
        own = np.all([dataset[f"{dim}_{label}"].values == i for label, i in index.items()], axis=0)
        run = run.isel({dim: np.flatnonzero(own)}).drop_vars([f"{dim}_{label}" for label in LABELS])
    if dataset["status"].isel(index) == INCOMPLETE:
        run = run.isel(snapshot=np.isfinite(run["overlap_fraction"].values))
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
