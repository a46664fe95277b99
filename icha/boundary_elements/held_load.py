"""Loads and areas that are held: the mean separation at which a contact has them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from icha.boundary_elements.newton import FRONT_TOLERANCE
from icha.boundary_elements.patches import CellState
from icha.contact.model import AREA_FRACTION, PRESSURE, ContactModel, Control, Events, NotConverged
from icha.contact.models import AREA_TOLERANCE_CELLS, AREA_TOLERANCE_PART

# Relative error of a held load or area.
_HELD = 5e-10
_MAX_TRIALS = 60
# A trial so near the target, relatively, is gone on from even if it lies beyond. Closer separations, in h_rms, are one.
_CLOSE = 1e-3
_SAME = 1e-13
# Deviation of sqrt(G/dgamma) along a front that is good enough for the first trial, and for those after it; and an
# error so small, relatively, that slopes are the same.
_FIRST, _TRIAL = 1e-2, 1e-3
_SAME_SLOPES = 1e-4
# What a load of zero is held to, at least (else over the load before): over the stiffness times h_rms, about which the
# attraction and repulsion are that cancel in it.
_NO_LOAD = 1e-2


def under_control(
    contact: ContactModel[CellState],
    state: CellState,
    separation: float,
    control: Control,
    settle: Callable[..., CellState],
    events: Callable[[CellState, CellState], Events],
) -> CellState:
    """The equilibrium under a load or of an area, from a state not far away.

    separation: a first guess, m. settle: the equilibrium at a separation, from a state, to a tolerance of the front;
    near: whether the state is next to it, same_slopes: and has its slopes. events: those between two states.
    Where events may happen on the way, none is skipped: a trial that goes too far is taken back.

    Raises
    ------
    NotConverged
        If it is not met.
    """
    value = contact.pressure if control.quantity == PRESSURE else contact.area_fraction
    scale, enough = _needed(contact, state, control)
    whole = bracket = _Bracket(np.sign(control.target - value(state)) or 1.0, state)
    before, start, exact, same = state, state, False, False
    nearest, least = state, np.inf
    for trial in range(_MAX_TRIALS):
        tolerance = FRONT_TOLERANCE if exact else _TRIAL if trial else _FIRST
        new = settle(start, separation, tolerance, near=exact, same_slopes=same)
        error = value(new) - control.target
        if exact and abs(error) <= enough:
            return new
        if abs(error) < least:
            nearest, least = new, abs(error)
        same = exact and abs(error) < _SAME_SLOPES * scale
        was_exact, exact = exact, abs(error) < _CLOSE * scale
        # As near as this the trials so far, which were not exact, bound nothing.
        bracket = whole if exact and not was_exact else bracket.after(new, error)
        # Beyond the target an event may have happened that must not.
        start = new if new is bracket.short or exact or not len(events(bracket.short, new)) else bracket.short
        slope = contact.slope(control.quantity, new)
        if was_exact and exact and new.separation != before.separation:
            # How cells begin to open or to close is not in the slope of an area.
            slope = (value(new) - value(before)) / (new.separation - before.separation)
        before = new
        expected = new.separation - error / slope if slope else np.nan
        separation = bracket.inside(expected, _SAME * contact.rms_height)
        if separation is None:
            break
    # Without adhesion every trial is an equilibrium, and few cells may be more than what is close.
    if not contact.adhesive and least <= enough:
        return nearest
    raise NotConverged(f"a {control.quantity.replace('_', ' ')} of {control.target:g} is not met from here")


def _needed(contact, state, control):
    """The scale of errors of a held quantity, and an error that is small enough."""
    if control.target:
        scale = abs(control.target)
    else:
        unit = abs(contact.stiffness(state)) * contact.rms_height
        scale = max(abs(contact.pressure(state)), _NO_LOAD * unit)
    enough = _HELD * scale
    if control.quantity == AREA_FRACTION and not contact.adhesive:
        enough = max(enough, min(AREA_TOLERANCE_CELLS * contact.spacing**2 / contact.area, AREA_TOLERANCE_PART * scale))
    return scale, enough


@dataclass(frozen=True, eq=False)
class _Bracket:
    """Two states, short of a target and, once one is known, beyond it; sign: of what is missing short of it."""

    sign: float
    short: CellState
    far: CellState | None = None

    def after(self, new, error):
        """With one more state in the place of one of them; error: by which it is off the target."""
        return replace(self, short=new) if self.sign * error < 0 else replace(self, far=new)

    def inside(self, separation, same):
        """The separation (m) if it lies within, else the middle; None if it is unknown or the two are the `same`."""
        if self.far is None:
            return separation if np.isfinite(separation) else None
        low, high = sorted((self.short.separation, self.far.separation))
        if high - low < same:
            return None
        return separation if low < separation < high else 0.5 * (low + high)
