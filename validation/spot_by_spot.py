"""The model's error spot by spot: its spots compared with the contact patches of boundary elements."""

from typing import NamedTuple

import numpy as np
import scipy.ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.equilibrium.sites import ContactState
from icha.references.finite_range import NodalState, perimeter_correction

# Categories of groups of overlapping spots and patches.
CATEGORIES = {
    "single": "one spot of one summit, one patch",
    "several": "spots of one summit each, with a patch in common or several patches under one spot",
    "united": "with a united spot",
    "extra": "a spot without a patch",
    "missed": "a patch without a spot",
}


class Patches(NamedTuple):
    """Connected contact patches.

    Attributes
    ----------
    label : (n, n), patch of every node, 0 outside.
    area, force : (k,), m^2, N.
    nodes : (k,), number of nodes.
    """

    label: np.ndarray
    area: np.ndarray
    force: np.ndarray
    nodes: np.ndarray


class Match(NamedTuple):
    """Groups of overlapping spots and patches.

    Attributes
    ----------
    spot_group, patch_group : (s,), (k,), the group of each spot and patch.
    category : (g,), a key of `CATEGORIES` for each group.
    """

    spot_group: np.ndarray
    patch_group: np.ndarray
    category: np.ndarray


def contact_patches(state: NodalState) -> Patches:
    """Return the connected patches of a state without adhesion, with areas corrected by their perimeters."""
    contact, period = state.contact, state.surface.period
    label, count = scipy.ndimage.label(contact)
    # Patches are periodic.
    seam = np.concatenate([np.stack([label[0], label[-1]]), np.stack([label[:, 0], label[:, -1]])], axis=1)
    seam = seam[:, np.all(seam > 0, axis=0)]
    _, whole = connected_components(coo_array((np.ones(seam.shape[1]), seam), shape=(count + 1, count + 1)))
    label, count = whole[label], int(whole.max())  # the background has label 0 and comes first
    nodes = np.bincount(label.ravel(), minlength=count + 1)
    edges = np.zeros(count + 1)
    for axis in (0, 1):
        other = np.roll(label, 1, axis)
        edges += np.bincount(np.maximum(label, other)[(label > 0) != (other > 0)], minlength=count + 1)
    corrected, perimeter = perimeter_correction(contact)
    excess = np.count_nonzero(contact) - corrected * contact.size
    force = np.bincount(label.ravel(), state.traction.ravel(), count + 1)
    cell = (period / len(label)) ** 2
    area = nodes - excess * edges / max(perimeter, 1.0)
    return Patches(label, area[1:] * cell, force[1:] * cell, nodes[1:])


def match(position, contact_radius, united, patches: Patches, period: float) -> Match:
    """Group overlapping spots and patches.

    A spot overlaps the patches of all nodes inside it, or of the nearest node.

    Parameters
    ----------
    position, contact_radius : (s, 2), (s,), m, of the spots.
    united : (s,), whether a spot consists of several summits.
    """
    spots, count = len(position), len(patches.area)
    spot, patch = [], []
    for k in range(spots):
        under = np.unique(patches.label[_nodes_in_disc(position[k], contact_radius[k], len(patches.label), period)])
        under = under[under > 0]
        spot += [k] * len(under)
        patch += list(under - 1 + spots)
    total = spots + count
    groups, group = connected_components(coo_array((np.ones(len(spot)), (spot, patch)), shape=(total, total)))
    spot_group, patch_group = group[:spots], group[spots:]
    spot_count, patch_count = (np.bincount(group, minlength=groups) for group in (spot_group, patch_group))
    with_united = np.bincount(spot_group, united, minlength=groups) > 0
    category = np.select(
        [spot_count == 0, patch_count == 0, with_united, (spot_count == 1) & (patch_count == 1)],
        ["missed", "extra", "united", "single"],
        "several",
    )
    return Match(spot_group, patch_group, category)


def _nodes_in_disc(centre, radius, grid, period):
    """Return rows and columns of the nodes inside a disc, and of the node nearest to its centre."""
    spacing = period / grid
    column, row = np.rint(centre / spacing).astype(int)
    reach = int(radius / spacing) + 1
    offset = np.arange(-reach, reach + 1)
    dx, dy = (column + offset) * spacing - centre[0], (row + offset) * spacing - centre[1]
    inside = np.hypot(dx, dy[:, None]) <= radius
    inside[reach, reach] = True
    i, j = np.nonzero(inside)
    return np.mod(row + offset[i], grid), np.mod(column + offset[j], grid)


def split(
    contact: InteractingAsperities, state: ContactState, truth: NodalState, fourth: np.ndarray
) -> dict[str, list | np.ndarray]:
    """Split one state without adhesion by category and pair; return values by the names of the variables.

    `fourth` (n,) are the fourth-order terms of the summits, m^-3. Categories are in the order of `CATEGORIES`.
    """
    spots, law, period = state.spots, contact.law, contact.asperities.period
    patches = contact_patches(truth)
    found = match(spots.position, spots.contact_radius, spots.members > 1, patches, period)
    area = np.pi * spots.contact_radius**2
    force = law.force(spots.contact_radius, spots.radius_of_curvature)
    of_spots = [found.category[found.spot_group] == category for category in CATEGORIES]
    of_patches = [found.category[found.patch_group] == category for category in CATEGORIES]
    single = np.flatnonzero(found.category[found.spot_group] == "single")
    of_group = np.full(len(found.category), -1)
    of_group[found.patch_group] = np.arange(len(patches.area))
    patch = of_group[found.spot_group[single]]
    return {
        "spot_count": [np.count_nonzero(members) for members in of_spots],
        "patch_count": [np.count_nonzero(members) for members in of_patches],
        "spot_area_fraction": [np.sum(area[members]) / contact.area for members in of_spots],
        "patch_area_fraction": [np.sum(patches.area[members]) / contact.area for members in of_patches],
        "spot_load_share": [np.sum(force[members]) / np.sum(force) for members in of_spots],
        "patch_load_share": [np.sum(patches.force[members]) / np.sum(patches.force) for members in of_patches],
        "pair_spot_area": area[single],
        "pair_patch_area": patches.area[patch],
        "pair_spot_force": force[single],
        "pair_patch_force": patches.force[patch],
        "pair_patch_nodes": patches.nodes[patch],
        "pair_curvature_radius": spots.radius_of_curvature[single],
        "pair_fourth_order": fourth[_summit_of_spots(contact, state)[single]],
    }


def _summit_of_spots(contact, state):
    """Return the summit (s,) at the centre of each spot, or -1; a spot may contain covered summits as well."""
    spots, asperities = state.spots, contact.asperities
    owned = np.flatnonzero(state.spot_of_asperity >= 0)
    position = np.mod(asperities.position[owned], asperities.period)
    at_summit = np.all(spots.position[state.spot_of_asperity[owned]] == position, axis=1)
    summit = np.full(len(spots), -1)
    summit[state.spot_of_asperity[owned[at_summit]]] = owned[at_summit]
    return summit
