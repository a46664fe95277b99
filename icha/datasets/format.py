"""The documented format of the files that users rely on, as data, and what of a file does not keep to it.

The tables hold the names that are promised; a file may have more, of which every variable has its units and its long
name, too. They are not those that the program writes from: a change of the program that breaks the promise is seen.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

RUN, SURFACE, CAMPAIGN = "run dataset", "surface file", "campaign dataset"

# A number of the identities of the format may be off by rounding.
_ROUNDING = 1e-9


class UnknownFile(ValueError):
    """A file that is none of those that are documented, or no readable netCDF file at all."""


class Promised(NamedTuple):
    """A variable: its dimensions and units, and which condition of `_there` decides whether it must be there."""

    dims: tuple[str, ...]
    units: str
    condition: str = ""


# Conditions under which a variable must be there.
SNAPSHOTS, WAY_BACK, SYNTHESISED, MEASURED = "snapshots", "a way back to separation", "a spectrum", "a measurement"

RUN_VARIABLES = {
    "mean_separation": Promised(("step",), "m"),
    "nominal_pressure": Promised(("step",), "Pa"),
    "contact_area_fraction": Promised(("step",), "1"),
    "spot_count": Promised(("step",), "1"),
    "contact_stiffness": Promised(("step",), "Pa m^-1"),
    "residual": Promised(("step",), "1"),
    "converged": Promised(("step",), "1"),
    "branch": Promised(("step",), "1"),
    "leg": Promised(("step",), "1"),
    "reduced_pressure": Promised(("step",), "1"),
    "reduced_separation": Promised(("step",), "1"),
    "jump_in_count": Promised(("step",), "1"),
    "jump_off_count": Promised(("step",), "1"),
    "coalescence_count": Promised(("step",), "1"),
    "split_count": Promised(("step",), "1"),
    "step_kind": Promised(("step",), "1"),
    "step_target": Promised(("step",), "1"),
    "snapshot_step": Promised(("snapshot",), "1", SNAPSHOTS),
    "snapshot_kind": Promised(("snapshot",), "1", SNAPSHOTS),
    "snapshot_target": Promised(("snapshot",), "1", SNAPSHOTS),
    "overlap_fraction": Promised(("snapshot",), "1", SNAPSHOTS),
    "gap_density": Promised(("snapshot", "gap_bin"), "m^-1", SNAPSHOTS),
    "pressure_density": Promised(("snapshot", "pressure_bin"), "Pa^-1", SNAPSHOTS),
    "pressure_bin_mean": Promised(("snapshot", "pressure_bin"), "Pa", SNAPSHOTS),
    "gap_bin_edges": Promised(("gap_edge",), "m", SNAPSHOTS),
    "pressure_bin_edges": Promised(("pressure_edge",), "Pa", SNAPSHOTS),
    "gap_bin_centre": Promised(("gap_bin",), "m", SNAPSHOTS),
    "gap_bin_bounds": Promised(("gap_bin", "bound"), "m", SNAPSHOTS),
    "pressure_bin_centre": Promised(("pressure_bin",), "Pa", SNAPSHOTS),
    "pressure_bin_bounds": Promised(("pressure_bin", "bound"), "Pa", SNAPSHOTS),
    "spot_snapshot": Promised(("spot",), "1", SNAPSHOTS),
    "spot_x": Promised(("spot",), "m", SNAPSHOTS),
    "spot_y": Promised(("spot",), "m", SNAPSHOTS),
    "spot_radius": Promised(("spot",), "m", SNAPSHOTS),
    "spot_force": Promised(("spot",), "N", SNAPSHOTS),
    "contact_modulus": Promised((), "Pa"),
    "surface_energy": Promised((), "J m^-2"),
    "interaction_range": Promised((), "m"),
    "rms_slope": Promised((), "1"),
    "rms_height": Promised((), "m"),
    "period": Promised((), "m"),
    "seed": Promised((), "1"),
    "work": Promised(("step",), "J m^-2", WAY_BACK),
    "stored_energy": Promised(("step",), "J m^-2", WAY_BACK),
    "dissipated_by_jump_in": Promised(("step",), "J m^-2", WAY_BACK),
    "dissipated_by_jump_off": Promised(("step",), "J m^-2", WAY_BACK),
    "dissipated_by_coalescence": Promised(("step",), "J m^-2", WAY_BACK),
    "dissipated_by_load_jump": Promised(("step",), "J m^-2", WAY_BACK),
    "pull_off_pressure": Promised((), "Pa", WAY_BACK),
    "pull_off_separation": Promised((), "m", WAY_BACK),
    "detachment_pressure": Promised((), "Pa", WAY_BACK),
    "hysteresis_loss": Promised((), "J m^-2", WAY_BACK),
    "loss_by_jump_in": Promised((), "J m^-2", WAY_BACK),
    "loss_by_jump_off": Promised((), "J m^-2", WAY_BACK),
    "loss_by_coalescence": Promised((), "J m^-2", WAY_BACK),
    "loss_by_load_jump": Promised((), "J m^-2", WAY_BACK),
    "loss_unattributed": Promised((), "J m^-2", WAY_BACK),
    "event_kind": Promised(("event",), "1", WAY_BACK),
    "event_step": Promised(("event",), "1", WAY_BACK),
    "event_x": Promised(("event",), "m", WAY_BACK),
    "event_y": Promised(("event",), "m", WAY_BACK),
    "event_members": Promised(("event",), "1", WAY_BACK),
}

SURFACE_VARIABLES = {
    "height": Promised(("y", "x"), "m"),
    "x": Promised(("x",), "m"),
    "y": Promised(("y",), "m"),
    "period": Promised((), "m"),
    "grid": Promised((), "1"),
    "seed": Promised((), "1"),
    "rms_slope": Promised((), "1"),
    "rms_height": Promised((), "m"),
    "rms_curvature": Promised((), "m^-1"),
    "spectral_moment_0": Promised((), "m^2"),
    "spectral_moment_2": Promised((), "1"),
    "spectral_moment_4": Promised((), "m^-2"),
    "rolloff_wavelength": Promised((), "m", SYNTHESISED),
    "short_wavelength": Promised((), "m", SYNTHESISED),
    "hurst": Promised((), "1", SYNTHESISED),
    "measured_rms_slope": Promised((), "1", MEASURED),
    "psd_wavevector": Promised(("psd_bin",), "rad m^-1", MEASURED),
    "psd_wavevector_bounds": Promised(("psd_bin", "bound"), "rad m^-1", MEASURED),
    "power_spectrum": Promised(("psd_bin",), "m^4", MEASURED),
}

# Dimensions of every variable of a run in a study of a campaign dataset: those of the run are added.
DESIGN = ("surface", "seed", "rms_slope", "material")
STUDY_VARIABLES = {name: Promised(DESIGN, "1") for name in ("status", "step_count", "failure")} | {
    name: promised._replace(dims=(*DESIGN, *promised.dims))
    for name, promised in RUN_VARIABLES.items()
    if promised.dims == ("step",) and not promised.condition
}

# Global attributes. Those of a campaign are written by the workflow, not by `icha.simulate`.
ATTRIBUTES = {
    RUN: ("title", "summary", "keywords", "Conventions", "source", "history", "processing_level", "references"),
    SURFACE: ("title", "summary", "keywords", "Conventions", "source", "history", "processing_level"),
    CAMPAIGN: (
        *("title", "summary", "keywords", "Conventions", "source", "history", "processing_level", "references"),
        *("campaign", "config_sha256", "license"),
    ),
}
IN_CAMPAIGN = ("campaign", "study", "config_sha256", "license")
_REFUSED_ATTRIBUTES = ("date_created", "date_modified", "date_issued", "creator_email", "user", "host", "hostname")
# A campaign dataset may name its makers, as a publication does.
_MAKERS = ("creator_name", "creator_type", "creator_url", "creator_institution")
_TIME = re.compile(r"\d{4}-\d\d|\d:\d\d")
_BRANCHES = ("loading", "unloading")
_WORDS = ("branch", "step_kind")


def kind_of(path: str | os.PathLike) -> tuple[str, xr.Dataset | xr.DataTree]:
    """What a file is, one of RUN, SURFACE and CAMPAIGN, and its content.

    Raises
    ------
    UnknownFile
        If it is none of them, or cannot be read.
    """
    from icha.datasets.files import read_campaign, read_dataset

    try:
        tree = read_campaign(path)
        if tree.children:
            return CAMPAIGN, tree
        data = read_dataset(path)
    except ValueError as error:
        raise UnknownFile(str(error)) from None
    if "mean_separation" in data and "spot_count" in data and "variant" not in data.dims:
        return RUN, data
    if "height" in data and "period" in data:
        return SURFACE, data
    raise UnknownFile(
        f"{path}: neither a {RUN} (it would have mean_separation) nor a {SURFACE} (height) nor a {CAMPAIGN} (groups)"
    )


def flaws(kind: str, data: xr.Dataset | xr.DataTree) -> list[str]:
    """Everything in which a file does not keep to its format, a line each; empty if all is well.

    Parameters
    ----------
    kind, data : as `kind_of` gives them.
    """
    if kind == CAMPAIGN:
        found = list(_flaws_of_attributes(data.attrs, ATTRIBUTES[CAMPAIGN], refused=_REFUSED_ATTRIBUTES))
        for name, node in data.children.items():
            found += [f"{name}: {flaw}" for flaw in _flaws_of_study(node.to_dataset())]
        return found
    return list(_flaws_of_run(data) if kind == RUN else _flaws_of_surface(data))


def _flaws_of_run(run):
    needed = (*ATTRIBUTES[RUN], *(IN_CAMPAIGN if run.attrs.get("campaign") else ()))
    yield from _flaws_of_attributes(run.attrs, needed)
    there = {SNAPSHOTS: run.sizes.get("snapshot", 0) > 0, WAY_BACK: "hysteresis_loss" in run}
    missing = list(_flaws_of_variables(run, RUN_VARIABLES, there))
    yield from missing
    yield from _flaws_of_numbers(run)
    if missing:
        return
    yield from _flaws_of_steps(run, run)
    steps, snapshots = run.sizes["step"], run.sizes.get("snapshot", 0)
    if snapshots:
        yield from _outside("snapshot_step", run["snapshot_step"].values, 0, steps - 1)
        yield from _outside("spot_snapshot", run["spot_snapshot"].values, 0, snapshots - 1)
        for name in ("gap_bin_edges", "pressure_bin_edges"):
            if not np.all(np.diff(run[name].values) > 0):
                yield f"{name}: do not increase; allowed: edges in increasing order"
        for edges, bins in (("gap_edge", "gap_bin"), ("pressure_edge", "pressure_bin")):
            if run.sizes[edges] != run.sizes[bins] + 1:
                yield f"{edges}: {run.sizes[edges]} edges of {run.sizes[bins]} bins; allowed: one more than bins"
                continue
            own = run[f"{bins}_edges"].values
            if not np.array_equal(run[f"{bins}_bounds"].values, np.column_stack([own[:-1], own[1:]])):
                yield f"{bins}_bounds: are not the edges in {bins}_edges; allowed: lower and upper edge of every bin"


def _flaws_of_steps(data, scalars):
    """Identities and bounds of variables along `step`; NaN, where there may be any, is passed over."""
    yield from _outside("contact_area_fraction", data["contact_area_fraction"].values, 0, 1)
    yield from _outside("spot_count", data["spot_count"].values, 0, np.inf)
    yield from _outside("residual", data["residual"].values, 0, np.inf)
    odd = sorted({str(value) for value in data["branch"].values.ravel()} - {*_BRANCHES, ""})
    if odd:
        yield f"branch: {', '.join(map(repr, odd))}; allowed: {', '.join(_BRANCHES)}"
    unit = scalars["contact_modulus"] * scalars["rms_slope"]
    for name, expected, what in (
        ("reduced_pressure", data["nominal_pressure"] / unit, "nominal_pressure over contact_modulus and rms_slope"),
        ("reduced_separation", data["mean_separation"] / scalars["rms_height"], "mean_separation over rms_height"),
    ):
        error = abs(data[name] - expected)
        scale = float(abs(expected).max()) if expected.size else 0.0
        if expected.size and float(error.max()) > _ROUNDING * scale:
            yield f"{name}: is not {what}, off by up to {float(error.max()):.3g}"


def _flaws_of_surface(surface):
    yield from _flaws_of_attributes(surface.attrs, ATTRIBUTES[SURFACE])
    there = {SYNTHESISED: "hurst" in surface, MEASURED: "source_sha256" in surface.attrs}
    missing = list(_flaws_of_variables(surface, SURFACE_VARIABLES, there))
    yield from missing
    yield from _flaws_of_numbers(surface)
    boundary = surface.attrs.get("boundary", "periodic")
    if boundary not in ("periodic", "free"):
        yield f"attribute boundary: {boundary!r}; allowed: periodic, free"
    if missing:
        return
    grid = int(surface["grid"])
    if surface["height"].shape != (grid, grid):
        yield f"height: is {surface['height'].shape}, and grid is {grid}; allowed: ({grid}, {grid})"


def _flaws_of_study(study):
    yield from _flaws_of_attributes(study.attrs, ("title", "study", "config_sha256", "license"))
    for dim in (*DESIGN, "step"):
        if dim not in study.dims:
            yield f"dimension {dim} is missing"
    missing = list(_flaws_of_variables(study, STUDY_VARIABLES, {}))
    yield from missing
    if missing:
        return
    meanings = study["status"].attrs.get("flag_meanings", "").split()
    yield from _outside("status", study["status"].values, 0, len(meanings) - 1)
    if "complete" not in meanings:
        yield "status: its flag_meanings do not say what is complete"
        return
    complete = study["status"] == meanings.index("complete")
    wanted = complete & (study["step"] < study["step_count"])
    for name, promised in STUDY_VARIABLES.items():
        if "step" in promised.dims and study[name].dtype.kind == "f":
            gaps = int((wanted & ~np.isfinite(study[name])).sum())
            if gaps:
                yield f"{name}: {gaps} values of complete runs are not finite"
    # Runs that are not complete may lack any value.
    numbers = study[[name for name in STUDY_VARIABLES if "step" in study[name].dims and name not in _WORDS]]
    yield from _flaws_of_steps(numbers.reset_coords(drop=True).where(complete).assign(branch=study["branch"]), study)


def _flaws_of_attributes(attributes, needed, refused=(*_REFUSED_ATTRIBUTES, *_MAKERS)) -> Iterator[str]:
    for name in needed:
        if not str(attributes.get(name, "")).strip():
            yield f"attribute {name} is missing"
    for name in refused:
        if name in attributes:
            yield f"attribute {name} is there; allowed: nothing that tells who made a file, where or when"
    if _TIME.search(str(attributes.get("history", ""))):
        yield f"attribute history: {attributes['history']!r}; allowed: no times"
    sha256 = str(attributes.get("config_sha256", ""))
    if sha256 and not re.fullmatch("[0-9a-f]{64}", sha256):
        yield f"attribute config_sha256: {sha256!r}; allowed: 64 hexadecimal digits"
    conventions = str(attributes.get("Conventions", "CF-"))
    if not conventions.startswith("CF-"):
        yield f"attribute Conventions: {conventions!r}; allowed: CF-1.11 or another of CF"


def _flaws_of_variables(data, promised, there) -> Iterator[str]:
    for name, (dims, units, condition) in promised.items():
        if name not in data.variables:
            if not condition or there[condition]:
                yield f"{name} is missing" + (f" in a file with {condition}" if condition else "")
            continue
        variable = data[name]
        if variable.dims != dims:
            yield f"{name}: has the dimensions ({', '.join(variable.dims)}); allowed: ({', '.join(dims)})"
        if variable.attrs.get("units") != units:
            yield f"{name}: has the units {variable.attrs.get('units')!r}; allowed: {units!r}"
    for name, variable in data.variables.items():
        for attribute in ("units", "long_name"):
            if attribute not in variable.attrs:
                yield f"{name}: has no attribute {attribute}"


def _flaws_of_numbers(data) -> Iterator[str]:
    for name, variable in data.variables.items():
        if variable.dtype.kind == "f" and "missing" not in variable.attrs:
            bad = int(np.count_nonzero(~np.isfinite(variable.values)))
            if bad:
                yield f"{name}: {bad} of {variable.size} values are not finite"


def _outside(name, values, least, most) -> Iterator[str]:
    bad = values[(values < least) | (values > most)]
    if bad.size:
        yield f"{name}: {bad[0]:g} is out of range; allowed: {least:g} to {most:g}"
