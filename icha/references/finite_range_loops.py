"""Loading and unloading with boundary elements at a finite range; surfaces are apart at both ends of the loop.

The mean gap is prescribed, as in a stiff testing machine. Each solution starts from the last solution and therefore
stays on the same branch until the branch ends. At the end of a branch the surfaces jump, and the jump loses energy. The
work done on the contact is minus the integral of the nominal pressure over the mean gap, by the trapezoidal rule. The
work differs from the change of the stored energy by the energy that jumps dissipate, and by the error of the
trapezoidal rule. A step is halved if its work differs too much from the change of the stored energy. A step is halved
at most five times, so the position of a jump within the smallest step remains unknown.
"""

import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from icha.asperity.material import Material
from icha.datasets.build import build_dataset
from icha.datasets.variables.boundary_elements import LOOP
from icha.references.finite_range import (
    DEFAULT_TOLERANCE,
    GapContact,
    NotSolved,
    attributes,
    describe_problem,
    perimeter_correction,
    refine,
)
from icha.support.rules import POSITIVE, TOLERANCE
from icha.surfaces.surface import Surface

# Surfaces are apart if every gap exceeds this number of ranges. Attraction is then at most 0.7 % of the strength.
_APART = 5.0
# Mean gap at the start of the loop minus the height of the highest summit, in ranges of attraction.
_START = 6.0
# A step is halved, at most _MAX_HALVINGS times, if its work error exceeds _WORK_TOLERANCE times the surface energy.
_WORK_TOLERANCE = 1e-4
_MAX_HALVINGS = 5
# The search for the largest load stops at this relative error or, for a load in a jump, after _MAX_LOAD_SEARCHES tries.
_LOAD_TOLERANCE = 1e-3
_MAX_LOAD_SEARCHES = 12
# A loop with more solutions than this is aborted.
_MAX_SOLVES = 5000


def finite_range_loop(
    surface: Surface,
    material: Material,
    *,
    largest_reduced_pressure: float,
    separation_step: float,
    refinement: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Compute a loop with Tamaas: load separated surfaces, then unload them until they separate; return the dataset.

    Parameters
    ----------
    surface, material, refinement, tolerance, seed, progress : as for
        `icha.references.finite_range.finite_range_solution`.
    largest_reduced_pressure : p/(E* h'_rms) at which unloading begins, positive; a final jump may exceed it.
    separation_step : largest step of the mean gap, in h_rms; a step with a jump is divided into up to 32 smaller steps.

    Returns
    -------
    xarray.Dataset of `icha.datasets.variables.boundary_elements.LOOP`. At the first and at the last `step`, the
    surfaces are apart at the same mean gap. The work is zero at the first step.

    Raises
    ------
    ValueError
        If an argument is out of range, or the grid does not resolve the attraction.
    NotSolved
        If the solver does not reach its tolerance, or the load is not reached; the message describes the last state.
    """
    target = POSITIVE.validate("largest_reduced_pressure", largest_reduced_pressure)
    step = POSITIVE.validate("separation_step", separation_step) * surface.rms_height
    fine = refine(surface, material, refinement)
    solver = _LoopSolver(fine, material, TOLERANCE.validate("tolerance", tolerance))
    legs = _load_and_unload(solver, step, target * surface.rms_slope * material.contact_modulus, progress)
    return _dataset(surface, solver, legs, separation_step, seed)


class _LoopSolver:
    """Solver of the states of a loop; each solution starts from the last state."""

    def __init__(self, fine, material, tolerance):
        self.fine, self.material, self.tolerance = fine, material, tolerance
        self.contact = GapContact(fine, material, tolerance)
        adhesive = material.surface_energy > 0
        self.work_tolerance = _WORK_TOLERANCE * material.surface_energy if adhesive else math.inf
        self.range = material.interaction_range if adhesive else 0.0

    def solve_from_undeformed(self, separation):
        """Return the state at a mean gap in m; the solver starts from the undeformed surfaces."""
        return self.solve(separation - self.fine.heights, separation)

    def is_apart(self, state):
        """Return True if no node is in contact and the attraction is negligible everywhere."""
        return not state.contact.any() and state.gap.min() >= _APART * self.range

    def solve(self, gap, separation):
        """Return the state at a mean gap in m; the solver starts from the gaps of another state, in m."""
        if self.contact.solves >= _MAX_SOLVES:
            raise NotSolved(
                f"the loop has not ended after {self.contact.solves} solutions; use a larger separation_step"
            )
        self.contact.start_from(gap)
        return self.contact.solve(separation)

    def steps(self, state, separation, halvings=_MAX_HALVINGS):
        """Yield the states from `state` to a mean gap in m; a step is halved until the work of the step is accurate."""
        after = self.solve(state.gap, separation)
        if halvings == 0 or self.work_error(state, after) <= self.work_tolerance:
            yield after
            return
        for middle in self.steps(state, (state.mean_separation + separation) / 2, halvings - 1):
            yield middle
        yield from self.steps(middle, separation, halvings - 1)

    def work_error(self, before, after):
        """Return the error of the work of a step, J/m^2: the smaller of two estimates.

        In a step without a jump the error is the work minus the change of the stored energy. In a step with a jump the
        error is at most half the change of the pressure times the step.
        """
        records = [self.record(before), self.record(after)]
        return min(abs(_dissipated(records)[0]), _jump_position_error(records)[0])

    def total_work_error(self, records):
        """Return the work error of all steps in J/m^2: dissipation in steps without jumps, plus errors due to jumps."""
        dissipated = _dissipated(records)
        jump = dissipated > self.work_tolerance
        return abs(dissipated[~jump].sum()) + _jump_position_error(records)[jump].sum()

    def record(self, state):
        """Return the values of a state by the names of their variables."""
        return {
            "mean_separation": state.mean_separation,
            "nominal_pressure": state.nominal_pressure,
            "stored_energy": state.stored_energy(self.material),
            "contact_area_fraction": perimeter_correction(state.contact)[0],
            "contact_area_fraction_raw": np.count_nonzero(state.contact) / state.contact.size,
            "energetic_area_fraction": state.energetic_area_fraction(self.material),
            "residual": state.residual,
        }

    def describe(self, state):
        """Return a text with mean gap and load of a state, for messages."""
        reduced = state.nominal_pressure / (self.material.contact_modulus * self.fine.rms_slope)
        return f"mean gap {state.mean_separation / self.fine.rms_height:.6g} h_rms, load {reduced:.4g} E* h'rms"


def _load_and_unload(solver, step, target, progress):
    """Return two lists: the states of loading and the states of unloading; `target` is the largest load, Pa."""
    start = float(solver.fine.heights.max()) + _START * solver.range
    last, legs = None, ([], [])
    try:
        for leg, states in zip(legs, (_load, _unload), strict=True):
            for state in states(solver, last, start, step, target):
                leg.append(solver.record(state))
                if progress:
                    area = f"contact area {leg[-1]['contact_area_fraction']:.4g} A0"
                    progress(f"{solver.describe(state)}, {area}, error {state.residual:.2g}")
                last = state
        # If contact breaks at a larger mean gap than `start`, states are added: loading then begins at this larger gap.
        count = round((last.mean_separation - start) / step)
        farther = [solver.solve_from_undeformed(start + step * k) for k in range(count, 0, -1)]
        legs[0][:0] = map(solver.record, farther)
    except NotSolved as error:
        reached = solver.describe(last) if last is not None else "no state"
        raise NotSolved(f"{'un' if legs[1] else ''}loading stopped after {reached}: {error}") from None
    return legs


def _load(solver, _, start, step, target):
    """Yield the states of loading from the mean gap `start` (m) to the load `target` (Pa), in steps of the gap."""
    state, count = solver.solve_from_undeformed(start), 0
    yield state
    while state.nominal_pressure < target * (1 - _LOAD_TOLERANCE):
        count += 1
        if start - count * step <= 0:
            raise NotSolved("the mean gap closed before the load was reached; use a smaller load or separation_step")
        for after in solver.steps(state, start - count * step):
            if after.nominal_pressure > target * (1 + _LOAD_TOLERANCE):
                yield from _search_load(solver, state, after, target)
                return
            yield after
            state = after


def _search_load(solver, before, after, target):
    """Yield states from `before` to the load `target`, Pa; if this load lies in a jump, the last state is `after`."""
    for _ in range(_MAX_LOAD_SEARCHES):
        share = (target - before.nominal_pressure) / (after.nominal_pressure - before.nominal_pressure)
        separation = before.mean_separation + share * (after.mean_separation - before.mean_separation)
        between = solver.solve(before.gap, separation)
        if between.nominal_pressure > target * (1 + _LOAD_TOLERANCE):
            after = between
            continue
        yield between
        if between.nominal_pressure >= target * (1 - _LOAD_TOLERANCE):
            return
        before = between
    yield after


def _unload(solver, state, start, step, target):
    """Yield the states of unloading, at the mean gaps of loading, until the surfaces are apart; see `_load`."""
    count = math.ceil((start - state.mean_separation) / step) - 1
    while count >= 0 or not solver.is_apart(state):
        for after in solver.steps(state, start - count * step):
            yield after
            state = after
        count -= 1


def _column(records, name):
    """Return the values of one variable in all records, as an array."""
    return np.array([record[name] for record in records])


def _work(records):
    """Return the work of each step between n records in J/m^2, by the trapezoidal rule: array of shape (n - 1,)."""
    pressure = _column(records, "nominal_pressure")
    return -np.diff(_column(records, "mean_separation")) * (pressure[1:] + pressure[:-1]) / 2


def _dissipated(records):
    """Return the work of each step minus the change of the stored energy, in J/m^2: array of shape (n - 1,)."""
    return _work(records) - np.diff(_column(records, "stored_energy"))


def _jump_position_error(records):
    """Return the work error of each step, in J/m^2, if the pressure jumps at an end of the step: (n - 1,) array."""
    return np.abs(np.diff(_column(records, "mean_separation")) * np.diff(_column(records, "nominal_pressure"))) / 2


def _dataset(surface, solver, legs, separation_step, seed):
    """Build the dataset of a loop from the records of its two legs."""
    material = solver.material
    records = [*legs[0], *legs[1]]
    columns = {name: _column(records, name) for name in records[0]}
    leg = np.repeat([0, 1], [len(one) for one in legs])
    work = np.concatenate([[0.0], np.cumsum(_work(records))])
    pressure, separation, energy = (columns[name] for name in ("nominal_pressure", "mean_separation", "stored_energy"))
    unit = material.contact_modulus * surface.rms_slope
    last = len(legs[0]) + int(np.argmin(pressure[leg == 1]))
    values = {
        "step": np.arange(len(records)),
        **columns,
        "reduced_pressure": pressure / unit,
        "reduced_separation": separation / surface.rms_height,
        "leg": leg,
        "work": work,
        "dissipated": work - (energy - energy[0]),
        "pull_off_pressure": max(0.0, -pressure[last]),
        "pull_off_separation": separation[last],
        "hysteresis_loss": work[-1],
        "hysteresis_loss_error": solver.total_work_error(records),
        "largest_reduced_pressure": pressure.max() / unit,
        "largest_contact_area_fraction": columns["contact_area_fraction"].max(),
        "separation_step": separation_step,
        "solve_count": solver.contact.solves,
        **describe_problem(surface, solver.fine, material, solver.tolerance, seed),
        "branch": np.array(["loading", "unloading"], dtype=object)[leg],
    }
    attrs = attributes(
        material,
        "Loading and unloading of a rough contact {} adhesion, boundary elements at finite range",
        "A periodic rough surface against an elastic half-space, loaded from separation and unloaded to separation.",
    )
    return build_dataset(LOOP, values, attrs)
