"""Search for the equilibrium of all contact spots at a given mean separation, load or contact area.

The search alternates Newton steps and rounds of events. Newton steps solve the equations for the present spots. Events
change the spots: jumps into and out of contact, coalescence of spots, and on unloading splits of unions.
"""

import hashlib
from collections import Counter
from dataclasses import replace

import numpy as np

from icha.contact.model import AREA_FRACTION, JUMP_IN, JUMP_OFF, Control, FullContact, NotConverged
from icha.contact.models import RESIDUAL_TOLERANCE
from icha.equilibrium.equations import Equations, Evaluation, pressure_or_area_fraction
from icha.equilibrium.iteration_state import IterationState
from icha.equilibrium.jumps import add_candidates, apply_jump_in, apply_jump_off, break_closest_to_jump_off
from icha.equilibrium.newton import newton_step, solve_response
from icha.equilibrium.sites import CANDIDATE, CONTACT, AsperityContact, ContactState
from icha.equilibrium.unions import (
    absorb_new_asperities,
    merge_overlapping,
    record_union_radii,
    set_union_heights,
    split_unions,
)

# The search applies events when its error is at most _EVENT_TOLERANCE h_rms. An event waits until the equations are
# solved if its condition is exceeded by less than _EVENT_MARGIN times the error.
_EVENT_TOLERANCE = 3e-4
_EVENT_MARGIN = 10.0
# Largest number of Newton steps between two rounds of events. Largest number of steps with the exact matrix in the
# whole search. If a search needs more steps, the step of the path is too long.
_MAX_NEWTON_STEPS = 60
_MAX_EXACT_STEPS = 4
# Largest number of rounds of events; a surface with many equal summits may need many. Largest number of rounds that
# lead to the same spots; unions that form and split again and again have no equilibrium.
_MAX_ROUNDS, _MAX_RETURNS = 1000, 10
# Positions of spots are rounded to this part of the period when the spots of two rounds are compared.
_SAME_PLACE = 1e-6
# The model of spots has no meaning if the contact area fraction exceeds this value.
_FULL_CONTACT = 0.5


def find_equilibrium(
    contact: AsperityContact, start: ContactState, separation: float, control: Control | None = None, *, let_go: int = 0
) -> ContactState:
    """Find the equilibrium at another mean separation, load or contact area, starting from an equilibrium.

    Parameters and exceptions are those of `icha.contact.model.ContactModel.equilibrium`. With a `control`, `separation`
    is only the first guess. `let_go` is the number of spots that break contact before the first Newton step.
    When the equations are nearly solved, all events that are due are applied. If no Newton step reduces the error,
    overlapping spots merge. The search ends when the equations are solved and no event is due.

    An asperity that has broken contact may not make contact again in this search; `barred_count` counts the asperities
    that this rule keeps out of contact.
    """
    state = IterationState.start_search(contact, start, separation)
    if not contact.adhesive:
        state = add_candidates(state, separation)
    if let_go:
        state = break_closest_to_jump_off(state, separation, let_go)
    evaluation = Equations(contact, state.sites, control).evaluate(state.sites.approach, separation)
    steps, exact_steps, wait = 0, 0, False
    visited: Counter = Counter()
    while True:
        before, state = state, absorb_new_asperities(state, evaluation)
        equations = Equations(contact, state.sites, control)
        if state is not before:
            evaluation = equations.evaluate(state.sites.approach, evaluation.separation, evaluation.interaction)
        size = equations.error_size(evaluation)
        # With the weight 1, a relative error of the load counts as much as the same error of the approaches in h_rms.
        loose_size = equations.error_size(evaluation, 1.0)
        margin = _EVENT_MARGIN * loose_size * contact.rms_height
        changed = False
        if size <= RESIDUAL_TOLERANCE:
            state, changed = apply_events(state, evaluation, 0.0)
            if not changed:
                return _build_contact_state(state, evaluation, control)
        elif loose_size <= _EVENT_TOLERANCE and not wait:
            state, changed = apply_events(state, evaluation, margin)
            wait = not changed  # look for events again when the equations are solved
        if not changed:
            if steps == _MAX_NEWTON_STEPS or exact_steps == _MAX_EXACT_STEPS:
                taken = f"{steps} Newton steps; steps with the exact matrix: {exact_steps}"
                raise NotConverged(f"equilibrium error still {size:.2e} h_rms after {taken}")
            evaluation, smaller, exact = newton_step(equations, evaluation, size)
            exact_steps += exact
            if smaller:
                steps += 1
                continue
            state = _merge_after_failed_step(state, evaluation, margin, size)
        equations = Equations(contact, state.sites, control)
        evaluation = equations.evaluate(state.sites.approach, evaluation.separation, evaluation.interaction)
        state, evaluation = set_union_heights(state, evaluation)
        _check_events_end(state, visited)
        steps, wait = 0, False


def apply_events(state: IterationState, evaluation: Evaluation, margin: float) -> tuple[IterationState, bool]:
    """Apply a round of events: jump-offs, jump-ins, coalescences and, on unloading, splits.

    An event occurs if its condition is exceeded by more than a margin, m. Splits need no margin. Without adhesion,
    jump-ins occur only if the margin is 0. Return two values: the new state, which contains the approaches of
    `evaluation`; and whether a site was added, removed or replaced. Raise `FullContact` if more than half the nominal
    area is in contact.
    """
    contact = state.contact
    R = state.sites.radius_of_curvature
    area = pressure_or_area_fraction(contact, evaluation.law, AREA_FRACTION, evaluation.a, R)
    if area > _FULL_CONTACT:
        raise FullContact(f"the contact area reached {area:.2f} of the nominal area, above the limit {_FULL_CONTACT}")
    state = state.with_approach(evaluation.approach)
    if not contact.adhesive:
        # If a candidate is out of contact now, the asperities that it covered belong to no site.
        state = _free_asperities(state, (state.sites.status == CANDIDATE) & (evaluation.approach <= 0))
    before = state
    state = apply_jump_off(state, evaluation, margin)
    changed = state is not before
    # Without adhesion, probable contacts are already candidates. Other candidates follow when the margin is 0.
    if contact.adhesive or margin == 0:
        state, jumped = apply_jump_in(state, evaluation, margin)
        changed |= jumped
    before = state
    state = merge_overlapping(state, evaluation, margin)
    if state.unloading:
        state = split_unions(state, evaluation)
    return state, changed or state is not before


def _check_events_end(state, visited):
    """Count this round in `visited`; raise `NotConverged` if rounds are too many, in all or with the same spots."""
    sites = state.sites
    places = np.rint(sites.position[sites.status == CONTACT] / (_SAME_PLACE * state.contact.asperities.period))
    checksum = hashlib.sha256(np.sort(places @ (1.0, 2 / _SAME_PLACE)).tobytes()).digest()
    visited[checksum] += 1
    rounds = visited.total()
    if rounds > _MAX_ROUNDS or visited[checksum] > _MAX_RETURNS:
        raise NotConverged(f"no equilibrium after {rounds} rounds of jumps and unions")


def _merge_after_failed_step(state, evaluation, margin, size):
    """Merge overlapping spots because no Newton step succeeds, and return the new state.

    Merge the pairs that overlap even if the approaches are wrong by the margin, m. If there are no such pairs,
    merge the pairs in which one spot covers the centre of the other. If both kinds are missing, raise `NotConverged`.
    size : error of the equilibrium, in h_rms, for the message.
    """
    before = state.with_approach(evaluation.approach)
    state = merge_overlapping(before, evaluation, margin)
    if state is before:
        state = merge_overlapping(before, evaluation, deep=True)
    if state is before:
        spots = np.count_nonzero(evaluation.a)
        raise NotConverged(f"no Newton step reduces the equilibrium error of {size:.2e} h_rms with {spots} spots")
    return state


def _build_contact_state(state, evaluation, control):
    """Build the `ContactState` at the end of a search, with the responses of the sites.

    Without adhesion, `_update_candidates` first decides which sites are in contact, and logs the changes.
    """
    contact, history = state.contact, state.start.history
    response = solve_response(Equations(contact, state.sites, control), evaluation)
    if not contact.adhesive:
        state = _update_candidates(state, evaluation)
    touching, events = state.sites.status == CONTACT, state.events()
    state = state.with_radii(touching, evaluation.a[touching])
    radius = np.where(touching, evaluation.a, 0.0)
    lowest = contact.law.lowest_approach(state.sites.radius_of_curvature, radius)
    found = {"approach": evaluation.approach, "response": response}
    found["union"] = record_union_radii(state.sites, radius)
    sites = replace(state.sites, contact_radius=radius, jump_off_approach=lowest, **found)
    return ContactState(
        separation=evaluation.separation,
        sites=sites,
        law=evaluation.law,
        site_of_asperity=state.site_of_asperity,
        last_approach=state.last_approach,
        last_separation=state.last_separation,
        residual=float(np.max(np.abs(evaluation.error), initial=0.0)) / contact.rms_height,
        barred_count=state.barred_count,
        receded_area=state.receded_area,
        history=(*history, events) if len(events) else history,
    )


def _update_candidates(state, evaluation):
    """Turn candidates with an approach > 0 into contacts, and contacts with an approach <= 0 into candidates.

    Used only without adhesion. Log both changes as events. Asperities that a lost contact covered then have no site.
    """
    sites, status, site_of_asperity = state.sites, state.sites.status.copy(), state.site_of_asperity.copy()
    made = np.flatnonzero((status == CANDIDATE) & (evaluation.approach > 0))
    status[made] = CONTACT
    site_of_asperity[sites.asperity[made]] = made
    lost = (status == CONTACT) & (evaluation.approach <= 0)
    state = _free_asperities(replace(state, site_of_asperity=site_of_asperity), lost)
    status[lost] = CANDIDATE
    state = state.with_events(JUMP_IN, sites.position[made], 1, 0.0, sites.asperity[made])
    state = state.with_events(JUMP_OFF, sites.position[lost], 1)
    return replace(state, sites=replace(sites, status=status))


def _free_asperities(state, sites):
    """Return the state in which no asperity belongs to the given sites, a mask (n,)."""
    freed = np.isin(state.site_of_asperity, np.flatnonzero(sites))
    site_of_asperity = np.where(freed, -1, state.site_of_asperity)
    last_separation = np.where(freed, np.inf, state.last_separation)  # the present approach is not known
    return replace(state, site_of_asperity=site_of_asperity, last_separation=last_separation)
