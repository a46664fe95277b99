"""Load control: which states of a path are visited when the load is imposed."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from icha.contact.model import ContactModel
from icha.path.bracketing import InsideJump, reach
from icha.path.energy_balance import EnergyBalance, Step
from icha.path.stops import Stop
from icha.path.targets import REDUCED_PRESSURE, Target
from icha.path.waypoints import Waypoint, between_stops


def under_load(contact: ContactModel, waypoints: Iterable[Waypoint]) -> Iterator[Waypoint]:
    """Those states of a path under separation control that load control visits, with their balances.

    Where the pressure would have to go back, the state jumps at constant pressure to where the curve goes on; with the
    last contact, to where nothing touches any more.
    """
    visited = hidden = None
    balance = EnergyBalance()
    level = 0.0
    for waypoint in waypoints:
        state = waypoint.state
        pressure = contact.pressure(state)
        ahead = pressure >= level if waypoint.loading else pressure <= level
        # The turning point itself begins the next leg; without contact there is nothing yet to jump from.
        if visited is not None and not ahead:
            hidden = waypoint
            continue
        if hidden is not None:
            landed = state if pressure == level else _landed(contact, hidden.state, state, level)
            balance = _after_jump(contact, balance, visited, landed, level)
            if landed is not state:
                yield replace(between_stops(landed, waypoint.leg), balance=balance)
            visited, hidden = landed, None
        if visited is not None and visited is not state:
            balance = balance.after(contact, Step.between(contact, visited, state))
        yield replace(waypoint, balance=balance)
        visited, level = state, pressure
    if hidden is not None:
        yield replace(hidden, balance=_after_jump(contact, balance, visited, hidden.state, level))


def _landed(contact, hidden, state, level):
    """The state at a pressure (Pa) between a hidden state and the one after it; the latter where it is in a jump."""
    try:
        return reach(Stop(Target(REDUCED_PRESSURE, level), contact, 1.0), hidden, state)
    except InsideJump:
        return state


def _after_jump(contact, balance, before, after, pressure):
    """The balance after a jump at a constant pressure, Pa, from one state to another."""
    work = -pressure * (after.separation - before.separation)
    return balance.after_load_jump(work, contact.stored_energy(after) - contact.stored_energy(before))
