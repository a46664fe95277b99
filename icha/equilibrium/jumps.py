"""Jumps into contact and out of it.

Jump-in: free asperities whose approach reaches that at which contact forms, eq. (3), become sites. Without adhesion
contact forms at an approach of zero and without a jump: there all asperities are sites that may come into contact, and
the iteration decides which do. Jump-off: spots past the end of their stable branch break contact, and united ones fall
into their asperities. Those of them that have a stable state of the law stay in contact.
"""

from dataclasses import replace

import numpy as np

from icha.asperity.coalescence import covering_spot
from icha.contact.model import JUMP_IN, JUMP_OFF, SPLIT
from icha.equilibrium.equations import Point
from icha.equilibrium.search import Search
from icha.equilibrium.sites import CONTACT, TRIAL
from icha.half_space.interaction import displacement_at

# Free asperities are looked at that can have come into contact since they were last looked at: their approach grows by
# at most so many times the fall of the separation; and, as spots jump, by so much at once, in h_rms and in the largest
# jump-off approach: on the way to an equilibrium that is a guess, at the equilibrium a bound.
_FASTEST_APPROACH = 3.0
_PROBABLE_APPROACH = 1.2
_SUDDEN_GUESS = 0.02, 2.0
_SUDDEN_BOUND = 1.0, 10.0


def with_candidates(search: Search, separation: float) -> Search:
    """Without adhesion: with sites of the asperities that will probably come into contact at a separation, m."""
    fall = search.seen_at - separation
    hopeful = search.seen + _PROBABLE_APPROACH * fall + _sudden(search.problem, _SUDDEN_GUESS) > 0
    candidates = np.flatnonzero(hopeful & search.free)
    # Where contact was lost the approach is not known, but small.
    expected = np.where(np.isfinite(fall), search.seen + fall, 0.0)
    return _admitted(search, candidates, TRIAL, expected[candidates])


def jump_in(search: Search, point: Point, margin: float) -> tuple[Search, bool]:
    """Sites of the free asperities beyond jump-in by more than the margin (m); and whether there were any.

    Those that lie under a spot are taken into it. What has just fallen out of a united spot was in contact, and stays
    so wherever there is a stable state.
    """
    problem, law, asperities = search.problem, search.problem.law, search.problem.asperities
    spots = np.flatnonzero((point.a > 0) & search.sites.present)
    a, there = point.a[spots], search.sites.position[spots]
    search, looked_at = _looked_at(search, point, spots, margin)
    fell = search.fallen[looked_at] >= 0
    needed = problem.jump_in[looked_at] + margin
    needed[fell] = law.jump_off_approach(asperities.radius_of_curvature[looked_at[fell]])
    ready = search.seen[looked_at] >= needed
    if not problem.adhesive:
        ready &= search.seen[looked_at] > 0
    locked, holder = search.locked.copy(), search.holder.copy()
    locked[looked_at[fell & ~ready]] = True
    ready = looked_at[ready]
    barred = locked[ready]
    pending, ready = int(np.count_nonzero(barred)), ready[~barred]
    under = covering_spot(asperities.position[ready], there, a, asperities.cell)
    holder[ready[under >= 0]] = spots[under[under >= 0]]
    ready = _first_of_each_group(search, ready[under < 0])
    source = search.fallen[ready]
    none = np.full(len(search.fallen), -1)
    search = replace(search, locked=locked, holder=holder, pending=pending, fallen=none)
    if not len(ready):
        return search, False
    stay, joining = np.unique(source[source >= 0]), ready[source < 0]
    search = search.noting(SPLIT, search.sites.position[stay], search.sites.members[stay])
    if problem.adhesive:
        # What approaches further before it is found is pressed, which sets nothing free.
        R = asperities.radius_of_curvature[joining]
        energy = -law.energy(law.contact_radius(problem.jump_in[joining], R), R)
        search = search.noting(JUMP_IN, asperities.position[joining], 1, energy, joining)
    return _admitted(search, ready, CONTACT if problem.adhesive else TRIAL, search.seen[ready]), True


def _sudden(problem, reach):
    """By how much the approach of an asperity can grow at once, m."""
    heights, jumps = reach
    largest_jump = -problem.law.jump_off_approach(np.max(problem.asperities.radius_of_curvature))
    return heights * problem.rms_height + jumps * largest_jump


def _looked_at(search, point, spots, margin):
    """The search with the approaches of the free asperities that can have come into contact, and which these are."""
    problem, asperities, sites = search.problem, search.problem.asperities, search.sites
    reach = search.seen + _FASTEST_APPROACH * np.abs(search.seen_at - point.separation)
    reach += _sudden(problem, _SUDDEN_GUESS if margin > 0 else _SUDDEN_BOUND)
    looked_at = np.flatnonzero((reach >= problem.jump_in) & search.free)
    w = displacement_at(
        problem.law,
        asperities.period,
        asperities.position[looked_at],
        sites.position[spots],
        point.a[spots],
        sites.radius_of_curvature[spots],
        sites.half_space.ewald.once,
    )
    seen, seen_at = search.seen.copy(), search.seen_at.copy()
    seen[looked_at] = asperities.height[looked_at] - point.separation - w
    seen_at[looked_at] = point.separation
    return replace(search, seen=seen, seen_at=seen_at), looked_at


def _first_of_each_group(search, joining):
    """Of asperities (k,) that would lie in each other's contacts, the largest; the others have to wait."""
    asperities = search.problem.asperities
    if len(joining) < 2:
        return joining
    position = asperities.position[joining]
    a = search.problem.law.contact_radius(search.seen[joining], asperities.radius_of_curvature[joining])
    under = covering_spot(position, position, a, asperities.cell, larger_than=a)
    return joining[under < 0]


def _admitted(search, asperity, status, approach):
    """With sites of free asperities (k,) with approaches (k,), m."""
    if not len(asperity):
        return search
    asperities, holder = search.problem.asperities, search.holder
    if status == CONTACT:
        holder = holder.copy()
        holder[asperity] = len(search.sites) + np.arange(len(asperity))
    sites = search.sites.extended(
        search.problem.law,
        position=asperities.position[asperity],
        height=asperities.height[asperity],
        radius_of_curvature=asperities.radius_of_curvature[asperity],
        asperity=asperity,
        members=np.ones(len(asperity), dtype=int),
        parts=np.full(len(asperity), None),
        approach=approach,
        status=status,
        known=False,
    )
    return replace(search, sites=sites, holder=holder)


# Spots whose distances from jump-off differ by this part are equal.
_SAME_STRENGTH = 1e-3


def jump_off(search: Search, point: Point, margin: float) -> Search:
    """All spots past jump-off by more than the margin (m) let go; without adhesion united ones out of contact.

    Those that have come in this search go before the others, which may well stay without them.
    """
    sites = search.sites
    off = sites.status == CONTACT
    if search.problem.adhesive:
        newly_made = off & ~sites.known
        off &= point.approach < sites.jump_off - margin
        if np.any(newly_made & (point.approach < sites.jump_off)):
            off &= newly_made
    else:  # a single asperity out of contact is harmless
        off &= (point.approach <= 0) & (sites.asperity < 0) & (margin == 0)
    return _broken(search, off) if off.any() else search


def let_go(search: Search, separation: float, count: int) -> Search:
    """Break the contact of `count` spots, those that would reach jump-off first, and of their equals."""
    sites = search.sites
    here = sites.approach - sites.response * (separation - search.start.separation)
    rate = np.maximum(-sites.response, 1e-3)
    left = np.where(sites.status == CONTACT, (here - sites.jump_off) / rate, np.inf)
    last = np.partition(left, count - 1)[count - 1]
    return _broken(search.at(here), left <= last * (1 + _SAME_STRENGTH))


def _broken(search, off):
    """Without the contact of spots (n,). Asperities of united ones fall back, if they have not done so here before;
    the others may not come back at this separation. An asperity that jumped in during this search and lets go again was
    never in contact."""
    sites, law = search.sites, search.problem.law
    came = np.isin(sites.asperity, search.jumped_in) & off
    spots = np.flatnonzero(off & ~came)
    R = sites.radius_of_curvature[spots]
    energy = law.energy(law.jump_off_radius(R), R)
    search = search.forgetting_jumps_in(sites.asperity[came])
    search = search.noting(JUMP_OFF, sites.position[spots], sites.members[spots], energy)
    # A holder -1 looks up the last.
    freed, united = np.append(off, False)[search.holder], np.append(off & (sites.asperity < 0), False)
    falls = united[search.holder] & ~search.has_fallen
    return replace(
        search,
        sites=sites.removed(off),
        holder=np.where(freed, -1, search.holder),
        seen_at=np.where(freed, np.inf, search.seen_at),  # their approach is not known
        fallen=np.where(falls, search.holder, search.fallen),
        has_fallen=search.has_fallen | falls,
        locked=search.locked | (freed & ~falls),
    )
