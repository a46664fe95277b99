"""Unions of spots, their undoing as the surfaces part, and new contacts that are taken back since others cover them.

Spots that overlap become one, by the rule of the law (`icha.asperity.law.SpotLaw.union`). The united spot has the
height with which it is in equilibrium as it is made. The equations are singular where one spot's edge runs through
another's centre.
"""

from dataclasses import replace

import numpy as np

from icha.asperity.coalescence import disjoint_pairs, equivalent_spots, overlapping_pairs
from icha.contact.model import COALESCENCE, JUMP_IN, SPLIT
from icha.equilibrium.equations import Point
from icha.equilibrium.search import Search
from icha.equilibrium.sites import CONTACT, TRIAL, Union
from icha.surfaces.square import periodic_difference


def unite(search: Search, point: Point, margin: float = 0.0, *, deep: bool = False) -> Search:
    """Overlapping spots replaced by their equivalents.

    margin : error of the approaches in m; spots unite if they overlap by more than its effect.
    deep : only those of which one covers the other's centre.
    """
    sites, law, period, a = search.sites, search.problem.law, search.problem.asperities.cell, point.a
    pairs = _overlapping(search, point, margin, deep)
    if not len(pairs):
        return search
    i, j = pairs.T
    R = sites.radius_of_curvature
    centre, radius, curvature = equivalent_spots(
        law, sites.position[i], a[i], R[i], sites.position[j], a[j], R[j], period
    )
    parts = _parts(search, pairs, a, radius)
    search = _arrived(search, pairs[sites.status[pairs] == TRIAL])
    members = sites.members[i] + sites.members[j]
    index = np.append(np.arange(len(sites)), -1)
    index[pairs] = len(sites) + np.arange(len(pairs))[:, None]
    return replace(
        search.noting(COALESCENCE, centre, members),
        holder=index[search.holder],  # -1 looks up the last
        fresh=len(sites) + np.arange(len(pairs)),
        sites=sites.removed(pairs).extended(
            law,
            position=centre,
            height=np.zeros(len(pairs)),
            radius_of_curvature=curvature,
            asperity=np.full(len(pairs), -1),
            members=members,
            parts=parts,
            approach=law.approach(radius, curvature),
            status=CONTACT,
            known=True,
        ),
    )


def settled(search: Search, point: Point) -> tuple[Search, Point]:
    """Search and point with the heights of the spots that have just been united: those of equilibrium there."""
    if not len(search.fresh):
        return search, point
    height = search.sites.height.copy()
    height[search.fresh] = point.level[search.fresh]
    sites = replace(search.sites, height=height)
    error = np.where(sites.present, point.level - height, 0.0)
    return replace(search, sites=sites, fresh=np.empty(0, dtype=int)), replace(point, error=error)


def _overlapping(search, point, margin, deep):
    """Pairs (k, 2) of spots that unite, every spot at most in one."""
    sites, a, near = search.sites, point.a, point.interaction.pairs
    first, second = near.source, near.target
    depth = a[first] + a[second] - near.r
    part = (a > 0) & sites.present[: len(a)]
    touch = (depth > 0) & part[first] & part[second]
    if search.parting and not deep:
        # Two spots that have just come apart would unite again and again, as they settle.
        touch &= (sites.parted[first] < 0) | (sites.parted[first] != sites.parted[second])
    touch = np.flatnonzero(touch)
    if margin > 0 and len(touch):
        # An error of the approach is one of the radius, about R/(2a) times as large.
        i, j, R = first[touch], second[touch], sites.radius_of_curvature
        touch = touch[depth[touch] > margin * 0.5 * (R[i] / a[i] + R[j] / a[j])]
    if deep:
        touch = touch[near.r[touch] < np.maximum(a[first[touch]], a[second[touch]])]
    if not len(touch):
        return np.empty((0, 2), dtype=int)
    return disjoint_pairs(overlapping_pairs(sites.position, a, first[touch], second[touch], near.r[touch]))


def _parts(search, pairs, a, radius):
    """What the united spots are made of (k,): a Union each."""
    parts = np.full(len(pairs), None)
    sites, (i, j) = search.sites, pairs.T
    way = periodic_difference(sites.position[j], sites.position[i], search.problem.asperities.cell)
    touching = radius * np.minimum(np.linalg.norm(way, axis=1) / (a[i] + a[j]), 1.0)
    for k, pair in enumerate(pairs):
        parts[k] = Union(
            united_radius=radius[k],
            touching=touching[k],
            position=sites.position[pair],
            height=sites.height[pair],
            radius_of_curvature=sites.radius_of_curvature[pair],
            contact_radius=a[pair],
            asperity=sites.asperity[pair],
            members=sites.members[pair],
            parts=sites.parts[pair],
        )
    return parts


def _arrived(search, sites_on_trial):
    """Without adhesion a site may have come into contact only now."""
    sites, holder = search.sites, search.holder.copy()
    asperity = sites.asperity[sites_on_trial]
    holder[asperity] = sites_on_trial
    return replace(search.noting(JUMP_IN, sites.position[sites_on_trial], 1, 0.0, asperity), holder=holder)


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


def swallow(search: Search, point: Point) -> Search:
    """New contacts in another's contact area taken into that."""
    sites, a, near, known = search.sites, point.a, point.interaction.pairs, search.sites.known
    i, j = near.target, near.source
    inside = np.flatnonzero((near.r < a[j]) & (a[i] > 0) & ~known[i])
    inside = inside[known[j[inside]] | (a[i[inside]] < a[j[inside]])]
    if not len(inside):
        return search
    inside = inside[np.argsort((a[j] - near.r)[inside], kind="stable")]
    i, j = i[inside], j[inside]
    holder = search.holder.copy()
    holder[sites.asperity[i]] = i
    index = np.append(np.arange(len(sites)), -1)
    index[i] = j  # the deepest comes last and stays
    while np.any(index[index] != index):  # who takes one in may be taken in itself, by a larger one
        index = index[index]
    search = search.forgetting_jumps_in(sites.asperity[np.unique(i)])
    return replace(
        search,
        sites=replace(sites.removed(i), approach=point.approach),
        holder=index[holder],  # -1 looks up the last
    )
