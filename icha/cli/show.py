"""The command `icha show`: print a summary of a file, with its main numbers."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo
from icha.support.formatting import format_count, printable

_UNIT_OF_SHAPES = (
    "with a shape, reduced pressures are in units of E* times `unit_slope`: the rms height of the shape over the side "
    "of the square, not the rms slope of the roughness"
)
_REDUCED = ("reduced_pressure", "reduced_separation", "largest_reduced_pressure")
_ATTRIBUTES = ("summary", "campaign", "study", "contact_model", "boundary", "shape", "source_file", "preparation")


def show(file: Annotated[Path, typer.Argument(help="A run, surface or campaign dataset (.nc).")]) -> None:
    """Print a summary of a run, a surface or a campaign dataset, with the values or ranges of its quantities."""
    from icha.datasets.format import CAMPAIGN, RUN, SURFACE, UnknownFile, identify_file

    try:
        kind, data = identify_file(file)
    except UnknownFile as error:
        raise UserError(str(error)) from None
    if kind not in (RUN, SURFACE, CAMPAIGN):
        raise UserError(f"{file}: {kind}; expected a run, a surface or a campaign dataset. Try `ncdump -h`")
    try:
        lines = list(_campaign(data) if kind == CAMPAIGN else _dataset(data))
    except (AttributeError, LookupError, TypeError, ValueError) as error:  # a file that another program wrote
        raise UserError(f"{file}: {kind} of another format ({error!r}); `icha check` lists the problems") from None
    for line in (f"{file}: {data.attrs.get('title', kind)}", *lines):
        echo(printable(line), fg="red" if line.startswith(("failed:", "warning:")) else None)


def _dataset(data) -> Iterator[str]:
    """Yield the main attributes of a run or a surface, and its quantities; measured surfaces have measured values."""
    from icha.datasets.attributes import why_failed

    yield from (f"{name.replace('_', ' ')}: {data.attrs[name]}" for name in _ATTRIBUTES if data.attrs.get(name))
    reasons = {"failed": why_failed(data.attrs), "warning": data.attrs.get("applicability")}
    yield from (f"{name}: {reason}" for name, reason in reasons.items() if reason)
    if "measured_rms_slope" in data:
        scale = data["measured_rms_slope"] / data["rms_slope"]
        yield "as measured, before scaling to another rms slope:"
        yield from _quantities(data[["rms_height", "rms_slope"]].map(lambda values: values * scale, keep_attrs=True))
        yield "as stored:"
    # A smooth shape has no roughness, whose height and slope are the reduced units.
    smooth = "unit_height" in data and not data["rms_height"]
    shaped = "shape" in data
    yield from _quantities(data.drop_vars(_REDUCED if smooth else (), errors="ignore"), shaped=shaped)
    if shaped and "reduced_pressure" in data and not smooth:
        yield _UNIT_OF_SHAPES
    if "pull_off_force_over_jkr" in data:
        from icha.references.indenter_runs import BRANCHES, reason_without_fit

        reasons = {branch: reason_without_fit(data, branch) for branch in BRANCHES}
        yield from (f"work of adhesion on {branch}: no fit ({reason})" for branch, reason in reasons.items() if reason)


def _quantities(data, *, shaped=False) -> Iterator[str]:
    """Yield the words for, and the value or range of, the numbers of a dataset and its values along steps.

    With a shape (`shaped`), the units of reduced quantities are not those of the roughness.
    """
    import numpy as np

    from icha.datasets.quantities import quantity

    for name, variable in data.variables.items():
        if variable.dtype.kind not in "fiu" or variable.dims not in ((), ("step",)):
            continue
        values = variable.values[~np.isnan(variable.values)]
        if not values.size:
            continue
        unit = variable.attrs.get("units", "1")
        words = quantity(str(name))._replace(unit=unit)
        largest = float(abs(values).max())
        # A prefix on a power of a unit would be ambiguous.
        prefixed = math.isfinite(largest) and "^" not in unit.split(" ")[0]
        factor, unit = words.in_unit(largest) if prefixed else (1.0, unit.removeprefix("1"))
        ends = dict.fromkeys(f"{value * factor:.4g}" for value in (values.min(), values.max()))
        # The words for quantities without a symbol are for legends of figures.
        symbol = words.text
        if shaped and name in _REDUCED:
            symbol = symbol.replace("h'rms", " unit_slope ").replace("h_rms", "unit_height")
        label = f"{words.name} {symbol}" if words.symbol else variable.attrs.get("long_name", words.name)
        numbers = f"{' to '.join(ends)} {unit}"
        yield f"{name:<35} {numbers:<27} {label}"


def _campaign(tree) -> Iterator[str]:
    """Yield, for each study of a campaign, its size, models, number of failed runs and ranges of results."""
    from xarray import Dataset

    from icha.datasets.attributes import reasons_not_applicable
    from icha.datasets.labels import LABELS
    from icha.datasets.variables.campaign import LOADED_RUNS, STATUS_MEANINGS
    from icha.uncertainty.left_out import left_out_of_study

    yield " ".join(str(tree.attrs.get("summary", "")).split())
    for name, node in tree.children.items():
        study = node.to_dataset()
        status = study["status"]
        counts = {meaning: int((status == k).sum()) for k, meaning in enumerate(STATUS_MEANINGS)}
        words = ", ".join(f"{count} {meaning}" for meaning, count in counts.items() if count)
        yield f"{name}: {', '.join(f'{study.sizes[dim]} {dim}' for dim in LABELS)}; {words}"
        results = study[["contact_area_fraction", "reduced_pressure"]].where(status.isin(LOADED_RUNS))
        flat = Dataset(
            {
                key: ("step", values.values.ravel(), values.attrs)
                for key, values in results.variables.items()
                if values.ndim > 2
            }
        )
        yield f"  models {', '.join(study['model'].values)}"
        shaped = "shape" in study and bool((study["shape"] != "").any())
        yield from (f"  {line}" for line in _quantities(flat, shaped=shaped))
        if shaped:
            yield f"  {_UNIT_OF_SHAPES}"
        if sentence := left_out_of_study(study).sentence:
            yield f"  results are of {sentence}"
        if reasons := reasons_not_applicable(study):
            first = ". ".join(list(reasons)[:3])
            yield f"  model not applicable to {format_count(reasons.total(), 'run')}: {first}"
