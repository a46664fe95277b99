"""The section of the documentation on one asperity: words, and a table from the datasets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from pages.tables import table

_TITLE = """## One asperity

On a paraboloid in a periodic cell nothing is rough, so that ICHA's law of an asperity and the effect of its images are
seen alone. The paraboloid is pressed on and, with adhesion, drawn off until its tension is largest. ICHA and boundary
elements are compared at the same approach of the summit to the mean plane, and at the same load.

With adhesion two areas of the boundary elements can stand for contact. The *area of zero gap* is what one sees. The
*energetic area* is the integral of exp(−u/ρ) over the surface: times Δγ it is the energy of adhesion, so that it is
minus the derivative of the energy by Δγ at fixed mean gap. It is the area to compare with that of Johnson, Kendall and
Roberts, whose adhesion has the energy Δγ A. The area of zero gap lacks the cohesive zone, a rim around the contact that
narrows as the range ρ falls, that is as the Tabor parameter μ = (Δγ² R/E\\*²)^⅓/ρ grows. Both areas tend to that of
Johnson, Kendall and Roberts, the energetic one sooner.
"""

_CAPTION = """Errors of ICHA in per cent, least to largest, at approaches of {approaches} and that of pull-off, in
units of (Δγ² R/E\\*²)^⅓, in a cell of side {period:g} in the same; at the same load without pull-off. Errors of areas
are relative, those of the force are over the larger of force and pull-off force, those of the approach over the unit of
length, those of the pull-off force over 3/2 π Δγ R. The grid has n × n nodes; its strength number, (Δγ Δx/E\\*)^½/ρ,
must stay below one half.
"""

_HERTZ = """Without adhesion, contact radii from {least:.2g} to {most:.2g} R on {grid} × {grid} nodes, errors of ICHA in
per cent: area {area} at the same load, {area_at_approach} at the same approach; approach {approach}; force {force}. The
smaller the contact, the less certain is the area of the boundary elements, which is counted in nodes.
"""

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


def section(adhesive: Sequence[xr.Dataset], hertz: xr.Dataset) -> str:
    """The section, in Markdown.

    Parameters
    ----------
    adhesive : datasets of `icha.references.one_asperity.one_asperity`, of different Tabor parameters in any order.
    hertz : dataset of `icha.references.one_asperity.hertz_asperity`.

    Raises
    ------
    ValueError
        If approaches or cells are not the same for all Tabor parameters.
    """
    cases = {(float(one["period"]), tuple(np.round(one["approach"].values[:-1], 6))) for one in adhesive}
    if len(cases) != 1:
        raise ValueError(f"one_asperity: periods and approaches are not the same for all, {sorted(cases)}")
    ((period, approaches),) = cases
    radii = np.sqrt(hertz["area_icha_at_load"].values / np.pi) / float(hertz["radius_of_curvature"])
    numbers = {
        "least": radii.min(),
        "most": radii.max(),
        "grid": int(hertz["grid"]),
        "area": _range(hertz["zero_gap_area_error_at_load"], "{:+.2f}"),
        "area_at_approach": _range(hertz["zero_gap_area_error"], "{:+.2f}"),
        "approach": _range(hertz["approach_error_at_load"], "{:+.2f}"),
        "force": _range(hertz["force_error"], "{:+.2f}"),
    }
    caption = _CAPTION.format(approaches=", ".join(f"{approach:g}" for approach in approaches), period=period)
    return "\n".join([_TITLE, caption, errors(adhesive), _HERTZ.format(**numbers)])


def errors(adhesive: Sequence[xr.Dataset]) -> str:
    """Table of the errors with adhesion, a row for every Tabor parameter."""
    rows = [
        [
            f"{float(one['tabor_parameter']):g}",
            str(int(one["grid"])),
            f"{float(one['strength_number']):.3f}",
            *(_range(one[name], "{:+.1f}") for name in _ERRORS),
        ]
        for one in sorted(adhesive, key=lambda one: float(one["tabor_parameter"]))
    ]
    return table(["μ", "n", "strength number", *_ERRORS.values()], rows)


def _range(error, form):
    """Least to largest of an error, in per cent; one number if they are the same as written, a dash without values."""
    if not error.size:
        return "–"
    ends = [form.format(100 * float(end)) for end in (error.min(), error.max())]
    return " to ".join(dict.fromkeys(end.replace("-", "+") if float(end) == 0 else end for end in ends))
