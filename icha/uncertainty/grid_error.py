"""Errors of boundary elements due to the grid: pull-off and loss of loops, and contact areas at light loads.

When the last patches of a loop break, they are about as large as the length l = (dgamma R^2/E*)^(1/3) of a summit with
the radius of curvature R = 1/`rms_curvature`. The errors of pull-off and loss therefore depend on the number of cells
in this length. `python -m validation.loop_grid` measures all errors; the page docs/short_range.md contains them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import REFERENCE_MODEL
from icha.path.targets import ESTIMATED_OF_LOOPS, OF_SQUARES
from icha.support.formatting import join_first

if TYPE_CHECKING:
    import xarray as xr

LENGTH = "(dgamma R^2/E*)^(1/3)"
# Pull-off and loss are marked if their expected error is larger.
MARKED_ERROR = 0.2


class LoopError(NamedTuple):
    """Relative error of a quantity of loops: exact/computed = 1 + (width/cells)^power, cells of the length l.

    Attributes
    ----------
    words : name of the quantity.
    width : cells with which the computed value is half the exact one.
    power : order of convergence.
    scatter : standard deviation of the error around the law, over surfaces and grids.
    """

    words: str
    width: float
    power: float
    scatter: float

    def at(self, cells: float) -> float:
        """Return the fraction by which the quantity is expected to be too small."""
        return 1 / (1 + (cells / self.width) ** self.power)

    def describe(self, cells: float) -> str:
        """Return the error to be expected, within two standard deviations, as text."""
        if cells < LEAST_MEASURED:
            return f"{self.words} of unknown error"
        ends = (100 * min(max(self.at(cells) + side * self.scatter, 0.0), 1.0) for side in (-2, 2))
        return f"{self.words} {' to '.join(f'{end:.0f}' for end in ends)} % too small"

    @property
    def least_cells(self) -> float:
        """Cells of the length l below which the expected error is larger than `MARKED_ERROR`."""
        return self.width * (1 / MARKED_ERROR - 1) ** (1 / self.power)


# Smallest number of cells in the length l of the loops to which the laws are fitted.
LEAST_MEASURED = 0.6
# Laws that `validation.loop_grid` fits to its loops, by variable. A test compares the laws with the measurements.
LOOP_ERRORS = {
    "pull_off_pressure": LoopError("pull-off", 0.5827, 1.631, 0.0533),
    "hysteresis_loss": LoopError("loss", 2.02, 1.766, 0.103),
}


class AreaError(NamedTuple):
    """Standard deviation of the relative error of contact areas: (width/cells)^power, cells of the whole contact area.

    Attributes
    ----------
    width : cells at which the deviation would be 1.
    power : order of convergence.
    """

    width: float
    power: float

    def at(self, cells: float) -> float:
        """Return the standard deviation of the relative error."""
        return (self.width / cells) ** self.power


# Law that `validation.loop_grid` fits to contact areas at light loads.
AREA_ERROR = AreaError(0.7247, 0.6987)


def length_in_cells(surface_energy, contact_modulus, rms_curvature, spacing):
    """Return the cells in the length l (numbers or arrays, SI units); infinite for a surface without roughness."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.cbrt(surface_energy / contact_modulus / rms_curvature**2) / spacing


def cells_of_length(runs: xr.Dataset) -> xr.DataArray:
    """Return the cells in the length l of a run, or of each run of a study.

    NaN without adhesion, with works of adhesion by direction, for which the errors are not known, and for a surface
    with a shape, because a whole sphere is pulled off such a surface.
    """
    names = ("surface_energy", "contact_modulus", "rms_curvature")
    cells = length_in_cells(*(runs[name] for name in names), runs["period"] / runs["grid"])
    one = runs.get("receding_energy", runs["surface_energy"]) == runs["surface_energy"]
    return cells.where((runs["surface_energy"] > 0) & one & _without_shape(runs))


def _without_shape(runs):
    """Return True for runs whose surface has no shape."""
    return runs["shape"] == "" if "shape" in runs else runs["grid"] > 0


def nodes_of(runs: xr.Dataset) -> xr.DataArray:
    """Return the nodes of the grid of a run, or of each run of a study; NaN for a surface with a shape."""
    return (runs["grid"] ** 2).where(_without_shape(runs))


def cells_of_loops(campaign: xr.DataTree, studies: Iterable[str]) -> dict[tuple[str, str], float]:
    """Return the cells in the length l of the loops of some studies by boundary elements, by material and surface.

    The value is the smallest of all studies, seeds and slopes. Loops without a length (`cells_of_length`) are left out.
    """
    found: dict[tuple[str, str], float] = {}
    for study in (campaign[name].to_dataset() for name in studies if name in campaign.children):
        if "hysteresis_loss" not in study or REFERENCE_MODEL not in study["model"].values:
            continue
        runs = study.sel(model=REFERENCE_MODEL)
        cells = cells_of_length(runs).where(runs["hysteresis_loss"].notnull()).min(("seed", "rms_slope"))
        for contact, each in cells.transpose("material", "surface").to_series().dropna().items():
            found[contact] = min(float(each), found.get(contact, math.inf))
    return found


def _two_digits(value):
    return f"{float(f'{value:.2g}'):g}"


def _describe(cells, contact):
    """Return the number of cells in the length l of a contact, and the errors to be expected, as text."""
    errors = ", ".join(law.describe(cells) for law in LOOP_ERRORS.values())
    return f"{_two_digits(cells)} cells for {contact} ({errors})"


def describe_loops(loops: Mapping[tuple[str, str], float]) -> str:
    """Return a sentence on the error of loops; `loops` are the cells in the length l by material and surface.

    The sentence begins with the coarsest loops, and names only some of them.
    """
    coarsest = sorted(loops.items(), key=lambda item: item[1])
    contacts = (_describe(cells, f"{material} on {surface}") for (material, surface), cells in coarsest)
    least = " and ".join(f"{law.words} with fewer than {law.least_cells:.2g} cells" for law in LOOP_ERRORS.values())
    return (
        f"in loops by boundary elements, the length {LENGTH} of a summit has {join_first(contacts, '; ')}; figures "
        f"show {least} in pale colours, because the error exceeds {100 * MARKED_ERROR:.0f} %"
    )


def is_resolved(loops: Mapping[tuple[str, str], float]) -> bool:
    """Return True if all expected errors are at most `MARKED_ERROR`; `loops` are those of `describe_loops`."""
    return min(loops.values(), default=math.inf) >= max(law.least_cells for law in LOOP_ERRORS.values())


def error_of_area(patches: float, cells: float) -> tuple[float, str]:
    """Return the expected relative error of a contact area, and a text.

    Parameters
    ----------
    patches : number of contact patches.
    cells : contact area in cells.
    """
    error = AREA_ERROR.at(cells)
    size = f"{patches:.0f} contact patch{'es' if round(patches) != 1 else ''} of {cells / patches:.0f} cells"
    return error, f"areas of {size} have an error of about {_two_digits(100 * error)} % and are more often too small"


def error_beyond(known: float, quantity: str, length: float, patches: float, cells: float) -> str:
    """Return words on the error of the grid if the interval of an estimate does not contain this error, else "".

    Parameters
    ----------
    known : error of the grid in the interval, relative to the estimate; NaN if the interval contains none.
    quantity : name of the quantity.
    length : cells in the length l; NaN if it is not defined.
    patches, cells : number of patches and contact area in cells; NaN for a quantity of a loop.
    """
    known = 0.0 if math.isnan(known) else known
    if quantity in LOOP_ERRORS and not math.isnan(length):
        law = LOOP_ERRORS[quantity]
        words = f"with {_two_digits(length)} cells in {LENGTH}, {law.describe(length)} on other surfaces"
        return "" if known >= law.at(length) else f"on this grid, whose error is not known; {words}"
    if quantity in (*ESTIMATED_OF_LOOPS, *OF_SQUARES):
        return "" if known else "on this grid, whose error is not known"
    if quantity == "contact_area_fraction" and known < (error := error_of_area(patches, cells))[0]:
        return f"on this grid, {error[1]}"
    return ""
