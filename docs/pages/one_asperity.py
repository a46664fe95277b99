"""Numbers of the section on one asperity, from the datasets of `icha.references.one_asperity`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from pages.tables import Table

# The columns of errors: of what, and where, by the name of the variable.
_ERRORS = {
    "zero_gap_area_error": "area over zero gap, same approach",
    "zero_gap_area_error_at_load": "area over zero gap, same load",
    "energetic_area_error": "area over energetic, same approach",
    "energetic_area_error_at_load": "area over energetic, same load",
    "force_error": "force, same approach",
    "approach_error_at_load": "approach, same load",
    "pull_off_error": "pull-off force",
}


def cell(adhesive: Sequence[xr.Dataset]) -> dict:
    """Side of the cell and approaches, the same for all Tabor parameters.

    Raises
    ------
    ValueError
        If they are not.
    """
    cases = {(float(one["period"]), tuple(np.round(one["approach"].values[:-1], 6))) for one in adhesive}
    if len(cases) != 1:
        raise ValueError(f"one_asperity: periods and approaches are not the same for all, {sorted(cases)}")
    ((period, approaches),) = cases
    return {"period": f"{period:g}", "approaches": [f"{approach:g}" for approach in approaches]}


def without_adhesion(hertz: xr.Dataset) -> dict:
    """Range of contact radii over that of curvature, and errors in per cent, of `hertz_asperity`."""
    radii = np.sqrt(hertz["area_icha_at_load"].values / np.pi) / float(hertz["radius_of_curvature"])
    return {
        "least": f"{radii.min():.2g}",
        "most": f"{radii.max():.2g}",
        "grid": int(hertz["grid"]),
        "area": _range(hertz["zero_gap_area_error_at_load"], "{:+.2f}"),
        "area_at_approach": _range(hertz["zero_gap_area_error"], "{:+.2f}"),
        "approach": _range(hertz["approach_error_at_load"], "{:+.2f}"),
        "force": _range(hertz["force_error"], "{:+.2f}"),
    }


def errors(adhesive: Sequence[xr.Dataset]) -> Table:
    """Errors with adhesion, a row for every Tabor parameter."""
    rows = [
        [
            f"{float(one['tabor_parameter']):g}",
            str(int(one["grid"])),
            f"{float(one['strength_number']):.3f}",
            *(_range(one[name], "{:+.1f}") for name in _ERRORS),
        ]
        for one in sorted(adhesive, key=lambda one: float(one["tabor_parameter"]))
    ]
    return Table(["μ", "n", "strength number", *_ERRORS.values()], rows)


def _range(error, form):
    """Least to largest of an error, in per cent; one number if they are the same as written, a dash without values."""
    if not error.size:
        return "–"
    ends = [form.format(100 * float(end)) for end in (error.min(), error.max())]
    return " to ".join(dict.fromkeys(end.replace("-", "+") if float(end) == 0 else end for end in ends))
