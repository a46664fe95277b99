"""A path, followed from first contact: down to given separations, loads or areas, all of them hit exactly, and back."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import replace

from icha.contact.model import ContactModel
from icha.path.cycle import cycle
from icha.path.energy_balance import EnergyBalance, Waypoint, between_stops
from icha.path.loading import Course, first_loading
from icha.path.stops import SAME_EXCESS, Stop
from icha.path.targets import BETWEEN, LOAD_CONTROL, REDUCED_PRESSURE, Path, Target


def under_load(contact: ContactModel, cycle: Generator[Waypoint, Stop | None, None]) -> Iterator[Waypoint]:
    """Those states of a path under separation control that load control visits, with their balances.

    Where the pressure would have to go back, the state jumps at constant pressure to where the curve goes on; with the
    last contact, to where nothing touches any more. The path is told to meet that pressure again, and goes on from
    there: the events of a state are then those of the states before it, and its own.
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
            again = again or Stop(Target(REDUCED_PRESSURE, level / contact.pressure_unit), contact)
            continue
        if hidden is not None:
            balance = _after_jump(contact, balance, visited, state, level)
        elif waypoint.step is not None:
            balance = balance.after(contact, waypoint.step)
        yield replace(between_stops(state, waypoint.leg) if landed else waypoint, balance=balance)
        visited, hidden, again, level = state, None, None, pressure
    if hidden is not None:
        yield replace(hidden, balance=_after_jump(contact, balance, visited, hidden.state, level))


def _after_jump(contact, balance, before, after, pressure):
    """The balance after a jump at a constant pressure, Pa, from one state to another."""
    work = -pressure * (after.separation - before.separation)
    return balance.after_load_jump(work, contact.stored_energy(after) - contact.stored_energy(before))


def follow(
    contact: ContactModel,
    path: Path,
    progress: Callable[[str], None] | None = None,
) -> Iterator[Waypoint]:
    """Follow the path and yield its waypoints in the order in which they are met.

    Of a path that ends with the first loading these are its targets; of a cyclic one all its equilibria.

    Parameters
    ----------
    contact : the contact problem.
    path : its stops.
    progress : called with a line of text at every stop.

    Raises
    ------
    NotConverged
        If an equilibrium is not found even with short steps, or a target lies beyond what the model covers. Stops that
        lie inside a jump are left out; on the first loading those after them are yielded before the error is raised.
    """
    longest = path.max_step * contact.rms_height
    course = Course(contact, len(path.targets), longest, progress)
    if not path.cyclic:
        return first_loading(contact, [Stop(target, contact) for target in path.targets], longest, course)
    waypoints = cycle(contact, path, longest, course)
    if path.control == LOAD_CONTROL:
        return under_load(contact, waypoints)
    return _balanced(contact, waypoints)


def _balanced(contact, waypoints):
    """The same waypoints with their balances."""
    balance = EnergyBalance()
    for waypoint in waypoints:
        if waypoint.step is not None:
            balance = balance.after(contact, waypoint.step)
        yield replace(waypoint, balance=balance)
