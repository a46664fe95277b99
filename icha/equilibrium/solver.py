"""Search for the equilibrium of all contact spots at a given mean separation, load or contact area.

The search alternates Newton steps and events. With adhesion contact forms and breaks in jumps. As soon as Newton's
method is close to an equilibrium, all jumps and unions that are due happen at once, and the method continues from
there.

Unions are undone when the surfaces part: a union splits where its two spots would no longer overlap; a union that jumps
off before that releases its asperities, of which those with a stable state of the law stay in contact.
"""

import hashlib
from collections import Counter
from dataclasses import replace

import numpy as np

from icha.contact.model import AREA_FRACTION, COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Control, FullContact, NotConverged
from icha.contact.models import RESIDUAL_TOLERANCE
from icha.equilibrium.equations import Equations, Point, nominal_value
from icha.equilibrium.iteration_state import IterationState
from icha.equilibrium.jumps import add_candidates, break_weakest, jump_in, jump_off
from icha.equilibrium.newton import newton_step, solve_response
from icha.equilibrium.sites import CANDIDATE, CONTACT, ContactState, Problem
from icha.equilibrium.unions import absorb_covered, merge_overlapping, set_union_heights, split_unions

# Error in h_rms below which jumps and unions happen. Those that are due by less than ten times the error wait for the
# equilibrium.
_EVENT_TOLERANCE = 3e-4
_EVENT_MARGIN = 10.0
# Largest number of Newton steps between two events, and of steps in all that need exact solutions of the linear
# equations: where more are needed, the step of the path is too long.
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
    problem: Problem, start: ContactState, separation: float, control: Control | None = None, *, break_first: int = 0
) -> ContactState:
    """Find the equilibrium at another mean separation, load or contact area, starting from an equilibrium.

    Newton steps solve the equations for the present spots. Whenever they are nearly solved, all events that are due
    happen at once: spots past jump-off break contact, free asperities beyond jump-in make contact, asperities under a
    spot are taken into it, and overlapping spots coalesce. The equilibrium is found when the equations are solved and
    no event is due.

    The search always ends. Without adhesion spots are only added or united (a spot of radius zero does no harm and is
    removed at the end). With adhesion an asperity that has broken contact may not make contact again at this
    separation; `pending` counts the asperities that this rule keeps out of contact.

    Parameters
    ----------
    separation : mean separation, or its first guess if there is a control, m.
    control : load or area to hold instead of the separation.
    break_first : number of spots that break contact first, those closest to jump-off.

    Raises `NotConverged` or `FullContact`, as `icha.contact.model.ContactModel.equilibrium` does.
    """
    state = IterationState.towards(problem, start, separation)
    if not problem.adhesive:
        state = add_candidates(state, separation)
    if break_first:
        state = break_weakest(state, separation, break_first)
    point = Equations(problem, state.sites, control).evaluate(state.sites.approach, separation)
    steps, exact_steps, wait = 0, 0, False
    visited: Counter = Counter()
    while True:
        state, point = _absorb_and_evaluate(state, point, control)
        equations = Equations(problem, state.sites, control)
        size = equations.error_size(point)
        # Here a relative error of the load weighs as much as the same error of the separation in h_rms.
        closeness = equations.error_size(point, 1.0)
        margin = _EVENT_MARGIN * closeness * problem.rms_height
        changed = False
        if size <= RESIDUAL_TOLERANCE:
            state, changed = apply_events(state, point, 0.0)
            if not changed:
                return _contact_state(state, point, control)
        elif closeness <= _EVENT_TOLERANCE and not wait:
            state, changed = apply_events(state, point, margin)
            wait = not changed  # events that are due by less wait for the equilibrium
        if not changed:
            if steps == _MAX_NEWTON_STEPS or exact_steps == _MAX_EXACT_STEPS:
                kind, count = ("", steps) if steps == _MAX_NEWTON_STEPS else ("exact ", exact_steps)
                raise NotConverged(f"equilibrium error {size:.2e} h_rms after {count} {kind}Newton steps")
            point, smaller, exact = newton_step(equations, point, size)
            exact_steps += exact
            if smaller:
                steps += 1
                continue
            state = _merge_singular(state, point, margin, size)
        equations = Equations(problem, state.sites, control)
        point = equations.evaluate(state.sites.approach, point.separation, point.interaction)
        state, point = set_union_heights(state, point)
        _count_round(state, visited)
        steps, wait = 0, False


def apply_events(state: IterationState, point: Point, margin: float) -> tuple[IterationState, bool]:
    """Apply all jumps and unions that are due by more than a margin, m; return whether there were any, too."""
    problem = state.problem
    area = nominal_value(problem, AREA_FRACTION, point.a, state.sites.radius_of_curvature)
    if area > _FULL_CONTACT:
        raise FullContact(f"the contact area reached {area:.2f} of the nominal area")
    before = state = state.with_approach(point.approach)
    state = jump_off(state, point, margin)
    changed = state is not before
    # Without adhesion only unexpected contacts are missing; they may wait for the equilibrium.
    if problem.adhesive or margin == 0:
        state, jumped = jump_in(state, point, margin)
        changed |= jumped
    before = state
    state = merge_overlapping(state, point, margin)
    if state.unloading:
        state = split_unions(state, point)
    return state, changed or state is not before


def _count_round(state, visited):
    """Count a round of events by the positions of its spots; raise `NotConverged` if the rounds do not end."""
    sites = state.sites
    places = np.rint(sites.position[sites.status == CONTACT] / (_SAME_PLACE * state.problem.asperities.period))
    checksum = hashlib.sha256(np.sort(places @ (1.0, 2 / _SAME_PLACE)).tobytes()).digest()
    visited[checksum] += 1
    rounds = visited.total()
    if rounds > _MAX_ROUNDS or visited[checksum] > _MAX_RETURNS:
        raise NotConverged(f"no equilibrium after {rounds} rounds of jumps and unions")


def _absorb_and_evaluate(state, point, control):
    """Let spots absorb new contacts inside them; if there are any, evaluate the equations again."""
    after = absorb_covered(state, point)
    if after is not state:
        equations = Equations(state.problem, after.sites, control)
        point = equations.evaluate(after.sites.approach, point.separation, point.interaction)
    return after, point


def _merge_singular(state, point, margin, size):
    """Merge spots where the edge of one runs through another, so that the equations are singular."""
    before = state.with_approach(point.approach)
    state = merge_overlapping(before, point, margin)
    if state is before:
        state = merge_overlapping(before, point, deep=True)
    if state is before:
        spots = np.count_nonzero(point.a)
        raise NotConverged(f"no Newton step reduces the equilibrium error of {size:.2e} h_rms with {spots} spots")
    return state


def _contact_state(state, point, control):
    """Return the equilibrium that has been found."""
    problem, start = state.problem, state.start
    response = solve_response(Equations(problem, state.sites, control), point)
    if not problem.adhesive:
        state = _update_candidates(state, point)
    sites = replace(state.sites, approach=point.approach, response=response)
    events = state.events()
    return ContactState(
        separation=point.separation,
        sites=sites,
        contact_radius=np.where(sites.status == CONTACT, point.a, 0.0),
        site_of_asperity=state.site_of_asperity,
        last_approach=state.last_approach,
        last_separation=state.last_separation,
        residual=float(np.max(np.abs(point.error), initial=0.0)) / problem.rms_height,
        jump_ins=start.jump_ins + events.count(JUMP_IN),
        jump_offs=start.jump_offs + events.count(JUMP_OFF),
        coalescences=start.coalescences + events.count(COALESCENCE),
        splits=start.splits + events.count(SPLIT),
        pending=state.pending,
        history=(*start.history, events) if len(events) else start.history,
    )


def _update_candidates(state, point):
    """Set the status of single asperities without adhesion: those that have made contact, and that have lost it."""
    sites, status, site_of_asperity = state.sites, state.sites.status.copy(), state.site_of_asperity.copy()
    made = np.flatnonzero((status == CANDIDATE) & (point.approach > 0))
    status[made] = CONTACT
    site_of_asperity[sites.asperity[made]] = made
    lost = np.flatnonzero((status == CONTACT) & (point.approach <= 0))
    status[lost] = CANDIDATE
    site_of_asperity[sites.asperity[lost]] = -1
    state = state.with_events(JUMP_IN, sites.position[made], 1, 0.0, sites.asperity[made])
    state = state.with_events(JUMP_OFF, sites.position[lost], 1)
    return replace(state, sites=replace(sites, status=status), site_of_asperity=site_of_asperity)
