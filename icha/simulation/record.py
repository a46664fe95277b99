"""Record of a path: the values of all its states, snapshots and events."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from icha.contact.model import (
    EVENT_KINDS,
    JUMP_IN,
    BeyondModel,
    ContactModel,
    Events,
    NotConverged,
    State,
    events_between,
)
from icha.datasets.variables.run import INDENTER, OF_MODELS, RUN
from icha.datasets.variables.terms import is_refused
from icha.path.energy_balance import Waypoint
from icha.path.follow import follow
from icha.path.targets import Target
from icha.references.indenter_runs import step_values

# Kind of the snapshot at the largest tension during unloading.
PULL_OFF = "pull_off"


@dataclass
class PathRecord:
    """Values of all steps, snapshots and events of a path, and the reason if the path ends early.

    Attributes
    ----------
    failure : reason why the path ends early; empty for a complete path.
    beyond_model : whether the path ends early because it leaves the range of the model.
    steps, snapshots : for every step and snapshot, a dictionary of values by variable name.
    events : events of every step: jumps in and out of contact, coalescence and splitting of spots.
    unattributed : energy loss that is not attributed to any kind of event, J/m^2.
    pressed : state with the largest contact area during the first loading.
    """

    failure: str = ""
    beyond_model: bool = False
    steps: list[dict] = field(default_factory=list)
    snapshots: list[dict] = field(default_factory=list)
    events: list[Events] = field(default_factory=list)
    unattributed: float = 0.0
    pressed: State | None = None


def count_uphill_jumps_in(record: PathRecord) -> int:
    """Count the jumps into contact that cost energy, by the law of a spot or by the energy balance."""
    gained = np.diff([step["dissipated_by_jump_in"] for step in record.steps], prepend=0.0) < 0
    return sum(
        int(np.count_nonzero((events.kind == JUMP_IN) & ((events.energy < 0) | uphill)))
        for events, uphill in zip(record.events, gained, strict=True)
    )


def record_path(contact, observables, path, reachable, progress) -> PathRecord:
    """Follow a path and return the record of its steps, snapshots and events.

    reachable : path without targets outside the range of the model; the record ends before the first such target.
    """
    left_out = [target for target in path.targets if target not in reachable.targets]
    remaining = len(reachable.targets)
    record, before, weakest, largest = PathRecord(), contact.untouched(), None, 0.0
    counts = np.zeros(len(EVENT_KINDS), int)

    def record_snapshot(target, state, step):
        """Add a snapshot of a state to the record; `step` is the index of the step of this state."""
        row = {"snapshot_step": step, "snapshot_kind": target.snapshot_kind, "snapshot_target": target.value}
        record.snapshots.append(_require_finite(row | observables.of_snapshot(state)))

    try:
        for waypoint in follow(contact, reachable, progress):
            state, index = waypoint.state, len(record.steps)
            events = events_between(before, state)
            counts = counts + events.counts()
            numbers = {f"{kind}_count": count for kind, count in zip(EVENT_KINDS, counts, strict=True)}
            step = _step_values(contact, waypoint) | numbers | observables.of_step(state)
            step = _require_finite(step | step_values(step, contact.area))
            record.steps.append(step)
            record.events.append(events)
            record.unattributed = waypoint.balance.unattributed if waypoint.balance else 0.0
            before = state
            if waypoint.leg == 0 and step["contact_area_fraction"] >= largest:
                record.pressed, largest = state, step["contact_area_fraction"]
            if waypoint.target.snapshot:
                record_snapshot(waypoint.target, state, index)
            # Keep the state with the largest tension in the last leg, that is, in the last loading or unloading.
            tension = waypoint.leg, -step["nominal_pressure"]
            if weakest is None or tension > weakest[0]:
                weakest = tension, state, index
            remaining -= waypoint.target in reachable.targets
            if left_out and not remaining:
                raise BeyondModel(f"before {left_out[0].describe()}, which is outside the range of the model")
        if path.unload:
            record_snapshot(Target(PULL_OFF, 0.0), *weakest[1:])
    except NotConverged as error:
        record.failure, record.beyond_model = f"the path ends {error}", isinstance(error, BeyondModel)
    return record


def _require_finite(values: dict) -> dict:
    """Return the values; raise `NotConverged` if a value is neither finite nor of a variable that may be infinite."""
    table = RUN | OF_MODELS | INDENTER
    for name, value in values.items():
        numbers = np.asarray(value)
        if numbers.dtype.kind == "f" and is_refused(numbers, table[name].further if name in table else {}).any():
            raise NotConverged(f"with values of {name} that are not finite")
    return values


def _step_values(contact: ContactModel, waypoint: Waypoint) -> dict:
    """Return those values of an equilibrium that exist in all contact models, by variable name."""
    state, target, balance = waypoint.state, waypoint.target, waypoint.balance
    pressure = contact.pressure(state)
    row = {
        "branch": "loading" if waypoint.loading else "unloading",
        "mean_separation": state.separation,
        "mean_gap": contact.mean_gap(state),
        "nominal_pressure": pressure,
        "contact_area_fraction": contact.area_fraction(state),
        "spot_count": contact.spot_count(state),
        "contact_stiffness": contact.stiffness(state),
        "converged": 1,
        "leg": waypoint.leg,
        "reduced_pressure": pressure / contact.pressure_unit,
        "reduced_separation": state.separation / contact.rms_height,
        "step_kind": target.kind,
        "step_target": target.value,
    }
    if balance is None:
        return row
    kinds = ("jump_in", "jump_off", "coalescence", "load_jump", "front")
    row |= {"work": balance.work, "stored_energy": contact.stored_energy(state)}
    return row | {f"dissipated_by_{kind}": getattr(balance, kind) for kind in kinds}
