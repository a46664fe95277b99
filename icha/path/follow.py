"""Follow a path: find the equilibria from first contact through all targets, and through unloading if required."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import replace

from icha.contact.model import ContactModel, State
from icha.path.energy_balance import EnergyBalance, Waypoint, waypoint_between_targets
from icha.path.legs import follow_legs
from icha.path.progress import PathProgress
from icha.path.stops import TargetFunction
from icha.path.targets import BETWEEN, LOAD_CONTROL, REDUCED_PRESSURE, Path, Target


def follow(contact: ContactModel, path: Path, report: Callable[[str], None] | None = None) -> Iterator[Waypoint]:
    """Follow a path with a contact, and yield the waypoints in the order of the path.

    For a path that ends with the first loading, the waypoints are the equilibria at the targets. For a cyclic path they
    are all equilibria or, under load control, all equilibria that load control visits. Targets are met exactly.

    Parameters
    ----------
    contact : contact model.
    path : targets and turning points.
    report : function that is called with a line of text at every target of the first loading, at every turning point,
        and at complete separation; None for no reports.

    Raises
    ------
    NotConverged
        If an equilibrium is not found even with short steps, if the path makes no progress, if the model is not valid
        in a state of the path, or if a leg starts beyond its turning point. It is a `BeyondModel` if physics ends the
        path: if the surfaces separate before a turning point, or if targets lie inside jumps or are tensions that
        loading does not reach. These targets raise it after the other targets of the first loading have been met;
        turning points raise it at once. On the last unloading, targets inside jumps are left out without an error.
    """
    longest = path.max_step * contact.rms_height
    record = PathProgress(contact, len(path.targets), longest, report)
    # Where loads rise to tensions, equilibria depend on how accurately jumps are located.
    energies = path.cyclic or any(target.needs_adhesion for target in path.targets)
    waypoints = follow_legs(contact, path, longest, record, energies)
    if not path.cyclic:
        return (replace(each, step=None) for each in waypoints if each.target.kind != BETWEEN)
    if path.control == LOAD_CONTROL:
        return select_load_control(contact, waypoints)
    return _add_balances(contact, waypoints)


def _add_balances(contact, waypoints):
    """Yield the waypoints of a path under separation control, each with its energy balance."""
    balance = EnergyBalance()
    for waypoint in waypoints:
        if waypoint.step is not None:
            balance = balance.add_step(contact, waypoint.step)
        yield replace(waypoint, balance=balance)


def select_load_control(
    contact: ContactModel, cycle: Generator[Waypoint, TargetFunction | None, None]
) -> Iterator[Waypoint]:
    """Yield only those waypoints of a cycle that load control visits, with their energy balances.

    The cycle is under separation control. Where its pressure falls on loading or rises on unloading, load control
    cannot follow the curve of pressure against separation. The state then jumps at constant pressure to the next state
    of the curve with the same pressure, or to the last state of the path if there is no such state. To find this state
    exactly, its pressure is sent to the cycle as an additional target. If the pressure of the curve skips this value,
    the jump ends at the next state of the curve with another pressure; its work is still computed with the pressure
    before the jump. The states inside a jump are left out, but `State.history` keeps their events.

    Parameters
    ----------
    contact : contact of the cycle.
    cycle : generator of the waypoints under separation control; it accepts additional targets (`generator.send`).
    """
    last_visited: State | None = None
    left_out: Waypoint | None = None
    load_target: TargetFunction | None = None
    balance = EnergyBalance()
    load = 0.0
    while True:
        try:
            waypoint = cycle.send(load_target)
        except StopIteration:
            break
        state = waypoint.state
        pressure = contact.pressure(state)
        advances = pressure >= load if waypoint.loading else pressure <= load
        # If two targets have the same load, their errors may make the load of the second target slightly smaller.
        advances |= waypoint.target.kind != BETWEEN and abs(pressure - load) <= contact.path_accuracy.target * abs(load)
        landed = load_target is not None and waypoint.target is load_target.target
        # The first state is always visited, because a jump can only start from a visited state.
        if last_visited is not None and not advances and not landed:
            left_out = waypoint
            load_target = load_target or TargetFunction(Target(REDUCED_PRESSURE, load / contact.pressure_unit), contact)
            continue
        if last_visited is not None and left_out is not None:
            balance = balance.add_load_jump(contact, last_visited, state, load)
        elif waypoint.step is not None:
            balance = balance.add_step(contact, waypoint.step)
        yield replace(waypoint_between_targets(state, waypoint.leg) if landed else waypoint, balance=balance)
        last_visited, left_out, load_target, load = state, None, None, pressure
    if last_visited is not None and left_out is not None:
        yield replace(left_out, balance=balance.add_load_jump(contact, last_visited, left_out.state, load))
