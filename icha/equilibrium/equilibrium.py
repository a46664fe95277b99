"""Equilibrium of all contact spots at a given mean separation, load or contact area: Newton's steps and events.

With adhesion contact forms and breaks in jumps. As soon as Newton's iteration is close to an equilibrium, all jumps and
unions that apply happen at once, and the iteration goes on from there.

Unions are undone when the surfaces part: where the two spots that a united one was made of would no longer overlap; or
where it lets go before that, and falls back into its asperities (those that a stable state of the law holds stay in
contact).
"""

import hashlib
from collections import Counter
from dataclasses import replace

import numpy as np

from icha.contact.model import AREA_FRACTION, COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Control, FullContact, NotConverged
from icha.contact.models import RESIDUAL_TOLERANCE
from icha.equilibrium.equations import Equations, Point, held_value
from icha.equilibrium.jumps import jump_in, jump_off, let_go, with_candidates
from icha.equilibrium.newton import descend, response
from icha.equilibrium.search import Search
from icha.equilibrium.sites import CONTACT, TRIAL, ContactState, Problem
from icha.equilibrium.unions import settled, swallow, undo, unite

# Error in h_rms below which jumps and unions happen; one that hangs by less than ten times the error waits.
_EVENT_TOLERANCE = 3e-4
_EVENT_MARGIN = 10.0
# Newton steps between two events; and of those that take exact solutions of the linear equations in all: where many are
# needed, the step of the path is too long.
_MAX_NEWTON_STEPS = 60
_MAX_EXACT_STEPS = 4
# Rounds of jumps and unions in all: they end, but may be many where many summits are alike. And those that lead to the
# same spots: where unions are made and undone in a circle there is no equilibrium.
_MAX_ROUNDS, _MAX_RETURNS = 1000, 10
# Spots closer than this, in periods, are the same.
_SAME_PLACE = 1e-6
# Contact area fraction at which the spots have lost all meaning.
_FULL_CONTACT = 0.5


def equilibrium(
    problem: Problem, state: ContactState, separation: float, control: Control | None = None, *, spots_let_go: int = 0
) -> ContactState:
    """Bring the contact from one state to another mean separation, or to a given load or area.

    Spots past jump-off are dropped, free asperities beyond jump-in join, asperities under a spot are taken into it
    and overlapping spots coalesce, all that apply at once, until nothing changes. That ends: without adhesion spots
    are only added or united (one of radius zero is harmless and is removed at the end); with adhesion an asperity
    that has broken contact here may not make it again at this separation (`pending` counts those that would, and
    without adhesion those left by a united spot that let go). Arguments and errors as of
    `icha.contact.model.ContactModel.equilibrium`.
    """
    search = Search.towards(problem, state, separation)
    if not problem.adhesive:
        search = with_candidates(search, separation)
    if spots_let_go:
        search = let_go(search, separation, spots_let_go)
    point = Equations(problem, search.sites, control).at(search.sites.approach, separation)
    steps, exact_steps, rounds, quiet = 0, 0, 0, False
    visited: Counter = Counter()
    while True:
        search, point = _without_swallowed(search, point, control)
        equations = Equations(problem, search.sites, control)
        size = equations.size(point)
        # A missed load is one of the separation, about the same part of h_rms.
        closeness = equations.size(point, 1.0)
        margin = _EVENT_MARGIN * closeness * problem.rms_height
        changed = False
        if size <= RESIDUAL_TOLERANCE:
            search, changed = happen(search, point, 0.0)
            if not changed:
                return _state(search, point, control)
        elif closeness <= _EVENT_TOLERANCE and not quiet:
            search, changed = happen(search, point, margin)
            quiet = not changed  # what hangs by less waits for the equilibrium
        if not changed:
            if steps == _MAX_NEWTON_STEPS:
                raise NotConverged(f"equilibrium error {size:.2e} h_rms after {steps} Newton steps")
            if exact_steps == _MAX_EXACT_STEPS:
                raise NotConverged(f"equilibrium error {size:.2e} h_rms after {exact_steps} exact Newton steps")
            point, nearer, exact = descend(equations, point, size)
            exact_steps += exact
            if nearer:
                steps += 1
                continue
            search = _united_for_descent(search, point, margin, size)
        equations = Equations(problem, search.sites, control)
        search, point = settled(search, equations.at(search.sites.approach, point.separation, point.interaction))
        steps, quiet, rounds = 0, False, rounds + 1
        here = _places(search)
        visited[here] += 1
        if rounds > _MAX_ROUNDS or visited[here] > _MAX_RETURNS:
            raise NotConverged(f"no equilibrium after {rounds} rounds of jumps and unions")


def happen(search: Search, point: Point, margin: float) -> tuple[Search, bool]:
    """The search after all jumps and unions that are due by more than the margin (m); and whether there were any."""
    problem = search.problem
    covered = held_value(problem, AREA_FRACTION, point.a, search.sites.radius_of_curvature)
    if covered > _FULL_CONTACT:
        raise FullContact(f"the contact area reached {covered:.2f} of the nominal one")
    before = search = search.at(point.approach)
    search = jump_off(search, point, margin)
    changed = search is not before
    # Without adhesion only who was not expected is missing, which may wait for the equilibrium.
    if problem.adhesive or margin == 0:
        search, joined = jump_in(search, point, margin)
        changed |= joined
    before = search
    search = unite(search, point, margin)
    if search.parting:
        search = undo(search, point)
    return search, changed or search is not before


def _places(search):
    """Where the spots are, to tell whether they are the same as before; a checksum."""
    sites = search.sites
    at = np.rint(sites.position[sites.status == CONTACT] / (_SAME_PLACE * search.problem.asperities.period))
    return hashlib.sha256(np.sort(at @ (1.0, 2 / _SAME_PLACE)).tobytes()).digest()


def _without_swallowed(search, point, control):
    """Search and point without new contacts that others have taken in."""
    after = swallow(search, point)
    if after is not search:
        equations = Equations(search.problem, after.sites, control)
        point = equations.at(after.sites.approach, point.separation, point.interaction)
    return after, point


def _united_for_descent(search, point, margin, size):
    """With those spots united where the edge of one runs through another, so that the equations are singular."""
    before = search.at(point.approach)
    search = unite(before, point, margin)
    if search is before:
        search = unite(before, point, deep=True)
    if search is before:
        raise NotConverged(
            f"no descent from an equilibrium error of {size:.2e} h_rms with {np.count_nonzero(point.a)} spots"
        )
    return search


def _state(search, point, control):
    """The equilibrium that has been found."""
    problem, start = search.problem, search.start
    last = response(Equations(problem, search.sites, control), point)
    if not problem.adhesive:
        search = _contact_or_not(search, point)
    sites = replace(search.sites, approach=point.approach, response=last)
    events = search.events()
    return ContactState(
        separation=point.separation,
        sites=sites,
        contact_radius=np.where(sites.status == CONTACT, point.a, 0.0),
        holder=search.holder,
        seen=search.seen,
        seen_at=search.seen_at,
        residual=float(np.max(np.abs(point.error), initial=0.0)) / problem.rms_height,
        jump_ins=start.jump_ins + events.count(JUMP_IN),
        jump_offs=start.jump_offs + events.count(JUMP_OFF),
        coalescences=start.coalescences + events.count(COALESCENCE),
        splits=start.splits + events.count(SPLIT),
        pending=search.pending,
        history=(*start.history, events) if len(events) else start.history,
    )


def _contact_or_not(search, point):
    """Without adhesion: which single asperities have come into contact in the iteration, and which have lost it."""
    sites, status, holder = search.sites, search.sites.status.copy(), search.holder.copy()
    made = np.flatnonzero((status == TRIAL) & (point.approach > 0))
    status[made] = CONTACT
    holder[sites.asperity[made]] = made
    idle = np.flatnonzero((status == CONTACT) & (point.approach <= 0))
    status[idle] = TRIAL
    holder[sites.asperity[idle]] = -1
    search = search.noting(JUMP_IN, sites.position[made], 1, 0.0, sites.asperity[made])
    search = search.noting(JUMP_OFF, sites.position[idle], 1)
    return replace(search, sites=replace(sites, status=status), holder=holder)
