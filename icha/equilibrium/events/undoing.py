"""Undoing of unions as the surfaces part: united spots whose two spots would no longer overlap become these again."""

from dataclasses import replace

import numpy as np

from icha.contact.model import SPLIT
from icha.equilibrium.equations import Point
from icha.equilibrium.search import Search
from icha.equilibrium.sites import CONTACT


def undo(search: Search, point: Point) -> Search:
    """Unions replaced by their two spots, where the united one is smaller than where they just touch."""
    a, sites = point.a, search.sites
    touching = np.array([0.0 if union is None else union.touching for union in sites.parts[: len(a)]])
    apart = np.flatnonzero((sites.status[: len(a)] == CONTACT) & (a < touching))
    for site in apart.tolist():
        search = _undone(search, site, a[site])
    return search


def _undone(search, site, a):
    """With the two spots of a union, shrunk as it has, in the place of the spot of contact radius a, m."""
    sites, law, union = search.sites, search.problem.law, search.sites.parts[site]
    shrunk = union.contact_radius * (a / union.united_radius)
    held = search.holder == site
    holder = np.where(held, -1, search.holder)
    for k, asperities in enumerate(union.asperities()):
        holder[asperities] = len(sites) + k
    search = search.noting(SPLIT, sites.position[[site]], sites.members[[site]])
    sites = sites.removed(site).extended(
        law,
        position=union.position,
        height=union.height,
        radius_of_curvature=union.radius_of_curvature,
        asperity=union.asperity,
        members=union.members,
        parts=union.parts,
        approach=law.approach(shrunk, union.radius_of_curvature),
        status=CONTACT,
        known=True,
        parted=search.splits,
    )
    # Who lay under the spot is looked at anew.
    return replace(search, sites=sites, holder=holder, seen_at=np.where(held, np.inf, search.seen_at))
