"""Jump-off: spots past the end of their stable branch break contact, and united ones fall into their asperities.

Those asperities of a united spot that have a stable state of the law stay in contact; `jump_in` does this.
"""

from dataclasses import replace

import numpy as np

from icha.contact.model import JUMP_OFF
from icha.equilibrium.equations import Point
from icha.equilibrium.search import Search
from icha.equilibrium.sites import CONTACT

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
