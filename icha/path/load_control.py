"""Load control: which states of a path are visited when the load is imposed."""

from collections.abc import Generator, Iterator
from dataclasses import replace

from icha.contact.model import ContactModel
from icha.path.energy_balance import EnergyBalance, Step
from icha.path.stops import SAME_EXCESS, Stop
from icha.path.targets import BETWEEN, REDUCED_PRESSURE, Target
from icha.path.waypoints import Waypoint, between_stops


def under_load(
    contact: ContactModel, cycle: Generator[Waypoint, Stop | None, None], pressure_unit: float
) -> Iterator[Waypoint]:
    """Those states of a path under separation control that load control visits, with their balances.

    Where the pressure would have to go back, the state jumps at constant pressure to where the curve goes on; with the
    last contact, to where nothing touches any more. The path is told to meet that pressure again, and goes on from
    there: the events of a state are then those of the states before it, and its own. pressure_unit: of reduced
    pressures, Pa.
    """
    visited = hidden = again = None
    balance = EnergyBalance()
    level = 0.0
    while True:
        try:
            waypoint = cycle.send(again)
        except StopIteration:
            break
        state = waypoint.state
        pressure = contact.pressure(state)
        ahead = pressure >= level if waypoint.loading else pressure <= level
        # Of two stops at one load the second may have a little less.
        ahead |= waypoint.target.kind != BETWEEN and abs(pressure - level) <= SAME_EXCESS * abs(level)
        landed = again is not None and waypoint.target is again.target
        # The turning point itself begins the next leg; without contact there is nothing yet to jump from.
        if visited is not None and not ahead and not landed:
            hidden = waypoint
            again = again or Stop(Target(REDUCED_PRESSURE, level / pressure_unit), contact, pressure_unit)
            continue
        if hidden is not None:
            balance = _after_jump(contact, balance, visited, state, level)
        elif visited is not None:
            balance = balance.after(contact, Step.between(contact, visited, state))
        yield replace(between_stops(state, waypoint.leg) if landed else waypoint, balance=balance)
        visited, hidden, again, level = state, None, None, pressure
    if hidden is not None:
        yield replace(hidden, balance=_after_jump(contact, balance, visited, hidden.state, level))


def _after_jump(contact, balance, before, after, pressure):
    """The balance after a jump at a constant pressure, Pa, from one state to another."""
    work = -pressure * (after.separation - before.separation)
    return balance.after_load_jump(work, contact.stored_energy(after) - contact.stored_energy(before))
