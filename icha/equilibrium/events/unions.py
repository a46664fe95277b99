"""Unions: spots that overlap become one, by the rule of the law (`icha.asperity.law.SpotLaw.union`).

The united spot has the height with which it is in equilibrium as it is made.
"""

from dataclasses import replace

import numpy as np

from icha.asperity.coalescence import disjoint_pairs, equivalent_spots, overlapping_pairs
from icha.contact.model import COALESCENCE, JUMP_IN
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
