"""Checks of loops of loading and unloading: their events, their losses, and that they come apart."""

from collections.abc import Iterator

import numpy as np

from icha.checks.findings import IDENTITY_LIMIT, Finding
from icha.contact.models import RESIDUAL_TOLERANCE, model_of
from icha.path.energy_balance import integration_error, pressure_jump, unresolved_work
from icha.path.targets import UNRESOLVED_LOSS

# What the hysteresis loss of a run consists of.
LOSSES = ("loss_by_jump_in", "loss_by_jump_off", "loss_by_coalescence", "loss_by_load_jump", "loss_unattributed")
# The counts of events in a run, in the order of the flags of `event_kind`.
EVENT_COUNTS = ("jump_in_count", "jump_off_count", "coalescence_count", "split_count")

# Largest part of the largest work by which the work of a loop may be unknown. Where its steps leave more open than
# this, a gain of energy is a failure all the same.
LARGEST_UNKNOWN_WORK = 1e-2
# Largest gain by unions of spots and their undoing, over the largest work. The rule is not conservative: without
# adhesion loops close to a few hundredths of a per cent (docs/hysteresis.md).
UNION_LIMIT = 1e-3


def _largest_work(run):
    """The scale of energies of a run: as differences of works they are as accurate as the largest of those."""
    return float(np.max(np.abs(run["work"]))) or 1.0


def check_events(run) -> Iterator[Finding]:
    """Findings on the events of a run that goes on after its first loading."""
    logged = np.bincount(run["event_kind"], minlength=len(EVENT_COUNTS))
    counted = np.array([int(run[name][-1]) for name in EVENT_COUNTS])
    yield (
        "events",
        np.abs(logged - counted).sum(),
        0,
        "number of events that are counted and not logged, or logged only",
    )


def check_loop(run) -> Iterator[Finding]:
    """Findings on a run that ends in separation: its loss, and that nothing is left in contact."""
    scale = _largest_work(run)
    loss = float(run["hysteresis_loss"])
    parts = sum(float(run[name]) for name in LOSSES if name in run)
    yield (
        "loss adds up",
        abs(loss - parts) / scale,
        IDENTITY_LIMIT,
        "hysteresis loss against its parts, over the largest work",
    )
    yield (
        "loss is the work",
        abs(loss - float(run["work"][-1])) / scale,
        IDENTITY_LIMIT,
        "hysteresis loss against the work done up to complete separation, over the largest work",
    )
    yield from _losses(run, scale)
    yield "separated: spots", float(run["spot_count"][-1]), 0, "number of spots left in contact at the end of unloading"
    yield (
        "separated: pressure",
        abs(float(run["nominal_pressure"][-1])),
        0,
        "nominal pressure left at the end of unloading, in Pa",
    )
    back = run["nominal_pressure"][run["leg"] == int(run["leg"][-1])]
    yield (
        "pull-off pressure",
        abs(float(run["pull_off_pressure"]) + back.min()) / (np.abs(back).max() or 1.0),
        IDENTITY_LIMIT,
        "pull-off pressure against the largest tension of the last unloading, over the largest pressure there",
    )
    # What asperities unite by a rule patches do by themselves, and as they came.
    if float(run["surface_energy"]) == 0 and not _has_united(run):
        yield (
            "loop closes",
            abs(loss) / scale,
            IDENTITY_LIMIT + _error_of_work(run) / scale + 3 * model_of(run.attrs).accuracy.balance * _met_one_way(run),
            "hysteresis loss without adhesion or union by rule, where nothing is irreversible, over the largest work",
        )


def _has_united(run):
    """Whether spots have united by a rule, which may cost or gain a little energy."""
    return model_of(run.attrs).unites and int(run["coalescence_count"][-1]) > 0


def _losses(run, scale):
    """Findings on the loss of a loop and its parts: a passive contact gives back no more work than was put in."""
    unknown = IDENTITY_LIMIT + (_left_open(run) + _error_of_work(run)) / scale
    tolerance = min(unknown, LARGEST_UNKNOWN_WORK)
    with_unions = max(tolerance, UNION_LIMIT) if _has_united(run) else tolerance

    def gain(loss):
        return -min(loss, 0.0) / scale

    yield (
        "loop loses energy",
        gain(float(run["hysteresis_loss"])),
        with_unions,
        "energy gained in the whole loop, over the largest work",
    )
    into, off, unions, at_load = (
        float(run[f"dissipated_by_{name}"][-1]) for name in ("jump_in", "jump_off", "coalescence", "load_jump")
    )
    yield (
        "jumps lose energy",
        gain(into + off),
        tolerance,
        "energy gained in jumps into and out of contact together, over the largest work",
    )
    # A jump into contact may be uphill, by the law itself or by the forces of other spots: then only its sum with the
    # jump off is a loss. Datasets without the count do not tell.
    if "uphill_jump_in_count" in run and int(run["uphill_jump_in_count"]) == 0:
        yield (
            "jumps off lose energy",
            gain(off),
            tolerance,
            "energy gained in jumps out of contact, over the largest work",
        )
    yield (
        "unions lose energy",
        gain(unions),
        with_unions,
        "energy gained in unions of spots and their undoing, over the largest work",
    )
    yield (
        "load jumps lose energy",
        gain(at_load),
        tolerance,
        "energy gained in jumps at constant load, over the largest work",
    )


def _met_one_way(run):
    """At how many separations a path was on a later leg and not on the first.

    There one step of the first is two of the other, and each of the three knows its work only so well.
    """
    first, later = (np.unique(run["mean_separation"][run["leg"] == 0]), run["mean_separation"][run["leg"] > 0])
    same = 10 * RESIDUAL_TOLERANCE * float(run["rms_height"])
    after = np.searchsorted(first, later)
    nearest = np.minimum(
        np.abs(later - first[np.minimum(after, len(first) - 1)]), np.abs(later - first[np.maximum(after - 1, 0)])
    )
    return int(np.count_nonzero(nearest > same))


def _error_of_work(run):
    """By how much the work of a path may be wrong, as its equilibria are found to their tolerances only, J/m^2.

    An error of the separation is one of the pressure, times the stiffness; that of the stiffness enters the integral as
    the stiffness does, by the cubic through both ends of a step.
    """
    way, stiffness = np.abs(np.diff(run["mean_separation"])), run["contact_stiffness"]
    ends = np.abs(stiffness[1:]) + np.abs(stiffness[:-1])
    separation = RESIDUAL_TOLERANCE * float(run["rms_height"])
    relative = model_of(run.attrs).stiffness_error
    return float(np.sum(way * ends * (0.5 * separation + relative * way / 12)))


def _left_open(run):
    """By how much the work of the steps with events may be wrong, J/m^2, as it is not known where in them those happen.

    An event moves the work by what it changes the pressure by, times its distance from the middle of its step; and one
    that changes the stiffness alone by a part of the difference that this makes to the integral. No step may leave more
    open than UNRESOLVED_LOSS of what jumps have set free, or than the model's accuracy of the work and losses so far.
    """
    events = sum(np.diff(run[name]) for name in EVENT_COUNTS) > 0
    events &= np.diff(run["dissipated_by_load_jump"]) == 0  # there the pressure is constant
    width, slope = np.diff(run["mean_separation"]), -run["contact_stiffness"]
    jumped = pressure_jump(width, np.diff(run["nominal_pressure"]), slope[:-1], slope[1:])
    work = float(np.sum(events * (unresolved_work(width, jumped) + integration_error(width, slope[:-1], slope[1:]))))
    set_free = sum(abs(float(run[f"dissipated_by_{name}"][-1])) for name in ("jump_in", "jump_off"))
    lost = run["work"] - run["stored_energy"]
    effort = float(np.sum(np.abs(np.diff(run["work"])) + np.abs(np.diff(lost))))
    unknown = max(UNRESOLVED_LOSS * set_free, model_of(run.attrs).accuracy.loss * effort)
    return min(work, np.count_nonzero(events) * unknown)
