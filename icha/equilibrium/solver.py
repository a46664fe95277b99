"""Search for the equilibrium of all contact spots at a given mean separation, load or contact area.

The search alternates Newton steps and events. With adhesion contact forms and breaks in jumps. As soon as Newton's
method is close to an equilibrium, all jumps and unions that are due happen at once, and the method continues from
there.

Unions are undone when the surfaces move apart: a union splits where its two spots would no longer overlap; a union that
jumps off before that releases its asperities, of which those with a stable state of the law stay in contact.
"""

import hashlib
from collections import Counter
from dataclasses import replace

import numpy as np

from icha.contact.model import AREA_FRACTION, COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Control, FullContact, NotConverged
from icha.contact.models import RESIDUAL_TOLERANCE
from icha.equilibrium.equations import Equations, Evaluation, nominal_value
from icha.equilibrium.iteration_state import IterationState
from icha.equilibrium.jumps import add_candidates, apply_jump_in, apply_jump_off, break_closest_to_jump_off
from icha.equilibrium.newton import newton_step, solve_response
from icha.equilibrium.sites import CANDIDATE, CONTACT, AsperityContact, ContactState
from icha.equilibrium.unions import absorb_covered, merge_overlapping, set_union_heights, split_unions

# Error in h_rms below which jumps and unions happen. Those that are due by less than ten times the error wait for the
# equilibrium.
_EVENT_TOLERANCE = 3e-4
_EVENT_MARGIN = 10.0
# Largest number of Newton steps between two events, and of steps in all with the exact matrix: where more are needed,
# the step of the path is too long.
_MAX_NEWTON_STEPS = 60
_MAX_EXACT_STEPS = 4
# Largest number of rounds of events, of which there may be many where many summits are alike; and of rounds that lead
# to the same spots: if unions are made and undone in a circle, there is no equilibrium.
_MAX_ROUNDS, _MAX_RETURNS = 1000, 10
# Distance, in periods, up to which two spots count as the same.
_SAME_PLACE = 1e-6
# Contact area fraction from which on spots have lost all meaning.
_FULL_CONTACT = 0.5


def find_equilibrium(
    contact: AsperityContact, start: ContactState, separation: float, control: Control | None = None, *, let_go: int = 0
) -> ContactState:
    """Find the equilibrium at another mean separation, load or contact area, starting from an equilibrium.

    Newton steps solve the equations for the present spots. Whenever they are nearly solved, all events that are due
    happen at once: spots past jump-off break contact, asperities beyond jump-in make contact, asperities under a spot
    are taken into it, overlapping spots coalesce, and on unloading unions split. The equilibrium is found when the
    equations are solved and no event is due.

    The search ends with an equilibrium or with an error. An asperity that has broken contact may not make contact again
    at this separation; `barred_count` counts the asperities that this rule keeps out of contact. Without adhesion a
    single spot of radius zero does no harm and becomes a candidate at the end.

    Parameters
    ----------
    separation : mean separation, or its first guess if there is a control, m.
    control : load or area to hold instead of the separation.
    let_go : number of spots that break contact first, those closest to jump-off.

    Raises `NotConverged` or `FullContact`, as `icha.contact.model.ContactModel.equilibrium` does.
    """
    state = IterationState.towards(contact, start, separation)
    if not contact.adhesive:
        state = add_candidates(state, separation)
    if let_go:
        state = break_closest_to_jump_off(state, separation, let_go)
    evaluation = Equations(contact, state.sites, control).evaluate(state.sites.approach, separation)
    steps, exact_steps, wait = 0, 0, False
    visited: Counter = Counter()
    while True:
        state, evaluation = _absorb_and_evaluate(state, evaluation, control)
        equations = Equations(contact, state.sites, control)
        size = equations.error_size(evaluation)
        # Here a relative error of the load weighs as much as the same error of the separation in h_rms.
        closeness = equations.error_size(evaluation, 1.0)
        margin = _EVENT_MARGIN * closeness * contact.rms_height
        changed = False
        if size <= RESIDUAL_TOLERANCE:
            state, changed = apply_events(state, evaluation, 0.0)
            if not changed:
                return _contact_state(state, evaluation, control)
        elif closeness <= _EVENT_TOLERANCE and not wait:
            state, changed = apply_events(state, evaluation, margin)
            wait = not changed  # events that are due by less wait for the equilibrium
        if not changed:
            if steps == _MAX_NEWTON_STEPS or exact_steps == _MAX_EXACT_STEPS:
                count = f"{steps} Newton steps"
                if steps < _MAX_NEWTON_STEPS:
                    count = f"{exact_steps} Newton steps with the exact matrix"
                raise NotConverged(f"equilibrium error {size:.2e} h_rms after {count}")
            evaluation, smaller, exact = newton_step(equations, evaluation, size)
            exact_steps += exact
            if smaller:
                steps += 1
                continue
            state = _merge_after_failed_step(state, evaluation, margin, size)
        equations = Equations(contact, state.sites, control)
        evaluation = equations.evaluate(state.sites.approach, evaluation.separation, evaluation.interaction)
        state, evaluation = set_union_heights(state, evaluation)
        _count_round(state, visited)
        steps, wait = 0, False


def apply_events(state: IterationState, evaluation: Evaluation, margin: float) -> tuple[IterationState, bool]:
    """Apply all jumps and unions due by more than a margin, m, and on unloading all splits; return whether any was."""
    contact = state.contact
    area = nominal_value(contact, AREA_FRACTION, evaluation.a, state.sites.radius_of_curvature)
    if area > _FULL_CONTACT:
        raise FullContact(f"the contact area reached {area:.2f} of the nominal area")
    before = state = state.with_approach(evaluation.approach)
    state = apply_jump_off(state, evaluation, margin)
    changed = state is not before
    # Without adhesion the candidates already cover the expected contacts; the others wait for the equilibrium.
    if contact.adhesive or margin == 0:
        state, jumped = apply_jump_in(state, evaluation, margin)
        changed |= jumped
    before = state
    state = merge_overlapping(state, evaluation, margin)
    if state.unloading:
        state = split_unions(state, evaluation)
    return state, changed or state is not before


def _count_round(state, visited):
    """Count a round of events by the positions of its spots; raise `NotConverged` if the rounds do not end."""
    sites = state.sites
    places = np.rint(sites.position[sites.status == CONTACT] / (_SAME_PLACE * state.contact.asperities.period))
    checksum = hashlib.sha256(np.sort(places @ (1.0, 2 / _SAME_PLACE)).tobytes()).digest()
    visited[checksum] += 1
    rounds = visited.total()
    if rounds > _MAX_ROUNDS or visited[checksum] > _MAX_RETURNS:
        raise NotConverged(f"no equilibrium after {rounds} rounds of jumps and unions")


def _absorb_and_evaluate(state, evaluation, control):
    """Let spots absorb new contacts inside them; if there are any, evaluate the equations again."""
    after = absorb_covered(state, evaluation)
    if after is not state:
        equations = Equations(state.contact, after.sites, control)
        evaluation = equations.evaluate(after.sites.approach, evaluation.separation, evaluation.interaction)
    return after, evaluation


def _merge_after_failed_step(state, evaluation, margin, size):
    """Merge overlapping spots after a failed Newton step; if none, those of which one covers the centre of another.

    Raise `NotConverged` if nothing merges.
    """
    before = state.with_approach(evaluation.approach)
    state = merge_overlapping(before, evaluation, margin)
    if state is before:
        state = merge_overlapping(before, evaluation, deep=True)
    if state is before:
        spots = np.count_nonzero(evaluation.a)
        raise NotConverged(f"no Newton step reduces the equilibrium error of {size:.2e} h_rms with {spots} spots")
    return state


def _contact_state(state, evaluation, control):
    """Return the equilibrium that has been found."""
    contact, start = state.contact, state.start
    response = solve_response(Equations(contact, state.sites, control), evaluation)
    if not contact.adhesive:
        state = _update_candidates(state, evaluation)
    sites = replace(state.sites, approach=evaluation.approach, response=response)
    events = state.events()
    return ContactState(
        separation=evaluation.separation,
        sites=sites,
        contact_radius=np.where(sites.status == CONTACT, evaluation.a, 0.0),
        site_of_asperity=state.site_of_asperity,
        last_approach=state.last_approach,
        last_separation=state.last_separation,
        residual=float(np.max(np.abs(evaluation.error), initial=0.0)) / contact.rms_height,
        jump_ins=start.jump_ins + events.count(JUMP_IN),
        jump_offs=start.jump_offs + events.count(JUMP_OFF),
        coalescences=start.coalescences + events.count(COALESCENCE),
        splits=start.splits + events.count(SPLIT),
        barred_count=state.barred_count,
        history=(*start.history, events) if len(events) else start.history,
    )


def _update_candidates(state, evaluation):
    """Set the status of single asperities without adhesion: those that have made contact, and that have lost it."""
    sites, status, site_of_asperity = state.sites, state.sites.status.copy(), state.site_of_asperity.copy()
    made = np.flatnonzero((status == CANDIDATE) & (evaluation.approach > 0))
    status[made] = CONTACT
    site_of_asperity[sites.asperity[made]] = made
    lost = np.flatnonzero((status == CONTACT) & (evaluation.approach <= 0))
    status[lost] = CANDIDATE
    site_of_asperity[sites.asperity[lost]] = -1
    state = state.with_events(JUMP_IN, sites.position[made], 1, 0.0, sites.asperity[made])
    state = state.with_events(JUMP_OFF, sites.position[lost], 1)
    return replace(state, sites=replace(sites, status=status), site_of_asperity=site_of_asperity)
