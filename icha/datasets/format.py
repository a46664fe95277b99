"""The documented format of the files that users rely on, and what of a file does not keep to it.

Some names of the vocabulary are promised, with their dimensions and units; a file may have more variables, of which
every one has its units and its long name, too.
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.contact.models import MODELS
from icha.datasets.files import has_groups, is_refused, read_campaign, read_dataset
from icha.datasets.labels import LABELS
from icha.support.input_files import bounded_memory, most_memory, problem_with_path, refuse_traps, require_room

RUN, SURFACE, CAMPAIGN = "run dataset", "surface file", "campaign dataset"
SOLUTION = "solution by boundary elements at a finite range"
# Kinds whose format is not promised, by a variable that no other kind has.
_OTHERS = {
    "comparison of runs at common loads": "seed_count",
    "error of the model": "area_error",
    "theories and published points": "bush_gibson_thomas_area_fraction",
    SOLUTION: "target_reduced_pressure",
    "boundary elements both ways at a finite range": "dissipated",
}

# A number of the identities of the format may be off by rounding.
_ROUNDING = 1e-9
# Dimensions of every variable of a run in a study of a campaign dataset: those of the run are added.
DESIGN = LABELS
# Values asked for have the unit of what is asked for, where that is the same of all.
_UNITS_OF_TARGETS = dict.fromkeys(("step_target", "snapshot_target"), ("1", "m"))
# Global attributes. Those of a campaign are written by the workflow, not by `icha.simulate`.
_EVERYWHERE = ("title", "summary", "keywords", "Conventions", "source", "history", "processing_level")
ATTRIBUTES = {
    RUN: (*_EVERYWHERE, "references", "contact_model"),
    SURFACE: _EVERYWHERE,
    CAMPAIGN: (*_EVERYWHERE, "references", "campaign", "config_sha256", "license"),
}
IN_CAMPAIGN = ("campaign", "study", "config_sha256", "license")
_REFUSED_ATTRIBUTES = ("date_created", "date_modified", "date_issued", "creator_email", "user", "host", "hostname")
# A campaign dataset may name its makers, as a publication does.
_MAKERS = ("creator_name", "creator_type", "creator_url", "creator_institution")
_TIME = re.compile(r"\d{4}-\d\d|\d:\d\d")
_BRANCHES = ("loading", "unloading")
_WORDS = ("branch", "step_kind")


class UnknownFile(ValueError):
    """A file that is none of those that are documented, or no readable netCDF file at all."""


class Promise(NamedTuple):
    """A variable that is promised: its name, dimensions and unit, and the condition under which a file has it."""

    name: str
    dims: tuple[str, ...]
    units: str
    condition: str


def _promised() -> dict[str, list[Promise]]:
    """Promised variables by the kind of file, as `promised_variables.txt` lists them."""
    found: dict[str, list[Promise]] = {}
    for line in Path(__file__).with_name("promised_variables.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            of_kind = found.setdefault(line.strip("[]"), [])
        elif match := re.fullmatch(r"(\w+)\((.*?)\) ([^;]+)(?:; (.+))?", line):
            name, dims, units, condition = match.groups()
            of_kind.append(Promise(name, tuple(filter(None, dims.split(", "))), units, condition or ""))
    return found


PROMISED = _promised()
_OF_STUDY = [Promise(name, DESIGN, "1", "") for name in ("status", "step_count", "failure")] + [
    each._replace(dims=(*DESIGN, "step")) for each in PROMISED[RUN] if each.dims == ("step",) and not each.condition
]


def kind_of(path: str | os.PathLike) -> tuple[str, xr.Dataset | xr.DataTree]:
    """What a file is, and its content: RUN, SURFACE, CAMPAIGN, or another kind, of which no format is promised.

    Raises
    ------
    UnknownFile
        If it is none of them, or cannot be read.
    """
    if problem := problem_with_path(path):
        raise UnknownFile(f"{path}: {problem}; allowed: a file")
    if not os.path.getsize(path):
        raise UnknownFile(f"{path}: the file is empty")
    try:
        most = most_memory(path)
        with bounded_memory(most):
            refuse_traps(path)
            data = read_campaign(path) if has_groups(path) else read_dataset(path)
        if isinstance(data, xr.DataTree):
            # Large arrays are still in the file, and read when they are used.
            require_room(sum(node.to_dataset(inherit=False).nbytes for node in data.subtree), most)
    except Exception as error:  # whatever the libraries raise for files that are damaged or of another kind
        reason = str(error).removeprefix(f"{path}: ")
        raise UnknownFile(f"{path}: {reason}") from None
    groups = [data] if isinstance(data, xr.Dataset) else [node.to_dataset() for node in data.children.values()]
    for kind, variable in _OTHERS.items():
        if all(variable in group.variables for group in groups):
            return kind, data
    if isinstance(data, xr.DataTree):
        return CAMPAIGN, data
    if "mean_separation" in data and "spot_count" in data:
        return RUN, data
    if "height" in data and "period" in data:
        return SURFACE, data
    raise UnknownFile(
        f"{path}: neither a {RUN} (it would have mean_separation) nor a {SURFACE} (height) nor a {CAMPAIGN} (groups), "
        f"nor another file that ICHA writes"
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
    model, kept = run.attrs.get("contact_model", ""), run.sizes.get("snapshot", 0) > 0
    if model and model not in MODELS:
        yield f"attribute contact_model: {model!r}; allowed: {', '.join(MODELS)}"
    by_patches = model in MODELS and MODELS[model].by_cells
    there = {
        "snapshots": kept,
        "a way back to separation": "hysteresis_loss" in run,
        "boundary elements": by_patches,
        "snapshots of boundary elements": by_patches and kept,
    }
    missing = list(_flaws_of_variables(run, PROMISED[RUN], there))
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
    there = {"a spectrum": "hurst" in surface, "a measurement": "source_sha256" in surface.attrs}
    missing = list(_flaws_of_variables(surface, PROMISED[SURFACE], there))
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
    missing = list(_flaws_of_variables(study, _OF_STUDY, {}))
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
    along = [each.name for each in _OF_STUDY if "step" in each.dims]
    for name in along:
        if study[name].dtype.kind == "f":
            gaps = int((wanted & ~np.isfinite(study[name])).sum())
            if gaps:
                yield f"{name}: {gaps} values of complete runs are not finite"
    # Runs that are not complete may lack any value.
    numbers = study[[name for name in along if name not in _WORDS]]
    numbers = numbers.reset_coords(["reduced_pressure", "reduced_separation"]).reset_coords(drop=True)
    yield from _flaws_of_steps(numbers.where(complete).assign(branch=study["branch"].variable), study)


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
    """Of promised variables, and of all that a file has; `there` says which conditions a file meets."""
    for name, dims, units, condition in promised:
        if name not in data.variables:
            if not condition or there[condition]:
                yield f"{name} is missing" + (f" in a file with {condition}" if condition else "")
            continue
        variable = data[name]
        if variable.dims != dims:
            yield f"{name}: has the dimensions ({', '.join(variable.dims)}); allowed: ({', '.join(dims)})"
        allowed = _UNITS_OF_TARGETS.get(name, (units,))
        if variable.attrs.get("units") not in allowed:
            yield f"{name}: has the units {variable.attrs.get('units')!r}; allowed: {', '.join(map(repr, allowed))}"
    for name, variable in data.variables.items():
        for attribute in ("units", "long_name"):
            if attribute not in variable.attrs:
                yield f"{name}: has no attribute {attribute}"


def _flaws_of_numbers(data) -> Iterator[str]:
    for name, variable in data.variables.items():
        if variable.dtype.kind == "f" and "missing" not in variable.attrs:
            bad = int(np.count_nonzero(is_refused(variable.values, variable.attrs)))
            if bad:
                yield f"{name}: {bad} of {variable.size} values are not finite"


def _outside(name, values, least, most) -> Iterator[str]:
    bad = values[(values < least) | (values > most)]
    if bad.size:
        yield f"{name}: {bad[0]:g} is out of range; allowed: {least:g} to {most:g}"
