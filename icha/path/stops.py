"""Targets (in messages: stops) of a path as functions of the contact state, and the search for states at targets."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from icha.contact.model import PRESSURE, ContactModel, Control, NotConverged, State
from icha.path.targets import LEAST_PRESSURE, MEAN_SEPARATION, Target
from icha.support.formatting import format_quantity

# Largest relative excess over a target that rounding can cause.
SAME_EXCESS = 1e-9
# Largest difference of two separations, in h_rms, that rounding can cause. A narrower bracket contains a jump.
SAME_SEPARATION = 1e-10
# If the solver fails in a bracket narrower than this, in h_rms, the bracket contains a jump: before a spot jumps, its
# radius changes infinitely fast with the approach.
CLOSE_TO_A_JUMP = 1e-4
# Largest number of times that a bracket is halved.
_MAX_HALVINGS = 80
# The solver tries to meet the target after 0 to `_TRIALS` halvings, and then only after 16, 32 and 64 halvings, because
# a target that was missed so often usually lies inside a jump.
_TRIALS = 8
# Between two states without a jump, load or area changes at most by this factor times slope times distance.
_LARGEST_BEND = 4.0


@dataclass(frozen=True, eq=False)
class TargetFunction:
    """Target of a path with a contact; `excess` is a function of the state that is zero at the target.

    Attributes
    ----------
    target : target of the path.
    contact : contact model.
    rises : True for a load of zero or tension on loading. States without contact, whose load is zero, then count as
        below the target, and the load may fall past the target before it rises to it.
    """

    target: Target
    contact: ContactModel
    rises: bool = False

    @classmethod
    def on_loading(cls, target: Target, contact: ContactModel) -> TargetFunction:
        """Return the function of a target that ends or interrupts loading."""
        return cls(target, contact, rises=contact.adhesive and target.needs_adhesion)

    def excess(self, state: State) -> float:
        """Return the excess of a state over the target, relative to the absolute value of the target.

        The excess rises on loading. For a separation it is relative to h_rms, and for zero load to LEAST_PRESSURE. For
        a contact radius it is the excess of the area. With `rises`, it is -1 without contact.
        """
        quantity, value = self.target.quantity, self.target.value
        if self.rises and not self.contact.spot_count(state):
            return -1.0
        if quantity.controlled is None:
            return (self.separation - state.separation) / self.contact.rms_height
        if quantity.controlled == PRESSURE:
            least = LEAST_PRESSURE * self.contact.pressure_unit / quantity.scale(self.contact)
            return (quantity.evaluate(self.contact, state) - value) / (abs(value) or least)
        return self.contact.area_fraction(state) / quantity.prescribed(self.contact, value) - 1

    def is_passed(self, before: State, after: State, direction: int) -> bool:
        """Return whether a step passes the target; `direction` is the sign of the change of the separation."""
        return direction * self.excess(after) <= 0 and not (self.rises and self.excess(before) >= 0)

    @property
    def separation(self) -> float:
        """Separation of a target that is a separation or an indentation, m."""
        return self.target.quantity.prescribed(self.contact, self.target.value)

    @property
    def tolerance(self) -> float:
        """Largest absolute value of `excess` in a state that meets the target."""
        return SAME_EXCESS if self.target.quantity.controlled is None else self.contact.path_accuracy.target

    @property
    def control(self) -> Control | None:
        """Load or area that the solver prescribes to meet the target; None for a separation."""
        return self.target.quantity.control(self.contact, self.target.value)

    def predict_separation(self, state: State) -> float:
        """Return the expected separation of the target, m.

        For a separation or an indentation, it is that of the target. For a load or area, it is extrapolated
        exponentially, and is -inf if the load or area in the state is not positive, or does not grow on loading.
        """
        control = self.control
        if control is None:
            return self.separation
        ratio, slope = 1 + self.excess(state), self.contact.slope(control.quantity, state) / control.target
        return state.separation - np.log(ratio) / (slope / ratio) if ratio > 0 and slope < 0 else -np.inf

    def solve(self, state: State, separation: float) -> State:
        """Find the equilibrium at the target from a nearby state and a separation, m: a guess, or the target itself."""
        return self.contact.equilibrium(state, separation, self.control)


def sort_targets(targets: Iterable[TargetFunction], direction: int) -> list[TargetFunction]:
    """Return a list of targets in which targets of the same kind have the order in which a path meets them.

    direction : sign of the change of the separation: -1 on loading, 1 on unloading.
    """
    signs = {MEAN_SEPARATION: direction}  # all other quantities change in the opposite direction
    return sorted(targets, key=lambda each: signs.get(each.target.kind, -direction) * each.target.value)


def next_of_each_kind(pending: Iterable[TargetFunction]) -> list[TargetFunction]:
    """Return those targets of a sorted list that a path may meet next: the first of every kind, and all that `rise`."""
    rising = [each for each in pending if each.rises]
    first: dict[str, TargetFunction] = {}
    for each in pending:
        if not each.rises:
            first.setdefault(each.target.kind, each)
    return [*rising, *first.values()]


def describe_separation(contact: ContactModel, state: State) -> str:
    """Return the separation of a state in words: an indentation if the surface has a shape, otherwise in h_rms."""
    if contact.shape is not None:
        return f"an indentation of {format_quantity(-state.separation, 'm')}"
    return f"a mean separation of {state.separation / contact.rms_height:.4f} h_rms"


# A jump of at most this number of cells is due to the grid.
_FEW_CELLS = 4
# Part of the way back to a target inside a jump, by which the surfaces are pulled further to see whether tension grows.
_PULLED_FURTHER = 0.25


class InsideJump(NotConverged):
    """Error: the path jumps over the `target` after the state `before`, and no equilibrium at the target is found."""

    def __init__(self, target: TargetFunction, before: State, after: State):
        """Write the message about a target that lies between the states before and after a jump."""
        contact = target.contact
        area_before, area_after = (contact.area_fraction(state) for state in (before, after))
        few_cells = area_after - area_before <= _FEW_CELLS * contact.area_step * (1 + 1e-9)
        remedy = (
            f"one grid cell is {contact.area_step:.3g} of the nominal area, so use a finer grid, or a larger area"
            if few_cells
            else "remove this target, or give the path by mean separations"
        )
        super().__init__(
            f"{target.target.describe()} lies inside a jump: at {describe_separation(contact, after)} the contact area "
            f"jumps from {area_before:.3g} to {area_after:.3g} of the nominal area, and the branch after the jump does "
            f"not reach back to the target before pull-off; {remedy}"
        )
        self.target, self.before = target, before


def find_target_state(target: TargetFunction, before: State, after: State) -> State:
    """Find the state at a target that lies between two states of the path, on loading or unloading.

    The state at a separation is computed directly. For a load or area, the interval between the two states is
    halved until the solver finds the state at the target inside the interval. If the load or area jumps past the
    target, the interval becomes very narrow. Then the solver looks for the target on the branch after the jump, where
    load control would continue; the found state may lie outside the interval, on the other side of `before`. Raise
    `InsideJump` if there is no such equilibrium, or if the middle of an interval below `CLOSE_TO_A_JUMP` has no
    equilibrium. Raise `NotConverged` if the middle of a wider interval has none, or after `_MAX_HALVINGS`.
    """
    contact = target.contact
    if target.control is None:
        return target.solve(before, target.separation)
    sign = 1.0 if after.separation < before.separation else -1.0
    for halvings in range(_MAX_HALVINGS):
        width = sign * (before.separation - after.separation)
        if width <= max(SAME_SEPARATION, contact.path_accuracy.event) * contact.rms_height:
            return _solve_after_jump(target, before, after)
        if _is_reachable(target, before, after) and (halvings < _TRIALS or halvings & (halvings - 1) == 0):
            with suppress(NotConverged):
                found = target.solve(before, _guess_separation(target, before, after))
                if 0 < sign * (before.separation - found.separation) <= width:
                    return found
        try:
            middle = contact.equilibrium(before, after.separation + sign * 0.5 * width)
        except NotConverged:
            if width > CLOSE_TO_A_JUMP * contact.rms_height:
                raise
            raise InsideJump(target, before, after) from None
        if not 0 < sign * (before.separation - middle.separation) < width:
            # No state lies between full contact and the first gap, so that the middle may be an end of the interval.
            return _solve_after_jump(target, before, after)
        if sign * target.excess(middle) >= 0:
            after = middle
        else:
            before = middle
    raise NotConverged(f"{target.target.describe()} was not met after {_MAX_HALVINGS} halvings of the step")


def _is_reachable(target, before, after):
    """Return whether the target is within `_LARGEST_BEND` times slope times distance of one of the states."""
    control, contact, width = target.control, target.contact, abs(after.separation - before.separation)
    value = contact.pressure if control.quantity == PRESSURE else contact.area_fraction
    return any(
        abs(value(state) - control.target) <= _LARGEST_BEND * abs(contact.slope(control.quantity, state)) * width
        for state in (before, after)
    )


def _solve_after_jump(target, before, after):
    """Find the state at a target on the branch after a jump; raise `InsideJump` if the branch does not meet it.

    On loading, the branch ends where its tension is largest: beyond, the surfaces would be pulled off.
    """
    contact = target.contact
    try:
        found = target.solve(after, after.separation)
    except NotConverged:
        raise InsideJump(target, before, after) from None
    pulled = found.separation - after.separation
    if after.separation < before.separation and pulled > 0 and contact.pressure(found) < 0:
        # Not by the stiffness, which varies when a front moves across cells.
        try:
            beyond = contact.equilibrium(found, found.separation + _PULLED_FURTHER * pulled)
        except NotConverged:
            raise InsideJump(target, before, after) from None
        if contact.pressure(beyond) > contact.pressure(found):
            raise InsideJump(target, before, after)
    return found


def _guess_separation(target, before, after):
    """Return a guess of the separation at a target between two states, m.

    For a positive target on loading, the guess is extrapolated from the first state; otherwise it is interpolated.
    """
    if after.separation < before.separation and target.target.value > 0:
        return max(target.predict_separation(before), after.separation)
    start, end = target.excess(before), target.excess(after)
    return before.separation + start / (start - end) * (after.separation - before.separation)


def find_first_target(
    targets: Iterable[TargetFunction], before: State, after: State, direction: int
) -> tuple[TargetFunction | None, State]:
    """Find the target that the path meets first between two states, and the state at this target.

    If there is no target between the states, return None and `after`. Raise the errors of `find_target_state`. A
    target that `rises` and lies inside the jump is left for later, because the tension may still increase.

    targets : targets not met at `before`; of a sorted list, the next one of each kind is enough.
    direction : sign of the change of the separation: -1 on loading, 1 on unloading.
    """
    first: tuple[TargetFunction | None, State] = None, after
    for target in targets:
        if abs(target.excess(after)) <= target.tolerance and first[0] is None:
            first = target, after
        elif target.is_passed(before, after, direction):
            try:
                found = find_target_state(target, before, after)
            except InsideJump:
                if target.rises:
                    continue
                raise
            if first[0] is None or direction * (found.separation - first[1].separation) < 0:
                first = target, found
    return first
