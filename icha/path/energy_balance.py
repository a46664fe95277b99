"""Energy balance of a path: the work of every step, the stored energy, and the losses in events.

An event is a jump of a spot into or out of contact, the coalescence of two spots to a union, or the split of a union.
Between two events the stored energy changes by the work done, minus what receding fronts dissipate. An event changes
the stored energy at constant separation, and the released energy is lost. Over a closed path, all losses add up to the
area of the hysteresis loop of pressure against separation. Every jump has a reference loss: the energy that it would
release if its spot were alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from icha.asperity.material import Material
from icha.contact.model import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, ContactModel, Events, State, events_between
from icha.path.targets import BETWEEN, Target

# In these functions du and dp are the changes of separation (m) and pressure (Pa) in a step. At the start and at the
# end of the step, p and q are the pressures, Pa, and slope and end_slope are dp/du, Pa/m.


def pressure_jump(du, dp, slope, end_slope):
    """Return the change of pressure by the events of a step, Pa: the total change minus that by the mean stiffness."""
    return dp - 0.5 * du * (slope + end_slope)


def event_error(du, pressure_jump):
    """Return the largest error of the work of a step because its events may happen anywhere in the step, J/m^2."""
    return 0.5 * abs(du * pressure_jump)


# If the loss of a step exceeds this fraction of its work, jumps cause the loss. Below this fraction it may be an error:
# in the asperity model, the interaction of spots of different size is not exactly reciprocal.
_CERTAIN_LOSS = 0.1


def _extrapolate_to_full_contact(du, p, q, slope, end_slope):
    """Return finite pressures and slopes at both ends of a step from or to full contact, and the error of the work.

    Full contact is infinitely stiff, so its pressure does no work. This pressure jumps when the last gap closes or the
    first gap opens. Therefore it is replaced by an extrapolation along the tangent at the other end of the step.
    If both ends are full contact, return the given pressures, and 0 for the slopes and the error.
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
    front : energy that receding fronts dissipate, J/m^2.
    jump_error : largest error of the work because the pressure may jump anywhere in the step, J/m^2.
    may_change_pressure : whether there are events in which the pressure may jump; without adhesion these are only
        coalescences and splits.
    events : events of the step.
    """

    separation_change: float
    work: float
    stored: float
    front: float
    jump_error: float
    may_change_pressure: bool
    events: Events

    @classmethod
    def between(cls, contact: ContactModel, before: State, after: State) -> Step:
        """Return the step from one state to the next.

        The work is the integral of the cubic polynomial that has the pressures and stiffnesses of both states. If the
        stiffness is constant, the work is exact even if the pressure jumps in the middle of the step. For a step from
        or to full contact see `_extrapolate_to_full_contact`.
        """
        events = events_between(before, after)
        du = after.separation - before.separation
        p, q = contact.pressure(before), contact.pressure(after)
        slope, end_slope = -contact.stiffness(before), -contact.stiffness(after)
        error = event_error(du, pressure_jump(du, q - p, slope, end_slope))
        if np.isinf(slope) or np.isinf(end_slope):
            p, q, slope, end_slope, error = _extrapolate_to_full_contact(du, p, q, slope, end_slope)
        # Without adhesion contact forms and breaks without a jump of the pressure.
        count = len(events) if contact.adhesive else events.count(COALESCENCE) + events.count(SPLIT)
        return cls(
            separation_change=du,
            work=-(0.5 * du * (p + q) + du**2 * (slope - end_slope) / 12),
            stored=contact.stored_energy(after) - contact.stored_energy(before),
            front=contact.front_dissipation(after) - contact.front_dissipation(before),
            jump_error=error,
            may_change_pressure=bool(count),
            events=events,
        )

    @property
    def unites_or_splits(self) -> bool:
        """True if spots have coalesced or unions have split in the step."""
        return self.events.count(COALESCENCE) + self.events.count(SPLIT) > 0

    @property
    def work_error(self) -> float:
        """Largest error of the work, J/m^2: `jump_error`, but at most the loss if no event can have caused the loss."""
        return self.jump_error if self.may_change_pressure else min(self.jump_error, abs(self.loss))

    @property
    def released(self) -> float:
        """Absolute value of the energy released by jumps of spots, J/m^2."""
        return abs(self.loss) if self.may_change_pressure and not self.unites_or_splits else 0.0

    @property
    def loss(self) -> float:
        """Energy that is lost in events, J/m^2: work minus change of the stored energy minus dissipation of fronts."""
        return self.work - self.stored - self.front


@dataclass(frozen=True)
class EnergyBalance:
    """Work done on a contact since first contact, and the losses by each kind of event, all in J/m^2.

    Attributes
    ----------
    work : work done on the contact.
    jump_in, jump_off : losses by jumps into and out of contact.
    coalescence : loss by the coalescence of spots and by the splitting of unions.
    load_jump : loss by jumps at constant load, which happen only under load control.
    front : dissipation of receding fronts, whose work of adhesion is larger than that of advancing fronts.
    unattributed : all other losses, by jumps of fronts, and by errors of the integration and of the interaction.
    """

    work: float = 0.0
    jump_in: float = 0.0
    jump_off: float = 0.0
    coalescence: float = 0.0
    load_jump: float = 0.0
    front: float = 0.0
    unattributed: float = 0.0

    def add_step(self, contact: ContactModel, step: Step) -> EnergyBalance:
        """Return the balance after one more step.

        1. Jumps cause the whole loss if the step has no coalescence and no split, if the reference losses of the jumps
           into and out of contact have the same sign, and if the loss is within a factor of two of their sum or more
           than a tenth of the work. The jumps share the loss in proportion to their reference losses.
        2. In all other cases, each jump causes its reference loss, or none if spots do not jump. The rest of the loss
           is attributed to coalescence if the step has a coalescence or split; otherwise it is unattributed.
        """
        energy, kinds, united = step.events.energy, step.events.kind, step.unites_or_splits
        jump_in, jump_off = (float(energy[kinds == kind].sum()) / contact.area for kind in (JUMP_IN, JUMP_OFF))
        ratio = step.loss / ((jump_in + jump_off) or np.inf)
        certain = (contact.spots_jump and 0.5 < ratio < 2) or abs(step.loss) > _CERTAIN_LOSS * abs(step.work)
        if certain and ratio and not united and jump_in * jump_off >= 0:
            jump_in, jump_off = ratio * jump_in, ratio * jump_off
        elif not contact.spots_jump:
            jump_in = jump_off = 0.0
        rest = step.loss - jump_in - jump_off
        return replace(
            self,
            work=self.work + step.work,
            jump_in=self.jump_in + jump_in,
            jump_off=self.jump_off + jump_off,
            coalescence=self.coalescence + (rest if united else 0.0),
            front=self.front + step.front,
            unattributed=self.unattributed + (0.0 if united else rest),
        )

    def add_load_jump(self, contact: ContactModel, before: State, after: State, pressure: float) -> EnergyBalance:
        """Return the balance after a jump between two states at constant pressure, Pa; the pressure does work."""
        work = -pressure * (after.separation - before.separation)
        stored = contact.stored_energy(after) - contact.stored_energy(before)
        front = contact.front_dissipation(after) - contact.front_dissipation(before)
        lost = self.load_jump + work - stored - front
        return replace(self, work=self.work + work, load_jump=lost, front=self.front + front)


@dataclass(frozen=True, eq=False)
class Waypoint:
    """Equilibrium on a path.

    Attributes
    ----------
    target : target that the state meets; a target of kind BETWEEN for a state between targets.
    state : state of the contact.
    leg : number of the leg of the path: 0 for the first loading, 1 for the first unloading, and so on.
    step : step from the previous equilibrium of the path under separation control; None on a path that is not cyclic,
        up to first contact, and at the end of a jump at constant load if this load is met exactly.
    balance : energy balance from first contact to this waypoint; only on a cyclic path.
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


def waypoint_between_targets(state: State, leg: int, step: Step | None = None) -> Waypoint:
    """Return the waypoint of an equilibrium that meets no target of the path; its own target has the kind BETWEEN."""
    return Waypoint(Target(BETWEEN, state.separation), state, leg, step)


_LOSSES = ("by_jump_in", "by_jump_off", "by_coalescence", "by_load_jump")


def summarise_loop(
    rows: Sequence[Mapping[str, float]],
    pull_off_row: int,
    material: Material,
    summit_pull_off_pressure: float,
    unattributed: float,
    least_area: float = 0.0,
) -> dict[str, float]:
    """Return pull-off, detachment, losses and maxima of a loop that ends without contact.

    Detachment is the last state with contact. With boundary elements, the last contact shrinks through smaller and
    smaller parts of a cell, which mean nothing; so contacts smaller than a cell do not count.

    Parameters
    ----------
    rows : one row per equilibrium, in order: pressures, separation, area, energies and spot_count by variable name.
    pull_off_row : index of the row with the largest tension of the last unloading.
    material : material of the contact; ratios to the adhesion of the material are 0 if it has no adhesion.
    summit_pull_off_pressure : nominal tension if all summits had their pull-off force at the same time, Pa.
    unattributed : loss that is not attributed to any kind of event, J/m^2.
    least_area : smallest contact area fraction of a state that counts as contact.
    """
    last, adhesive = rows[-1], material.surface_energy > 0
    contacts = (k for k, row in enumerate(rows) if row["spot_count"] and row["contact_area_fraction"] >= least_area)
    touching = rows[max(contacts, default=0)]
    tension = max(0.0, -rows[pull_off_row]["nominal_pressure"])
    over_summits = tension / summit_pull_off_pressure if summit_pull_off_pressure else math.inf
    # No energy is stored at the start and at the end of the loop, so the whole work is lost.
    loss = last["work"]
    losses = {f"loss_{name}": last[f"dissipated_{name}"] for name in _LOSSES}
    losses["front_dissipation"] = last["dissipated_by_front"]
    return {
        "pull_off_pressure": tension,
        "pull_off_separation": rows[pull_off_row]["mean_separation"],
        "pull_off_over_strength": tension / material.receding.interface_strength if adhesive else 0.0,
        "pull_off_over_summits": over_summits if adhesive else 0.0,
        "detachment_pressure": touching["nominal_pressure"] if adhesive else 0.0,
        "detachment_separation": touching["mean_separation"],
        "hysteresis_loss": loss,
        "hysteresis_loss_over_surface_energy": loss / material.surface_energy if adhesive else 0.0,
        **losses,
        "loss_unattributed": unattributed,
        "largest_contact_area_fraction": max(row["contact_area_fraction"] for row in rows),
        "largest_reduced_pressure": max(row["reduced_pressure"] for row in rows),
    }
