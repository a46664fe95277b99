"""Jumps of asperities into contact and out of it.

Jump-in: an asperity makes contact when its approach reaches the jump-in approach, eq. (3). Without adhesion contact
forms at an approach of zero and without a jump. Therefore, without adhesion all asperities that may come into contact
are candidates. The approaches of the candidates are unknowns of the equations, and the solution shows which candidates
are in contact. Jump-off: a spot past jump-off, with an approach below its jump-off approach, breaks contact.

The asperities of a broken spot, also those that it only covers, lose their site. The asperities of a union are
released: they stay in contact if they have a stable state and are not under a larger new spot. The asperities of other
spots are barred: they do not make contact again in this search. An asperity that was released before is barred too.
"""

from dataclasses import replace

import numpy as np

from icha.asperity.coalescence import covering_spot
from icha.contact.model import JUMP_IN, JUMP_OFF, SPLIT
from icha.equilibrium.equations import Evaluation
from icha.equilibrium.iteration_state import IterationState
from icha.equilibrium.sites import CANDIDATE, CONTACT
from icha.half_space.interaction import displacement_at

# Largest increase of the approach of an asperity out of contact, divided by the increase or decrease of the separation.
_LARGEST_APPROACH_RATE = 3.0
# Usual increase of the approach of such an asperity, divided by the decrease of the separation.
_USUAL_APPROACH_RATE = 1.2
# Jumps of other spots may increase an approach by up to x h_rms + y |delta_off|, where delta_off is the jump-off
# approach of the bluntest asperity. Pairs of x and y: a guess during the search, and a bound at the end of the search.
_SUDDEN_GUESS = 0.02, 2.0
_SUDDEN_BOUND = 1.0, 10.0
# Spots break contact together if the increases of the separation up to their jump-offs differ by at most this fraction.
_TIE_TOLERANCE = 1e-3


def add_candidates(state: IterationState, separation: float) -> IterationState:
    """Add the asperities that will probably touch at a separation, m, as candidates; used only without adhesion."""
    fall = state.last_separation - separation
    growth = _USUAL_APPROACH_RATE * fall + _sudden_growth(state.contact, *_SUDDEN_GUESS)
    candidates = np.flatnonzero((state.last_approach + growth > 0) & state.lacks_site)
    # If an asperity was in contact just before, its approach is small, but not known.
    expected = np.where(np.isfinite(fall), state.last_approach + fall, 0.0)
    return _add_sites(state, candidates, CANDIDATE, expected[candidates])


def apply_jump_in(state: IterationState, evaluation: Evaluation, margin: float) -> tuple[IterationState, bool]:
    """Add sites for the asperities that are ready for contact; return the new state, and whether sites were added.

    An asperity is ready if its approach is at least the jump-in approach plus a margin, m. An asperity that a union has
    released since the last call is ready if its approach is at least the jump-off approach; otherwise it is barred.

    1. A ready asperity that was barred before stays out of contact and is counted in `barred_count`.
    2. A ready asperity under a spot becomes part of this spot. It does not count as an added site.
    3. A ready asperity under the larger spot of another ready one gets no site; in the next call it must reach jump-in.
    4. Any other ready asperity gets a site: a contact with adhesion, a candidate without adhesion. If a union has
       released the asperity, a split of the union is logged. For other contacts, a jump-in is logged.
    """
    contact, law, asperities = state.contact, state.contact.law, state.contact.asperities
    spots = np.flatnonzero((evaluation.a > 0) & state.sites.present)
    state, evaluated = _evaluate_approaches(state, evaluation, spots, margin)
    released = state.released_from[evaluated] >= 0
    threshold = contact.jump_in_approach[evaluated] + margin
    R = asperities.radius_of_curvature[evaluated[released]]
    threshold[released] = law.lowest_approach(R, law.jump_off_radius(R))
    ready = state.last_approach[evaluated] >= threshold
    if not contact.adhesive:
        ready &= state.last_approach[evaluated] > 0
    barred, site_of_asperity = state.barred.copy(), state.site_of_asperity.copy()
    barred[evaluated[released & ~ready]] = True
    ready = evaluated[ready]
    barred_count, ready = int(np.count_nonzero(barred[ready])), ready[~barred[ready]]
    under = covering_spot(asperities.position[ready], state.sites.position[spots], evaluation.a[spots], asperities.cell)
    site_of_asperity[ready[under >= 0]] = spots[under[under >= 0]]
    ready = _select_uncovered(state, ready[under < 0])
    source = state.released_from[ready]
    state = replace(state, barred=barred, site_of_asperity=site_of_asperity, barred_count=barred_count)
    state = replace(state, released_from=np.full(len(barred), -1))
    if not len(ready):
        return state, False
    splits, jumping = np.unique(source[source >= 0]), ready[source < 0]
    state = state.with_events(SPLIT, state.sites.position[splits], state.sites.members[splits])
    if contact.adhesive:
        # The jump releases the energy at the jump-in approach. External work causes any further approach.
        R = asperities.radius_of_curvature[jumping]
        energy = -law.energy(law.contact_radius(contact.jump_in_approach[jumping], R), R)
        state = state.with_events(JUMP_IN, asperities.position[jumping], 1, energy, jumping)
    return _add_sites(state, ready, CONTACT if contact.adhesive else CANDIDATE, state.last_approach[ready]), True


def _sudden_growth(contact, x, y):
    """Return x h_rms + y |delta_off|, m, a possible increase of an approach by jumps of spots (see _SUDDEN_GUESS)."""
    R = np.max(contact.asperities.radius_of_curvature)
    return x * contact.rms_height - y * contact.law.receding.jump_off_approach(R)


def _evaluate_approaches(state, evaluation, spots, margin):
    """Compute the approaches of the asperities without site that may have reached jump-in, and store them in the state.

    If `margin` is 0, an upper bound of the approaches selects the asperities, otherwise a guess that may miss some.
    Return the new state and these indices. `spots` : indices of the present sites with a positive contact radius.
    """
    contact, asperities, sites = state.contact, state.contact.asperities, state.sites
    largest = state.last_approach + _LARGEST_APPROACH_RATE * np.abs(state.last_separation - evaluation.separation)
    largest += _sudden_growth(contact, *(_SUDDEN_GUESS if margin > 0 else _SUDDEN_BOUND))
    evaluated = np.flatnonzero((largest >= contact.jump_in_approach) & state.lacks_site)
    points, position = asperities.position[evaluated], sites.position[spots]
    a, R, ewald = evaluation.a[spots], sites.radius_of_curvature[spots], sites.half_space.ewald.for_one_sum
    law = evaluation.law.select(spots)
    w = displacement_at(law, asperities.period, points, position, a, R, ewald)
    last_approach, last_separation = state.last_approach.copy(), state.last_separation.copy()
    last_approach[evaluated] = asperities.height[evaluated] - evaluation.separation - w
    last_separation[evaluated] = evaluation.separation
    return replace(state, last_approach=last_approach, last_separation=last_separation), evaluated


def _select_uncovered(state, jumping):
    """Return the jumping asperities (indices) that will not lie under the larger spot of another jumping one."""
    asperities = state.contact.asperities
    position = asperities.position[jumping]
    a = state.contact.law.contact_radius(state.last_approach[jumping], asperities.radius_of_curvature[jumping])
    under = covering_spot(position, position, a, asperities.cell, larger_than=a)
    return jumping[under < 0]


def _add_sites(state, asperity, status, approach):
    """Return the state with new sites for k asperities (indices); only contacts are entered in `site_of_asperity`."""
    if not len(asperity):
        return state
    asperities, site_of_asperity = state.contact.asperities, state.site_of_asperity
    if status == CONTACT:
        site_of_asperity = site_of_asperity.copy()
        site_of_asperity[asperity] = len(state.sites) + np.arange(len(asperity))
    sites = state.sites.append(
        state.contact.law,
        position=asperities.position[asperity],
        height=asperities.height[asperity],
        radius_of_curvature=asperities.radius_of_curvature[asperity],
        contact_radius=state.contact.law.jump_off_radius(asperities.radius_of_curvature[asperity]),
        asperity=asperity,
        members=np.ones(len(asperity), dtype=int),
        union=np.full(len(asperity), None),
        approach=approach,
        status=status,
        counts_as_old=False,
    )
    return replace(state, sites=sites, site_of_asperity=site_of_asperity)


def apply_jump_off(state: IterationState, evaluation: Evaluation, margin: float) -> IterationState:
    """Break the contact of the spots whose approach is below the jump-off approach by more than a margin, m.

    As long as a new spot (`Sites.counts_as_old` is False) is past jump-off, even by less than the margin, no old spot
    breaks contact: the old spots may be stable without the new one. Without adhesion, only unions break contact here,
    and only if the margin is 0. A single asperity with a negative approach needs no jump-off, because it exerts no
    force. Return the new state, or `state` itself if no spot breaks contact.
    """
    sites = state.sites
    breaking = sites.status == CONTACT
    if state.contact.adhesive:
        new = breaking & ~sites.counts_as_old
        breaking &= evaluation.approach < sites.jump_off_approach - margin
        if np.any(new & (evaluation.approach < sites.jump_off_approach)):
            breaking &= new
    else:
        breaking &= (evaluation.approach <= 0) & (sites.asperity < 0) & (margin == 0)
    return _break_contact(state, breaking) if breaking.any() else state


def break_closest_to_jump_off(state: IterationState, separation: float, count: int) -> IterationState:
    """Break the contact of the `count` spots closest to jump-off, and of spots equally close; return the new state.

    The closest spots are those that reach jump-off after the smallest increase of the separation from the start of the
    search, as their responses predict. The new state has the approaches of the start, not the extrapolated ones.

    separation : mean separation to which the search has extrapolated the approaches, m.
    count : number of spots to break, not larger than the number of spots in contact.
    """
    sites = state.sites
    approach = sites.approach - sites.response * (separation - state.start.separation)
    rate = np.maximum(-sites.response, 1e-3)  # a spot that moves away from jump-off counts as slow
    rise = np.where(sites.status == CONTACT, (approach - sites.jump_off_approach) / rate, np.inf)
    last = np.partition(rise, count - 1)[count - 1]
    return _break_contact(state.with_approach(approach), rise <= last * (1 + _TIE_TOLERANCE))


def _break_contact(state, breaking):
    """Break the contact of the spots where the mask `breaking` (n,) is True, and log their jump-offs.

    A union releases its asperities, also those that it only covers, except asperities that were already released in
    this search. All other asperities of broken spots are barred. If an asperity has jumped in during this search, its
    jump-in is deleted from the log, and no jump-off is logged.
    """
    sites, law = state.sites, state.contact.law
    new = np.isin(sites.asperity, [row[4] for row in state.log if row[0] == JUMP_IN]) & breaking
    spots = np.flatnonzero(breaking & ~new)
    R = sites.radius_of_curvature[spots]
    energy = law.jump_off_energy(R, sites.contact_radius[spots])
    state = state.with_radii(spots, 0.0).delete_jumps_in(sites.asperity[new])
    state = state.with_events(JUMP_OFF, sites.position[spots], sites.members[spots], energy)
    # For asperities without a site, -1 selects the appended value False.
    freed = np.append(breaking, False)[state.site_of_asperity]
    released = np.append(breaking & (sites.asperity < 0), False)[state.site_of_asperity] & ~state.was_released
    return replace(
        state,
        sites=sites.remove(breaking),
        site_of_asperity=np.where(freed, -1, state.site_of_asperity),
        last_separation=np.where(freed, np.inf, state.last_separation),  # the present approach is not known
        released_from=np.where(released, state.site_of_asperity, state.released_from),
        was_released=state.was_released | released,
        barred=state.barred | (freed & ~released),
    )
