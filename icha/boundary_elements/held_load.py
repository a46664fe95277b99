"""Loads and areas that are held: the mean separation at which a contact has them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from icha.boundary_elements.newton import FRONT_TOLERANCE
from icha.boundary_elements.states import CellState
from icha.contact.events import Events
from icha.contact.failures import NotConverged
from icha.contact.model import AREA_FRACTION, HELD_CELLS, PRESSURE, ContactModel, Control

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
# What a load of zero is held to over E*, at least (else over the load before).
_NO_LOAD = 1e-6


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
    scale = abs(control.target) or max(abs(value(state)), _NO_LOAD * contact.contact_modulus)
    enough = _HELD * scale
    if control.quantity == AREA_FRACTION and not contact.adhesive:
        enough = max(enough, HELD_CELLS * contact.spacing**2 / contact.area)
    sign = np.sign(control.target - value(state)) or 1.0
    short, far = state, None
    before, start, exact, same = state, state, False, False
    for trial in range(_MAX_TRIALS):
        tolerance = FRONT_TOLERANCE if exact else _TRIAL if trial else _FIRST
        new = settle(start, separation, tolerance, near=exact, same_slopes=same)
        error = value(new) - control.target
        if exact and abs(error) <= enough:
            return new
        same = exact and abs(error) < _SAME_SLOPES * scale
        was_exact, exact = exact, abs(error) < _CLOSE * scale
        if exact and not was_exact:
            # As near as this the trials so far, which were not exact, bound nothing.
            short, far = state, None
        elif sign * error < 0:
            short = new
        else:
            far = new
        # Beyond the target an event may have happened that must not.
        start = new if new is short or exact or not len(events(short, new)) else short
        slope = contact.slope(control.quantity, new)
        if was_exact and exact and new.separation != before.separation:
            # How cells begin to open or to close is not in the slope of an area.
            slope = (value(new) - value(before)) / (new.separation - before.separation)
        before = new
        separation = new.separation - error / slope if slope else np.nan
        if far is None:
            if not np.isfinite(separation):
                break
            continue
        low, high = sorted((short.separation, far.separation))
        if high - low < _SAME * contact.rms_height:
            break
        if not low < separation < high:
            separation = 0.5 * (low + high)
    raise NotConverged(f"a {control.quantity.replace('_', ' ')} of {control.target:g} is not met from here")
