"""The energy balance of a path, its waypoints, and the hysteresis of a whole cycle.

A part of the work done on a contact is stored, the rest is lost in jumps.

Between two events the stored energy changes by the work done. An event, at a given separation, changes the energy at
once; what it sets free is lost. Over a closed path the losses of all events make up the area of the loop, the integral
of p over u.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from icha.asperity.material import Material
from icha.contact.model import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, ContactModel, Events, State
from icha.path.targets import BETWEEN, Target


def pressure_jump(width, change, slope, end_slope):
    """By how much a change of the pressure over a step misses that along the tangents at its ends, Pa."""
    return change - 0.5 * width * (slope + end_slope)


def unresolved_work(width, pressure_jump):
    """Bound of the error of the work of a step with events: they may all lie at either of its ends, J/m^2."""
    return 0.5 * abs(width * pressure_jump)


def integration_error(width, slope, end_slope):
    """Bound of the error of the work of a step where it is smooth, J/m^2."""
    return width**2 * abs(end_slope - slope) / 24


# Of the work of a step, the part from which on its loss is that of its jumps, and not what is not reciprocal.
_PLAIN_LOSS = 0.1


@dataclass(frozen=True)
class Step:
    """From one equilibrium of a path to the next: work, change of energy and events.

    width: change of the mean separation, m. work: done on the contact, -(integral of p du), J/m^2. gained: stored
    energy, J/m^2. pressure_jump: by which events changed the pressure, Pa. integration_error: bound of the error
    of the integral where it is smooth, J/m^2. sudden: whether there are events that may change the pressure.
    """

    width: float
    work: float
    gained: float
    pressure_jump: float
    integration_error: float
    sudden: bool
    events: Events

    @classmethod
    def between(cls, contact: ContactModel, before: State, after: State) -> Step:
        """The step from one state to the next.

        The integral is that of the cubic with the pressures and stiffnesses at both ends; jumps are taken to happen
        half way.
        """
        events = contact.events_between(before, after)
        width = after.separation - before.separation
        p, q = contact.pressure(before), contact.pressure(after)
        slope, end_slope = -contact.stiffness(before), -contact.stiffness(after)
        # Without adhesion contact forms and breaks without a jump of the pressure.
        jumps = len(events) if contact.adhesive else events.count(COALESCENCE) + events.count(SPLIT)
        return cls(
            width=width,
            work=-(0.5 * width * (p + q) + width**2 * (slope - end_slope) / 12),
            gained=contact.stored_energy(after) - contact.stored_energy(before),
            pressure_jump=pressure_jump(width, q - p, slope, end_slope) if jumps else 0.0,
            integration_error=integration_error(width, slope, end_slope),
            sudden=bool(jumps),
            events=events,
        )

    @property
    def unites(self) -> bool:
        """Whether spots have united or unions have been undone."""
        return self.events.count(COALESCENCE) + self.events.count(SPLIT) > 0

    @property
    def lost(self) -> float:
        """Work that is not stored, J/m^2."""
        return self.work - self.gained

    def set_free(self, contact: ContactModel) -> float:
        """Energy that the jumps of the step set free, as if every spot were alone, J/m^2."""
        return float(np.abs(self.events.energy).sum()) / contact.area

    @property
    def unresolved(self) -> float:
        """Bound of the error of the work, since it is not known where in the step its events happen, J/m^2."""
        return unresolved_work(self.width, self.pressure_jump)


@dataclass(frozen=True)
class EnergyBalance:
    """Work done on a contact since first contact and what has been lost of it, by the kind of event, J/m^2.

    unattributed: lost without an event, or beside what jumps lose: errors of the integration, and what is not
    reciprocal in a model's interaction.
    """

    work: float = 0.0
    jump_in: float = 0.0
    jump_off: float = 0.0
    coalescence: float = 0.0
    load_jump: float = 0.0
    unattributed: float = 0.0

    @property
    def lost(self) -> float:
        """Sum of all losses, J/m^2."""
        return self.jump_in + self.jump_off + self.coalescence + self.load_jump + self.unattributed

    def after(self, contact: ContactModel, step: Step) -> EnergyBalance:
        """The balance after one more step.

        A step whose only events are jumps has lost its energy in them, if this is about what they would lose if their
        spots were alone, or if it is not small compared with the work; both kinds of jumps share it as if every spot
        were alone. Otherwise, where spots also united, and where one kind of jump gains what the other loses, jumps
        have lost just what their spots would lose alone. The rest belongs to unions and their undoing, where there were
        any, and is otherwise unattributed.
        """
        events, united = step.events, step.unites
        jump_in, jump_off = (
            float(events.energy[events.kind == kind].sum()) / contact.area for kind in (JUMP_IN, JUMP_OFF)
        )
        ratio = step.lost / ((jump_in + jump_off) or np.inf)
        plain = 0.5 < ratio < 2 or abs(step.lost) > _PLAIN_LOSS * abs(step.work)
        if not united and ratio and plain and jump_in * jump_off >= 0:
            scale = step.lost / (jump_in + jump_off)
            jump_in, jump_off = scale * jump_in, scale * jump_off
        rest = step.lost - jump_in - jump_off
        return replace(
            self,
            work=self.work + step.work,
            jump_in=self.jump_in + jump_in,
            jump_off=self.jump_off + jump_off,
            coalescence=self.coalescence + (rest if united else 0.0),
            unattributed=self.unattributed + (0.0 if united else rest),
        )

    def after_load_jump(self, work: float, gained: float) -> EnergyBalance:
        """The balance after a jump under load control, in which a constant pressure does work."""
        return replace(self, work=self.work + work, load_jump=self.load_jump + work - gained)


@dataclass(frozen=True, eq=False)
class Waypoint:
    """An equilibrium on a path: what it was asked to reach, and on which leg (0 the first loading, 1 back, …).

    step: to it from the waypoint before, and balance: of the energy, on a cyclic path.
    """

    target: Target
    state: State
    leg: int = 0
    step: Step | None = None
    balance: EnergyBalance | None = None

    @property
    def loading(self) -> bool:
        """Whether the surfaces are being pressed together."""
        return self.leg % 2 == 0


def between_stops(state: State, leg: int, step: Step | None = None) -> Waypoint:
    """The waypoint of an equilibrium between the stops."""
    return Waypoint(Target(BETWEEN, state.separation), state, leg, step)


_LOSSES = ("by_jump_in", "by_jump_off", "by_coalescence", "by_load_jump")


def hysteresis(
    steps: Sequence[Mapping[str, float]],
    pull_off: int,
    material: Material,
    largest_tension: float,
    unattributed: float,
) -> dict[str, float]:
    """Pull-off, detachment and losses, by the names of their variables.

    Parameters
    ----------
    steps : the path's equilibria in order, each with pressure, separation, area and energies by their names.
    pull_off : which of them has the largest tension of the last unloading.
    material : half-space and interface.
    largest_tension : Pa, of all asperities at once.
    unattributed : what is in no class of losses, J/m^2.
    """
    last, adhesive = steps[-1], material.surface_energy > 0
    touching = steps[max((k for k, step in enumerate(steps) if step["spot_count"]), default=0)]
    tension = max(0.0, -steps[pull_off]["nominal_pressure"])
    # Nothing is stored at either end.
    loss = last["work"]
    losses = {f"loss_{name}": last[f"dissipated_{name}"] for name in _LOSSES}
    strength = 16 / (9 * np.sqrt(3)) * material.surface_energy / material.interaction_range
    return {
        "pull_off_pressure": tension,
        "pull_off_separation": steps[pull_off]["mean_separation"],
        "pull_off_over_strength": tension / strength if adhesive else 0.0,
        "pull_off_over_summits": tension / largest_tension if adhesive else 0.0,
        "detachment_pressure": touching["nominal_pressure"],
        "detachment_separation": touching["mean_separation"],
        "hysteresis_loss": loss,
        "hysteresis_loss_over_surface_energy": loss / material.surface_energy if adhesive else 0.0,
        **losses,
        "loss_unattributed": unattributed,
        "largest_contact_area_fraction": max(step["contact_area_fraction"] for step in steps),
        "largest_reduced_pressure": max(step["reduced_pressure"] for step in steps),
    }
