"""Identify the kinds of files that ICHA writes, and compare files with their documented format.

The tables of `icha.datasets.variables` describe the format of runs, surfaces and campaigns. A file may have other
variables too, which must have units and a long name.
"""

import os
import re
from collections.abc import Iterator

import numpy as np
import xarray as xr

from icha.contact.models import MODELS
from icha.datasets.files import has_groups, read_campaign, read_dataset
from icha.datasets.labels import LABELS
from icha.datasets.variables import run as of_run
from icha.datasets.variables.campaign import CAMPAIGN as CAMPAIGN_TABLE
from icha.datasets.variables.surface import TABLES as SURFACE_TABLES
from icha.datasets.variables.terms import Table, is_refused
from icha.support.input_files import bounded_memory, most_memory, problem_with_path, refuse_traps, require_room

RUN, SURFACE, CAMPAIGN = "run dataset", "surface file", "campaign dataset"
# Kinds of files whose format may change in later versions, each with a variable that no other kind has.
_OTHERS = {
    "comparison of runs at common loads": "seed_count",
    "error of the model": "area_error",
    "answers of studies": "estimate_low",
    "sampled cases of studies": "effect_value",
    "theories and published points": "bush_gibson_thomas_area_fraction",
}

# A file must not have attributes with these words in their names, because the same input must give the same bytes.
_REFUSED = re.compile("user|host|mail|date|time")
# Values that must be equal may differ by this relative difference, due to rounding.
_ROUNDING = 1e-9
# Units that targets may have: those of pressures, forces and lengths; 1 for other quantities and for several kinds.
_UNITS_OF_TARGETS = dict.fromkeys(("step_target", "snapshot_target"), ("1", "m", "Pa", "N"))


class UnknownFile(ValueError):
    """A file that ICHA does not write, or that is not a readable netCDF file."""


# Variables of a study: first the variables that list the runs, then the variables along the steps of every run.
_STUDY = {name: CAMPAIGN_TABLE[name] for name in ("status", "step_count", "failure")} | {
    name: each._replace(dims=(*LABELS, "step"))
    for name, each in of_run.RUN.items()
    if each.dims == ("step",) and name != "step"
}


def identify_file(path: str | os.PathLike) -> tuple[str, xr.Dataset | xr.DataTree]:
    """Return the kind and the content of a file; the kind is RUN, SURFACE, CAMPAIGN or a kind from `_OTHERS`.

    Raise UnknownFile if the file is of another kind, or cannot be read.
    """
    if problem := problem_with_path(path):
        raise UnknownFile(f"{path}: {problem}; expected a file")
    if not os.path.getsize(path):
        raise UnknownFile(f"{path}: the file is empty")
    try:
        most = most_memory(path)
        with bounded_memory(most):
            refuse_traps(path)
            data = read_campaign(path) if has_groups(path) else read_dataset(path)
        if isinstance(data, xr.DataTree):
            # Large arrays stay in the file until they are used.
            require_room(sum(node.to_dataset(inherit=False).nbytes for node in data.subtree), most)
    except Exception as error:  # libraries raise various errors for damaged files and for files of another kind
        reason = str(error).removeprefix(f"{path}: ")
        raise UnknownFile(f"{path}: {reason}") from None
    groups = [data] if isinstance(data, xr.Dataset) else [node.to_dataset() for node in data.children.values()]
    for kind, variable in _OTHERS.items():
        if all(variable in group.variables for group in groups):
            return kind, data
    if isinstance(data, xr.DataTree):
        return CAMPAIGN, data
    for kind, names in ((RUN, ("mean_separation", "spot_count")), (SURFACE, ("height", "period"))):
        if all(name in data for name in names):
            return kind, data
    raise UnknownFile(
        f"{path}: not a file that ICHA writes; expected a {RUN} (with mean_separation), a {SURFACE} (height) or a "
        f"{CAMPAIGN} (groups)"
    )


def problems_with_file(kind: str, data: xr.Dataset | xr.DataTree) -> list[str]:
    """List the differences between a file and its documented format, one line each; empty without any."""
    problems = [
        f"attribute {name}: states by whom, where or when the file was made; expected no such attribute"
        for name in data.attrs
        if _REFUSED.search(name)
    ]
    if kind == CAMPAIGN:
        studies = {name: node.to_dataset() for name, node in data.children.items()}
        return problems + [
            f"{name}: {each}" for name, study in studies.items() for each in _problems_with_variables(study, _STUDY)
        ]
    of_kind = _problems_with_run if kind == RUN else _problems_with_surface
    return [*problems, *of_kind(data), *_problems_with_numbers(data)]


def _problems_with_run(run: xr.Dataset) -> Iterator[str]:
    model = run.attrs.get("contact_model")
    if model not in MODELS:
        yield f"attribute contact_model: {model!r}; expected {' or '.join(MODELS)}"
    tables = [of_run.RUN | of_run.FURTHER.get(model, {}), of_run.CYCLE, of_run.LOOP]
    tables += [of_run.LAYER, of_run.ADHESION_MAP]
    # A run on a free square has only some of these variables.
    tables.append({name: described for name, described in of_run.INDENTER.items() if name in run})
    if problems := list(_problems_with_variables(run, *tables)):
        yield from problems
        return
    unit = run["contact_modulus"] * run["unit_slope"]
    for name, expected, formula in (
        ("reduced_pressure", run["nominal_pressure"] / unit, "nominal_pressure/(contact_modulus unit_slope)"),
        ("reduced_separation", run["mean_separation"] / run["unit_height"], "mean_separation/unit_height"),
    ):
        error = abs(run[name] - expected)
        if expected.size and float(error.max()) > _ROUNDING * float(abs(expected).max()):
            yield f"{name}: differs from {formula} by up to {float(error.max()):.3g}; expected equal values"


def _problems_with_surface(surface: xr.Dataset) -> Iterator[str]:
    problems = list(_problems_with_variables(surface, *SURFACE_TABLES))
    yield from problems
    if not problems and surface["height"].shape != (grid := int(surface["grid"]), grid):
        yield f"height: has the shape {surface['height'].shape}; expected ({grid}, {grid}), because `grid` is {grid}"


def _problems_with_variables(data: xr.Dataset, table: Table, *further: Table) -> Iterator[str]:
    """Yield problems with variables of `table`, and of each `further` table of which the file has a variable."""
    for each in further:
        if each.keys() & data.variables.keys():
            table = table | each
    for name, described in table.items():
        if name not in data.variables:
            # For example, a run without snapshots has no variables along `snapshot`.
            if set(described.dims) <= set(data.dims):
                yield f"{name} is missing"
            continue
        variable = data[name]
        if variable.dims != described.dims:
            yield f"{name}: has the dimensions ({', '.join(variable.dims)}); expected ({', '.join(described.dims)})"
        expected = _UNITS_OF_TARGETS.get(name, (described.units,))
        if variable.attrs.get("units") not in expected:
            yield f"{name}: has the units {variable.attrs.get('units')!r}; expected {' or '.join(map(repr, expected))}"
    for name, variable in data.variables.items():
        for attribute in ("units", "long_name"):
            if attribute not in variable.attrs:
                yield f"{name}: has no attribute {attribute}"


def _problems_with_numbers(data: xr.Dataset) -> Iterator[str]:
    for name, variable in data.variables.items():
        if variable.dtype.kind == "f" and "missing" not in variable.attrs:
            bad = int(np.count_nonzero(is_refused(variable.values, variable.attrs)))
            if bad:
                yield f"{name}: {bad} of {variable.size} values are not finite"
