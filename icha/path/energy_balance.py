"""Energy balance of a path: the work of every step, the stored energy, and the losses in jumps and unions.

Between two events the stored energy changes by the work done. An event changes the stored energy at constant
separation, and the energy that it releases is lost. Over a closed path the losses of all events add up to the area of
the hysteresis loop in a diagram of pressure against separation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from icha.asperity.material import Material
from icha.contact.model import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, ContactModel, Events, State, events_between
from icha.path.targets import BETWEEN, Target

# In these functions du and dp are the changes of the separation (m) and of the pressure (Pa) in a step; slope and
# end_slope are dp/du at its ends, Pa/m.


def pressure_jump(du, dp, slope, end_slope):
    """Return the change of pressure in a step minus that by the mean stiffness of its ends: the part by events, Pa."""
    return dp - 0.5 * du * (slope + end_slope)


def unresolved_work(du, pressure_jump):
    """Return the largest error of the work of a step whose events may happen anywhere in it, J/m^2."""
    return 0.5 * abs(du * pressure_jump)


def integration_error(du, slope, end_slope):
    """Return the estimated error of the work of a step without events, J/m^2."""
    return du**2 * abs(end_slope - slope) / 24


# If the loss of a step exceeds this fraction of its work, a jump causes it, and not the error of the interaction.
_CERTAIN_LOSS = 0.1


def _extrapolate_to_full_contact(du, p, q, slope, end_slope):
    """Return finite pressures p, q and slopes at both ends of a step from or to full contact, and its work error.

    Full contact is infinitely stiff: its pressure does no work, and jumps where contact closes or opens. At the end of
    the step that is in full contact, the pressure is extrapolated along the tangent at the other end.
    """
    if np.isinf(slope) and np.isinf(end_slope):
        return p, q, 0.0, 0.0, 0.0
    if np.isinf(slope):
        return q - du * end_slope, q, end_slope, end_slope, 0.5 * du**2 * abs(end_slope)
    return p, p + du * slope, slope, slope, 0.5 * du**2 * abs(slope)


@dataclass(frozen=True)
class Step:
    """Change from one equilibrium of a path to the next.

    Attributes
    ----------
    separation_change : change of the mean separation, m.
    work : work done on the contact, -(integral of p du), J/m^2.
    stored : change of the stored energy, J/m^2.
    pressure_jump : change of the pressure that the stiffnesses at both ends do not explain, Pa.
    integration_error : estimated error of the work without events, J/m^2.
    has_jump : whether there are events that may change the pressure.
    events : events of the step.
    """

    separation_change: float
    work: float
    stored: float
    pressure_jump: float
    integration_error: float
    has_jump: bool
    events: Events

    @classmethod
    def between(cls, contact: ContactModel, before: State, after: State) -> Step:
        """Return the step from one state to the next.

        The work is the integral of the cubic with the pressures and stiffnesses of both ends. This is exact if jumps of
        the pressure are in the middle of the step.
        """
        events = events_between(before, after)
        du = after.separation - before.separation
        p, q = contact.pressure(before), contact.pressure(after)
        slope, end_slope = -contact.stiffness(before), -contact.stiffness(after)
        error = integration_error(du, slope, end_slope)
        if np.isinf(slope) or np.isinf(end_slope):
            p, q, slope, end_slope, error = _extrapolate_to_full_contact(du, p, q, slope, end_slope)
        # Without adhesion contact forms and breaks without a jump of the pressure.
        jumps = len(events) if contact.adhesive else events.count(COALESCENCE) + events.count(SPLIT)
        return cls(
            separation_change=du,
            work=-(0.5 * du * (p + q) + du**2 * (slope - end_slope) / 12),
            stored=contact.stored_energy(after) - contact.stored_energy(before),
            pressure_jump=pressure_jump(du, q - p, slope, end_slope),
            integration_error=error,
            has_jump=bool(jumps),
            events=events,
        )

    @property
    def has_union(self) -> bool:
        """True if spots have coalesced or split."""
        return self.events.count(COALESCENCE) + self.events.count(SPLIT) > 0

    @property
    def loss(self) -> float:
        """Work that is not stored, J/m^2."""
        return self.work - self.stored

    @property
    def unresolved(self) -> float:
        """Largest error of the work because events may happen anywhere in the step, J/m^2."""
        return unresolved_work(self.separation_change, self.pressure_jump) if self.has_jump else 0.0

    @property
    def unknown_work(self) -> float:
        """Largest error of the work if the pressure may also jump anywhere without an event, J/m^2.

        If nothing is lost, the work is the change of the stored energy, which is exact.
        """
        jump = unresolved_work(self.separation_change, self.pressure_jump)
        return min(max(jump, self.integration_error), abs(self.loss))

    def jump_energy(self, contact: ContactModel) -> float:
        """Return the energy that the jumps of the step would release if every spot were alone, J/m^2."""
        return float(np.abs(self.events.energy).sum()) / contact.area


@dataclass(frozen=True)
class EnergyBalance:
    """Work done on a contact since first contact, and its losses by kind of event, all J/m^2.

    Attributes
    ----------
    work : work done on the contact.
    jump_in, jump_off : losses by jumps into and out of contact.
    coalescence : loss by unions of spots and by their splitting.
    load_jump : loss by jumps at constant load, under load control.
    unattributed : all other losses: errors of the integration, and errors because the interaction is not reciprocal.
    """

    work: float = 0.0
    jump_in: float = 0.0
    jump_off: float = 0.0
    coalescence: float = 0.0
    load_jump: float = 0.0
    unattributed: float = 0.0

    def add_step(self, contact: ContactModel, step: Step) -> EnergyBalance:
        """Return the balance after one more step.

        In a step without unions the whole loss is attributed to its jumps if it is within a factor of two of the energy
        that the same spots would lose alone, or more than a tenth of the work. Jumps in and jumps off then share it in
        proportion to the energy that they would lose alone. In all other steps, and if one kind of jump gains energy
        and the other loses energy, each jump is attributed the energy that its spot would lose alone. The rest is a
        loss by coalescence if spots have united or split, and otherwise unattributed.
        """
        events, united = step.events, step.has_union
        jump_in, jump_off = (
            float(events.energy[events.kind == kind].sum()) / contact.area for kind in (JUMP_IN, JUMP_OFF)
        )
        ratio = step.loss / ((jump_in + jump_off) or np.inf)
        certain = 0.5 < ratio < 2 or abs(step.loss) > _CERTAIN_LOSS * abs(step.work)
        if not united and ratio and certain and jump_in * jump_off >= 0:
            scale = step.loss / (jump_in + jump_off)
            jump_in, jump_off = scale * jump_in, scale * jump_off
        rest = step.loss - jump_in - jump_off
        return replace(
            self,
            work=self.work + step.work,
            jump_in=self.jump_in + jump_in,
            jump_off=self.jump_off + jump_off,
            coalescence=self.coalescence + (rest if united else 0.0),
            unattributed=self.unattributed + (0.0 if united else rest),
        )

    def add_load_jump(self, contact: ContactModel, before: State, after: State, pressure: float) -> EnergyBalance:
        """Return the balance after a jump at a constant pressure, Pa; this pressure does work."""
        work = -pressure * (after.separation - before.separation)
        stored = contact.stored_energy(after) - contact.stored_energy(before)
        return replace(self, work=self.work + work, load_jump=self.load_jump + work - stored)


@dataclass(frozen=True, eq=False)
class Waypoint:
    """Equilibrium on a path.

    Attributes
    ----------
    target : target that the state meets; a target of kind BETWEEN for a state between two targets.
    state : state of the contact.
    leg : number of the leg of the path: 0 for the first loading, 1 for the first unloading, and so on.
    step : step from the waypoint before, on a cyclic path.
    balance : energy balance, on a cyclic path.
    """

    target: Target
    state: State
    leg: int = 0
    step: Step | None = None
    balance: EnergyBalance | None = None

    @property
    def loading(self) -> bool:
        """True if the surfaces approach each other."""
        return self.leg % 2 == 0


def waypoint_without_target(state: State, leg: int, step: Step | None = None) -> Waypoint:
    """Return the waypoint of an equilibrium that meets no target."""
    return Waypoint(Target(BETWEEN, state.separation), state, leg, step)


_LOSSES = ("by_jump_in", "by_jump_off", "by_coalescence", "by_load_jump")


def summarise_loop(
    rows: Sequence[Mapping[str, float]],
    pull_off_row: int,
    material: Material,
    summit_pull_off_pressure: float,
    unattributed: float,
) -> dict[str, float]:
    """Return pull-off, detachment and losses of a closed loop, by the names of their variables.

    Parameters
    ----------
    rows : equilibria of the path in order, each with pressure, separation, area and energies by their names.
    pull_off_row : index of the row with the largest tension of the last unloading.
    material : material of the contact.
    summit_pull_off_pressure : tension if all summits pulled with their pull-off force at once, Pa.
    unattributed : loss that belongs to no kind of event, J/m^2.
    """
    last, adhesive = rows[-1], material.surface_energy > 0
    touching = rows[max((k for k, row in enumerate(rows) if row["spot_count"]), default=0)]
    tension = max(0.0, -rows[pull_off_row]["nominal_pressure"])
    # No energy is stored at either end of the loop.
    loss = last["work"]
    losses = {f"loss_{name}": last[f"dissipated_{name}"] for name in _LOSSES}
    return {
        "pull_off_pressure": tension,
        "pull_off_separation": rows[pull_off_row]["mean_separation"],
        "pull_off_over_strength": tension / material.interface_strength if adhesive else 0.0,
        "pull_off_over_summits": tension / summit_pull_off_pressure if summit_pull_off_pressure else 0.0,
        "detachment_pressure": touching["nominal_pressure"],
        "detachment_separation": touching["mean_separation"],
        "hysteresis_loss": loss,
        "hysteresis_loss_over_surface_energy": loss / material.surface_energy if adhesive else 0.0,
        **losses,
        "loss_unattributed": unattributed,
        "largest_contact_area_fraction": max(row["contact_area_fraction"] for row in rows),
        "largest_reduced_pressure": max(row["reduced_pressure"] for row in rows),
    }
