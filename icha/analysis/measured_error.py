"""State the error of the asperity model that a campaign has measured, study by study."""

import numpy as np
import xarray as xr

from icha.analysis.left_out import NOT_COMPARED, NOT_REQUESTED, LeftOut, find_left_out
from icha.analysis.validity import Statement, statements_on_dataset
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.variables.campaign import COMPLETE, NOT_IN_DESIGN
from icha.support.formatting import format_count

_QUANTITIES = {"area_error": "contact area", "separation_error": "mean separation"}


def measured_errors(model_error: xr.DataTree) -> dict[str, Statement]:
    """Return a statement for each study whose error is measured, by name of the study.

    Parameters
    ----------
    model_error : result of `icha.analysis.model_error.model_error`.
    """
    found = {}
    for name, node in model_error.children.items():
        errors = node.to_dataset()
        if not np.isfinite(errors["area_error"]).any():
            continue
        known = np.isfinite(errors["area_error"])
        good = known & (errors["applicability"] == "")
        shown = good if good.any() else known
        ranges = ", ".join(
            f"{words} {_range(errors[variable].where(shown).values)}" for variable, words in _QUANTITIES.items()
        )
        seeds = int(shown.any([dim for dim in known.dims if dim != "seed"]).sum())
        loads = errors.sizes["reduced_pressure"]
        among = f"{seeds} {'seed' if seeds == 1 else 'seeds'}, {loads} {'load' if loads == 1 else 'loads'}"
        if others := int((known & ~good).any("reduced_pressure").sum()):
            among += f"; without {format_count(others, 'run')}" if good.any() else "; all in runs"
            among += " to which the model is not applicable"
        among += f"; {words}" if (words := left_out_runs(errors).sentence) else ""
        found[name] = Statement(
            "error", f"of the asperity model in study {name}: {ranges} ({among}, boundary elements)"
        )
    return found


def statements_on_results(campaign: xr.DataTree, model_error: xr.DataTree | None) -> list[Statement]:
    """Return statements on the validity of the models, with the measured errors of the asperity model first.

    If all studies with the asperity model have a measured error, the statement on the accuracy on other surfaces is
    left out. `model_error` is None if no study has both models.
    """
    measured = {} if model_error is None else measured_errors(model_error)
    with_asperities = {name for name, node in campaign.children.items() if DEFAULT_MODEL in node["model"].values}
    statements = statements_on_dataset(campaign)
    if with_asperities <= measured.keys():
        statements = [each for each in statements if each.about != "accuracy"]
    return [*measured.values(), *statements]


def left_out_runs(errors: xr.Dataset) -> LeftOut:
    """Describe the requested runs of a study for which the models are not compared at any load."""
    status = errors["status"].values.ravel()
    causes = np.select([status == NOT_IN_DESIGN, status != COMPLETE], [NOT_REQUESTED, NOT_COMPARED], "")
    return find_left_out("pairs of runs", causes)


def _range(values: np.ndarray) -> str:
    """Return the range of relative errors in per cent, such as `11 to 18 % too small`."""
    low, high = 100 * np.nanmin(values), 100 * np.nanmax(values)
    if high <= 0:
        return f"{-high:.0f} to {-low:.0f} % too small"
    if low >= 0:
        return f"{low:.0f} to {high:.0f} % too large"
    return f"from {-low:.0f} % too small to {high:.0f} % too large"
