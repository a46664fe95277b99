"""Boundary elements at a finite range of attraction both ways: from apart to a load and back until apart.

The mean gap is what is given, as in a stiff machine. Every solution starts from the one before and so stays on its
branch until that ends; there the surfaces jump, and what the jump frees is lost. Between jumps the work done on the
contact, minus the integral of the nominal pressure over the mean gap, is the change of the energy it stores: on a step
the two may differ by what jumps in it dissipate, and by the error of the trapezoid. So steps on which they differ are
halved, down to a limit; where within the smallest the jump was remains unknown.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from icha.asperity.material import Material
from icha.datasets.build import build
from icha.datasets.variables.boundary_elements import LOOP
from icha.references.finite_range import (
    DEFAULT_TOLERANCE,
    GapContact,
    NotSolved,
    asked_for,
    attributes,
    perimeter_correction,
    resolved,
    silent,
)
from icha.support.rules import POSITIVE, TOLERANCE
from icha.surfaces.surface import Surface

# Surfaces are apart where every gap exceeds this many ranges: nowhere more than 0.7 % of the interface's strength acts.
_APART = 5.0
# The loop starts this many ranges above the highest summit, from where attraction draws it nearer.
_START = 6.0
# Steps are halved while their work is known to this part of the surface energy only, this many times at most.
_WORK_TOLERANCE = 1e-4
_MAX_HALVINGS = 5
# The largest load is met to this relative error, unless it lies within a jump.
_LOAD_TOLERANCE = 1e-3
# Tries to meet it within one step.
_MAX_MEETING = 12
# A loop that takes more solutions than this does not end.
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
    """Bring two surfaces from apart to a load and apart again, by boundary elements.

    Parameters
    ----------
    surface, material, refinement, tolerance, seed, progress : as for
        `icha.references.finite_range.finite_range_solution`.
    largest_reduced_pressure : p/(E* h'_rms) at which the way turns, positive. A jump may carry the load beyond it.
    separation_step : largest step of the mean gap, in h_rms; steps with jumps are taken in up to 32 smaller ones.

    Returns
    -------
    xarray.Dataset of `icha.datasets.variables.boundary_elements.LOOP`. Both ends of
    `step` are the same state, apart, and work is counted from the first.

    Raises
    ------
    ValueError
        If an argument is out of range, or the grid does not resolve the attraction.
    NotSolved
        If the solver does not reach its tolerance, or the load is not reached: it says how far the loop has come.
    """
    target = POSITIVE.checked("largest_reduced_pressure", largest_reduced_pressure)
    step = POSITIVE.checked("separation_step", separation_step) * surface.rms_height
    say = progress or silent
    fine = resolved(surface, material, refinement, say)
    way = _Way(fine, material, TOLERANCE.checked("tolerance", tolerance), say)
    legs = _down_and_up(way, step, target * surface.rms_slope * material.contact_modulus)
    return _dataset(surface, way, legs, separation_step, seed)


@dataclass(frozen=True)
class _Record:
    """What is kept of a state."""

    separation: float
    pressure: float
    energy: float
    area: float
    area_raw: float
    energetic_area: float
    residual: float


class _Way:
    """States one after the other, each from the one before."""

    def __init__(self, fine, material, tolerance, say):
        self.fine, self.material, self.say = fine, material, say
        self.tolerance = tolerance
        self.contact = GapContact(fine, material, tolerance)
        adhesive = material.surface_energy > 0
        self.work_tolerance = _WORK_TOLERANCE * material.surface_energy if adhesive else math.inf
        self.range = material.interaction_range if adhesive else 0.0

    def apart(self, separation):
        """The state at a mean gap (m) to which the undeformed surfaces lead."""
        return self._solved(separation - self.fine.heights, separation)

    def is_apart(self, state):
        """Whether no attraction to speak of is left."""
        return not state.contact.any() and state.gap.min() >= _APART * self.range

    def step(self, state, separation):
        """The state at a mean gap (m), from another."""
        return self._solved(state.gap, separation)

    def steps(self, state, separation, halvings=_MAX_HALVINGS):
        """States from one to a mean gap (m), in steps so small that the work is known, or the smallest."""
        after = self.step(state, separation)
        if halvings == 0 or self.work_error(state, after) <= self.work_tolerance:
            yield after
            return
        for middle in self.steps(state, (state.mean_separation + separation) / 2, halvings - 1):
            yield middle
        yield from self.steps(middle, separation, halvings - 1)

    def work_error(self, before, after):
        """Error of a step's work by the trapezoid, J/m^2; of two estimates the smaller.

        On a branch it is the work less the change of the stored energy; where pressure jumps, at most half its change
        times the step.
        """
        records = [self.kept(before), self.kept(after)]
        return min(abs(_dissipated(records)[0]), _unknown_place(records)[0])

    def error(self, records):
        """Error of the work over all steps, J/m^2: what branches dissipate, which is nothing, and jumps' places."""
        dissipated = _dissipated(records)
        jump = dissipated > self.work_tolerance
        return abs(dissipated[~jump].sum()) + _unknown_place(records)[jump].sum()

    def kept(self, state):
        """The numbers that are kept of a state."""
        return _Record(
            separation=state.mean_separation,
            pressure=state.nominal_pressure,
            energy=state.stored_energy(self.material),
            area=perimeter_correction(state.contact)[0],
            area_raw=np.count_nonzero(state.contact) / state.contact.size,
            energetic_area=state.energetic_area_fraction(self.material),
            residual=state.residual,
        )

    def described(self, state):
        """A state in words."""
        reduced = state.nominal_pressure / (self.material.contact_modulus * self.fine.rms_slope)
        return f"mean gap {state.mean_separation / self.fine.rms_height:.6g} h_rms, load {reduced:.4g} E* h'rms"

    def _solved(self, gap, separation):
        if self.contact.solves >= _MAX_SOLVES:
            raise NotSolved(f"the loop has not ended after {self.contact.solves} solutions")
        self.contact.start_from(gap)
        return self.contact.at(separation)


def _down_and_up(way, step, target):
    """Records of both legs of the loop, from apart and until apart."""
    start = float(way.fine.heights.max()) + _START * way.range
    last, legs = None, ([], [])
    try:
        for leg, states in zip(legs, (_down, _up), strict=True):
            for state in states(way, last, start, step, target):
                leg.append(way.kept(state))
                way.say(f"{way.described(state)}, contact area {leg[-1].area:.4g} A0, error {state.residual:.2g}")
                last = state
        # Where contact held beyond the start, the way down begins as far out.
        above = _levels(start, step, last.mean_separation)
        legs[0][:0] = [way.kept(way.apart(level)) for level in reversed(above)]
    except NotSolved as error:
        reached = way.described(last) if last is not None else "nothing"
        raise NotSolved(f"{'un' if legs[1] else ''}loading stopped after {reached}: {error}") from None
    return legs


def _levels(start, step, end):
    """Mean gaps (m) above start in steps, up to the end."""
    return [start + step * (k + 1) for k in range(round((end - start) / step))]


def _down(way, _, start, step, target):
    """States from apart to the largest load."""
    state, count = way.apart(start), 0
    yield state
    while state.nominal_pressure < target * (1 - _LOAD_TOLERANCE):
        count += 1
        if start - count * step <= 0:
            raise NotSolved("the load was not reached before the mean gap closed; allowed: a smaller load or step")
        for after in way.steps(state, start - count * step):
            if after.nominal_pressure > target * (1 + _LOAD_TOLERANCE):
                yield from _meeting(way, state, after, target)
                return
            yield after
            state = after


def _meeting(way, before, after, target):
    """States between two, up to the one that carries the load; the second if the load lies within a jump."""
    for _ in range(_MAX_MEETING):
        share = (target - before.nominal_pressure) / (after.nominal_pressure - before.nominal_pressure)
        between = way.step(before, before.mean_separation + share * (after.mean_separation - before.mean_separation))
        if between.nominal_pressure > target * (1 + _LOAD_TOLERANCE):
            after = between
            continue
        yield between
        if between.nominal_pressure >= target * (1 - _LOAD_TOLERANCE):
            return
        before = between
    yield after


def _up(way, state, start, step, target):
    """States from the largest load until apart, at the mean gaps of the way down."""
    count = math.ceil((start - state.mean_separation) / step) - 1
    while count >= 0 or not way.is_apart(state):
        for after in way.steps(state, start - count * step):
            yield after
            state = after
        count -= 1


def _column(records, name):
    return np.array([getattr(record, name) for record in records])


def _work(records):
    """Work on each step by the trapezoid, J/m^2."""
    pressure = _column(records, "pressure")
    return -np.diff(_column(records, "separation")) * (pressure[1:] + pressure[:-1]) / 2


def _dissipated(records):
    """Work on each step less the change of the stored energy, J/m^2."""
    return _work(records) - np.diff(_column(records, "energy"))


def _unknown_place(records):
    """Half of each step times the change of pressure, J/m^2: error of the work if the pressure jumps at an end."""
    return np.abs(np.diff(_column(records, "separation")) * np.diff(_column(records, "pressure"))) / 2


def _dataset(surface, way, legs, separation_step, seed):
    material = way.material
    records = [*legs[0], *legs[1]]
    along = {name: _column(records, name) for name in _Record.__annotations__}
    leg = np.repeat([0, 1], [len(one) for one in legs])
    work = np.concatenate([[0.0], np.cumsum(_work(records))])
    pressure, separation, unit = along["pressure"], along["separation"], material.contact_modulus * surface.rms_slope
    last = len(legs[0]) + int(np.argmin(pressure[leg == 1]))
    values = {
        "step": np.arange(len(records)),
        "mean_separation": separation,
        "nominal_pressure": pressure,
        "reduced_pressure": pressure / unit,
        "reduced_separation": separation / surface.rms_height,
        "contact_area_fraction": along["area"],
        "contact_area_fraction_raw": along["area_raw"],
        "energetic_area_fraction": along["energetic_area"],
        "residual": along["residual"],
        "leg": leg,
        "work": work,
        "stored_energy": along["energy"],
        "dissipated": work - (along["energy"] - along["energy"][0]),
        "pull_off_pressure": max(0.0, -pressure[last]),
        "pull_off_separation": separation[last],
        "hysteresis_loss": work[-1],
        "hysteresis_loss_error": way.error(records),
        "largest_reduced_pressure": pressure.max() / unit,
        "largest_contact_area_fraction": along["area"].max(),
        "separation_step": separation_step,
        "solve_count": way.contact.solves,
        **asked_for(surface, way.fine, material, way.tolerance, seed),
        "branch": np.array(["loading", "unloading"], dtype=object)[leg],
    }
    attrs = attributes(
        material,
        "Rough contact {} adhesion both ways, boundary elements at finite range",
        "A periodic rough surface against an elastic half-space, from apart to a load and apart again.",
    )
    return build(LOOP, values, attrs)
