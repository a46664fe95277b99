"""Coalescence of spots, the splitting of unions on unloading, and new contacts that lie inside other spots.

Two overlapping spots become one spot, a union (`icha.asperity.jkr.JKR.union`). At the moment of coalescence, the
contact area of the union is the sum of both areas. But its force is not the sum of both forces. `set_union_heights`
then chooses a height for which the union is in equilibrium. New contacts inside other spots are removed, because the
equations are singular when the edge of one spot passes through the centre of another spot.
"""

from dataclasses import replace

import numpy as np

from icha.asperity.coalescence import disjoint_pairs, equivalent_spots, overlapping_pairs
from icha.contact.model import COALESCENCE, JUMP_IN, SPLIT
from icha.equilibrium.equations import Evaluation
from icha.equilibrium.iteration_state import IterationState
from icha.equilibrium.sites import CANDIDATE, CONTACT, MergeRecord, Sites


def merge_overlapping(state: IterationState, evaluation: Evaluation, margin=0.0, *, deep=False) -> IterationState:
    """Replace pairs of overlapping spots by unions; each spot merges with at most one other. Return the new state.

    The unions have no heights before `set_union_heights` is called. If no spots merge, return `state` itself.
    margin : error of the approaches, m; two spots merge only if they would overlap in spite of such an error.
    deep : whether only those pairs merge in which one spot covers the centre of the other. Otherwise, two spots from
        the split of one union merge again only on loading, and not before their area is that of the split union.
    """
    sites, law, cell, a = state.sites, state.contact.law, state.contact.asperities.cell, evaluation.a
    pairs = _select_merging_pairs(state, evaluation, margin, deep)
    if not len(pairs):
        return state
    (i, j), position, R = pairs.T, sites.position, sites.radius_of_curvature
    centre, radius, curvature = equivalent_spots(law, position[i], a[i], R[i], position[j], a[j], R[j], cell)
    unions = np.full(len(pairs), None)
    for k, pair in enumerate(pairs):
        unions[k] = MergeRecord(np.nan, a[pair], {name: getattr(sites, name)[pair] for name in Sites.UNITED})
    # A candidate in a pair makes contact before it becomes part of the union.
    candidates = pairs[sites.status[pairs] == CANDIDATE]
    state = state.with_events(JUMP_IN, sites.position[candidates], 1, 0.0, sites.asperity[candidates])
    state = state.with_radii(pairs, a[pairs])
    site_of_asperity = state.site_of_asperity.copy()
    site_of_asperity[sites.asperity[candidates]] = candidates
    members = sites.members[i] + sites.members[j]
    new = len(sites) + np.arange(len(pairs))
    index = np.append(np.arange(len(sites)), -1)
    index[pairs] = new[:, None]
    return replace(
        state.with_events(COALESCENCE, centre, members),
        site_of_asperity=index[site_of_asperity],  # -1 takes the last entry
        new_unions=new,
        sites=sites.remove(pairs).append(
            law,
            position=centre,
            height=np.zeros(len(pairs)),
            radius_of_curvature=curvature,
            contact_radius=radius,
            asperity=np.full(len(pairs), -1),
            members=members,
            union=unions,
            approach=evaluation.law.unite(i, j, a, radius).approach(radius, curvature),
            status=CONTACT,
            counts_as_old=True,
        ),
    )


def set_union_heights(state: IterationState, evaluation: Evaluation) -> tuple[IterationState, Evaluation]:
    """Set the heights of new unions so that their equations have no error; return the new state and evaluation."""
    if not len(state.new_unions):
        return state, evaluation
    height = state.sites.height.copy()
    height[state.new_unions] = evaluation.equilibrium_height[state.new_unions]
    sites = replace(state.sites, height=height)
    error = np.where(sites.present, evaluation.equilibrium_height - height, 0.0)
    return replace(state, sites=sites, new_unions=np.empty(0, dtype=int)), replace(evaluation, error=error)


def _select_merging_pairs(state, evaluation, margin, deep):
    """Return the pairs (k, 2) of spots that `merge_overlapping` merges; every spot is in one pair at most."""
    sites, a, interaction = state.sites, evaluation.a, evaluation.interaction
    first, second, r = interaction.source, interaction.target, interaction.r
    depth = a[first] + a[second] - r
    present = (a > 0) & sites.present[: len(a)]
    overlap = (depth > 0) & present[first] & present[second]
    if not deep:
        # On unloading, two spots that have just split would otherwise merge and split again and again in the iteration.
        origin = sites.split_from[first]
        for k in np.flatnonzero(overlap & (origin == sites.split_from[second])):
            if origin[k] is not None:
                overlap[k] = not state.unloading and np.hypot(a[first[k]], a[second[k]]) >= origin[k].union_radius
    overlap = np.flatnonzero(overlap)
    if margin > 0 and len(overlap):
        # An error of the approach causes an error of the radius that is about R/(2a) times as large.
        i, j, R = first[overlap], second[overlap], sites.radius_of_curvature
        overlap = overlap[depth[overlap] > margin * 0.5 * (R[i] / a[i] + R[j] / a[j])]
    if deep:
        overlap = overlap[r[overlap] < np.maximum(a[first[overlap]], a[second[overlap]])]
    if not len(overlap):
        return np.empty((0, 2), dtype=int)
    return disjoint_pairs(overlapping_pairs(sites.position, a, first[overlap], second[overlap], r[overlap]))


def record_union_radii(sites: Sites, a) -> np.ndarray:
    """Return the column `union` of sites with contact radii a (n,), m, with the radii of new unions in equilibrium."""
    unions = sites.union.copy()
    for k in np.flatnonzero(sites.status == CONTACT):
        if unions[k] is not None and np.isnan(unions[k].union_radius):
            unions[k] = replace(unions[k], union_radius=a[k])
    return unions


def split_unions(state: IterationState, evaluation: Evaluation) -> IterationState:
    """Split every union with a contact radius below its `union_radius`; if there is none, return `state` itself."""
    a, sites = evaluation.a, state.sites  # the evaluation lacks sites that were added in this round
    least = np.array([0.0 if union is None else union.union_radius for union in sites.union[: len(a)]])
    split = np.flatnonzero((sites.status[: len(a)] == CONTACT) & (a < least))
    for site in split.tolist():
        state = _split_union(state, site, a[site])
    return state


def _split_union(state, site, a):
    """Replace a union by its two spots, log the split, and return the new state; `a` is the radius of the union, m.

    The radius of each spot is its radius at coalescence, times the present radius of the union divided by the
    `union_radius`. Asperities that the union only covered lose contact.
    """
    sites, law, union = state.sites, state.contact.law, state.sites.union[site]
    contact_radius = union.contact_radius * (a / union.union_radius)
    merged = state.site_of_asperity == site
    site_of_asperity = np.where(merged, -1, state.site_of_asperity)
    for k, asperities in enumerate(union.asperities()):
        site_of_asperity[asperities] = len(sites) + k
    state = state.with_events(SPLIT, sites.position[[site]], sites.members[[site]]).with_radii(site, a)
    R = union.columns["radius_of_curvature"]
    sites = sites.remove(site).append(
        law,
        **union.columns,
        contact_radius=np.maximum(contact_radius, law.jump_off_radius(R)),
        approach=law.receding.approach(contact_radius, R),
        status=CONTACT,
        counts_as_old=True,
        split_from=union,
    )
    # The approaches of other asperities under the union are not known.
    last_separation = np.where(merged, np.inf, state.last_separation)
    return replace(state, sites=sites, site_of_asperity=site_of_asperity, last_separation=last_separation)


def absorb_new_asperities(state: IterationState, evaluation: Evaluation) -> IterationState:
    """Remove new sites whose centre lies under a spot that counts as old, or under a larger new spot.

    Sites are new if `Sites.counts_as_old` is False: they are single asperities or candidates. Sites of contact radius
    zero stay. The covering spots get the asperities, and the jump-ins of these asperities are deleted from the log.
    Return the new state, with the approaches of the evaluation, or `state` itself if no site is removed.
    """
    sites, a, interaction, old = state.sites, evaluation.a, evaluation.interaction, state.sites.counts_as_old
    site, cover, r = interaction.target, interaction.source, interaction.r
    inside = np.flatnonzero((r < a[cover]) & (a[site] > 0) & ~old[site])
    inside = inside[old[cover[inside]] | (a[site[inside]] < a[cover[inside]])]
    if not len(inside):
        return state
    inside = inside[np.argsort((a[cover] - r)[inside], kind="stable")]
    site, cover = site[inside], cover[inside]
    site_of_asperity = state.site_of_asperity.copy()
    site_of_asperity[sites.asperity[site]] = site  # a candidate is not yet entered
    index = np.append(np.arange(len(sites)), -1)
    index[site] = cover  # the spot that covers a site deepest is the last one and replaces the others
    while np.any(index[index] != index):  # a covering spot may itself be covered by a larger spot
        index = index[index]
    state = state.delete_jumps_in(sites.asperity[np.unique(site)])
    return replace(
        state,
        sites=replace(sites.remove(site), approach=evaluation.approach),
        site_of_asperity=index[site_of_asperity],  # -1 takes the last entry
    )
