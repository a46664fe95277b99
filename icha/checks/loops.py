"""Checks of loops of loading and unloading: events, losses, and complete separation at the end of the loop."""

from collections.abc import Iterator

import numpy as np

from icha.checks.findings import IDENTITY_LIMIT
from icha.contact.models import RESIDUAL_TOLERANCE, model_of
from icha.datasets.quantities import LOSS_PARTS
from icha.path.energy_balance import event_error, pressure_jump

# Counts of events in a run, in the order of the flags of `event_kind`.
EVENT_COUNTS = ("jump_in_count", "jump_off_count", "coalescence_count", "split_count")

# With asperities, a loop may gain as much energy as the error of the work, up to this fraction of the largest work.
LARGEST_UNKNOWN_WORK = 1e-2
# Largest gain of energy in a loop of boundary elements, divided by the largest work. This value is the error of the
# losses, because a path limits the error of the work in every step (docs/short_range.md).
CELL_LOSS_LIMIT = 1e-3
# Largest loss of a loop of boundary elements without adhesion, divided by the largest work. The exact loss is zero.
CELL_CLOSURE_LIMIT = 1e-4
# Largest gain of energy by unions of spots and splits of unions, divided by the largest work. The rule of unions
# nearly conserves energy: without adhesion, loops close within 0.004 % (docs/hysteresis.md).
UNION_LIMIT = 1e-3

# Meanings of the checks of energies, which are differences of works. A run whose energies are wrong keeps its pull-off,
# areas and gaps, which are those of equilibria.
OF_ENERGIES = {
    "loss adds up": "difference between the hysteresis loss and the sum of its parts, divided by the largest work",
    "loss is the work": "difference between the hysteresis loss and the work of the loop, divided by the largest work",
    "loop loses energy": "energy gained in the whole loop, divided by the largest work",
    "jumps lose energy": "energy gained in jumps into and out of contact together, divided by the largest work",
    "jumps off lose energy": "energy gained in jumps out of contact, divided by the largest work",
    "unions lose energy": "energy gained in coalescence and splitting of spots, divided by the largest work",
    "load jumps lose energy": "energy gained in jumps at constant load, divided by the largest work",
    "loop closes": "hysteresis loss divided by largest work; must be zero without adhesion and coalescence",
}
# Meanings of the other checks of a loop.
OF_LOOPS = {
    "events": "number of events that are only in the counts of events or only in the list of events",
    "separated: spots": "number of spots left in contact at the end of unloading",
    "separated: pressure": "nominal pressure left at the end of unloading, in Pa",
    "pull-off pressure": "difference between the pull-off pressure and the largest tension of the last unloading, "
    "divided by the largest pressure of this unloading",
}


def check_loop(run) -> Iterator[tuple]:
    """Yield name, value and limit of the checks of a loop: losses, pull-off and complete separation at the end."""
    # All energies are differences of works, so their errors are relative to the largest work.
    scale = float(np.max(np.abs(run["work"]))) or 1.0
    loss = float(run["hysteresis_loss"])
    parts = sum(float(run[name]) for name in LOSS_PARTS if name in run)
    yield "loss adds up", abs(loss - parts) / scale, IDENTITY_LIMIT
    yield "loss is the work", abs(loss - float(run["work"][-1])) / scale, IDENTITY_LIMIT
    yield from _check_losses(run, scale)
    yield "separated: spots", float(run["spot_count"][-1]), 0
    yield "separated: pressure", abs(float(run["nominal_pressure"][-1])), 0
    back = run["nominal_pressure"][run["leg"] == int(run["leg"][-1])]
    error = abs(float(run["pull_off_pressure"]) + back.min()) / (np.abs(back).max() or 1.0)
    yield "pull-off pressure", error, IDENTITY_LIMIT
    # The rule for unions of asperities may lose energy. Patches of boundary elements merge and split reversibly.
    if float(run["surface_energy"]) == 0 and not _has_united(run):
        model = model_of(run.attrs)
        unknown = work_error(run) / scale + 3 * model.accuracy.reversible_work * count_unshared_separations(run)
        yield "loop closes", abs(loss) / scale, CELL_CLOSURE_LIMIT if model.by_cells else IDENTITY_LIMIT + unknown


def _has_united(run):
    """Return whether spots have united by a rule; such unions may lose or gain a little energy."""
    return model_of(run.attrs).by_summits and int(run["coalescence_count"][-1]) > 0


def _check_losses(run, scale):
    """Yield the checks that neither a loop nor a kind of event gains energy: name, value and limit."""
    unknown = IDENTITY_LIMIT + (_event_error_bound(run) + work_error(run)) / scale
    tolerance = CELL_LOSS_LIMIT if model_of(run.attrs).by_cells else min(unknown, LARGEST_UNKNOWN_WORK)
    with_unions = max(tolerance, UNION_LIMIT) if _has_united(run) else tolerance
    into, out, unions, at_load = (
        float(run[f"dissipated_by_{name}"][-1]) for name in ("jump_in", "jump_off", "coalescence", "load_jump")
    )

    def gain(loss):
        return -min(loss, 0.0) / scale

    yield "loop loses energy", gain(float(run["hysteresis_loss"])), with_unions
    yield "jumps lose energy", gain(into + out), tolerance
    # A jump into contact may need energy, due to the law of a spot or due to the forces of other spots. In a run with
    # such a jump, the check requires only that jumps into and out of contact together lose energy.
    if int(run["uphill_jump_in_count"]) == 0:
        yield "jumps off lose energy", gain(out), tolerance
    yield "unions lose energy", gain(unions), with_unions
    yield "load jumps lose energy", gain(at_load), tolerance


def count_unshared_separations(run) -> int:
    """Count the separations in later legs (unloading, reloading) at which the first loading has no step.

    Each of these separations divides one step of the first loading into two steps of the later leg. Each step adds an
    error of the work.
    """
    first, later = (np.unique(run["mean_separation"][run["leg"] == 0]), run["mean_separation"][run["leg"] > 0])
    same = 10 * RESIDUAL_TOLERANCE * float(run["unit_height"])
    after = np.searchsorted(first, later)
    nearest = [np.abs(later - first[np.clip(k, 0, len(first) - 1)]) for k in (after - 1, after)]
    return int(np.count_nonzero(np.minimum(*nearest) > same))


def finite_stiffness(run) -> np.ndarray:
    """Return the contact stiffness, Pa/m; zero instead of infinity in full contact, whose pressure does no work."""
    return np.where(np.isfinite(run["contact_stiffness"]), run["contact_stiffness"], 0.0)


def work_error(run) -> float:
    """Return an upper bound (J/m^2) of the work error of a path, computed from the tolerances of the equilibria.

    The error of the pressure is the error of the separation multiplied by the stiffness. An error of the stiffness
    changes the cubic polynomial between both ends of a step; the work is the integral of this cubic.
    """
    width, stiffness = np.abs(np.diff(run["mean_separation"])), finite_stiffness(run)
    ends = np.abs(stiffness[1:]) + np.abs(stiffness[:-1])
    separation = RESIDUAL_TOLERANCE * float(run["unit_height"])
    relative = model_of(run.attrs).stiffness_error
    return float(np.sum(width * ends * (0.5 * separation + relative * width / 12)))


def _event_error_bound(run):
    """Return an upper bound (J/m^2) of the work error due to unknown positions of events within their steps."""
    events = sum(np.diff(run[name]) for name in EVENT_COUNTS) > 0
    events &= np.diff(run["dissipated_by_load_jump"]) == 0  # in a jump at constant load the pressure is constant
    width, slope = np.diff(run["mean_separation"]), -finite_stiffness(run)
    jumped = pressure_jump(width, np.diff(run["nominal_pressure"]), slope[:-1], slope[1:])
    return float(np.sum(events * event_error(width, jumped)))
