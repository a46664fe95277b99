"""A path, followed from first contact: down to given separations, loads or areas, all of them hit exactly, and back."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from icha.contact.model import ContactModel
from icha.path.course import Course
from icha.path.cycle import cycle
from icha.path.energy_balance import EnergyBalance, Step
from icha.path.load_control import under_load
from icha.path.loading import first_loading
from icha.path.stops import Stop
from icha.path.targets import LOAD_CONTROL, REDUCED_PRESSURE, RELATIVE_LOAD, Path
from icha.path.waypoints import Waypoint


def follow(
    contact: ContactModel,
    path: Path,
    pressure_unit: float,
    progress: Callable[[str], None] | None = None,
) -> Iterator[Waypoint]:
    """Follow the path and yield its waypoints in the order in which they are met.

    Of a path that ends with the first loading these are its targets; of a cyclic one all its equilibria.

    Parameters
    ----------
    contact : the contact problem.
    path : its stops.
    pressure_unit : E* h'_rms in Pa, the unit of reduced pressures.
    progress : called with a line of text at every stop.

    Raises
    ------
    NotConverged
        If an equilibrium is not found even with short steps, or a target lies beyond what the model covers. Stops that
        lie inside a jump are left out; on the first loading those after them are yielded before the error is raised.
    """
    scale = {REDUCED_PRESSURE: pressure_unit, RELATIVE_LOAD: contact.contact_modulus}

    def stop_at(target):
        return Stop(target, contact, scale.get(target.kind, 1.0))

    longest = path.max_step * contact.rms_height
    course = Course(contact, len(path.targets), longest, progress)
    if not path.cyclic:
        return first_loading(contact, [stop_at(target) for target in path.targets], longest, course)
    waypoints = cycle(contact, path, stop_at, longest, course)
    if path.control == LOAD_CONTROL:
        return under_load(contact, waypoints, pressure_unit)
    return _balanced(contact, waypoints)


def _balanced(contact, waypoints):
    """The same waypoints with their balances."""
    before, balance = None, EnergyBalance()
    for waypoint in waypoints:
        if before is not None:
            balance = balance.after(contact, Step.between(contact, before, waypoint.state))
        before = waypoint.state
        yield replace(waypoint, balance=balance)
