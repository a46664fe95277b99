"""Single spots of the asperity model, compared with the contact patches of boundary elements."""

from typing import NamedTuple

import numpy as np

from icha.boundary_elements.contact import BoundaryElements
from icha.boundary_elements.patches import CellState, label_patches
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.equilibrium.sites import ContactState
from icha.surfaces.surface import Surface
from validation.paraboloids import fourth_order_terms


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


def contact_patches(contact: BoundaryElements, state: CellState) -> Patches:
    """Return the connected patches of a state without adhesion, with areas corrected by their perimeters."""
    grid, cell = contact.space.grid, contact.spacing**2
    labels, count = label_patches(state.cells, grid)
    label = np.zeros((grid, grid), int)
    label.ravel()[state.cells] = labels
    area, force = (
        np.bincount(labels, values, count + 1)[1:] * cell for values in (contact.area_of_cells(state), state.pressure)
    )
    return Patches(label, area, force, np.bincount(labels, minlength=count + 1)[1:])


def match(position, contact_radius, united, patches: Patches, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices (m,) of single spots, and of the patch that overlaps each of them and no other spot.

    A spot overlaps the patches of all nodes inside it, and the patch of the nearest node. A single spot has one summit
    and overlaps one patch.

    Parameters
    ----------
    position, contact_radius : (s, 2), (s,) float, m, of the spots.
    united : (s,) bool, whether a spot consists of several summits.
    """
    under = []
    for centre, radius in zip(position, contact_radius, strict=True):
        labels = np.unique(patches.label[_nodes_in_disc(centre, radius, len(patches.label), period)])
        under.append(labels[labels > 0] - 1)
    spots_over = np.bincount(np.concatenate(under), minlength=len(patches.area))
    single = [k for k, each in enumerate(under) if len(each) == 1 and spots_over[each[0]] == 1 and not united[k]]
    return np.array(single, int), np.array([under[k][0] for k in single], int)


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


def compare_single_spots(
    contact: InteractingAsperities, state: ContactState, surface: Surface, patches: Patches
) -> dict[str, np.ndarray]:
    """Compare the single spots of one state without adhesion with their patches, by the names of the variables."""
    spots = state.spots
    single, patch = match(spots.position, spots.contact_radius, spots.members > 1, patches, contact.asperities.period)
    return {
        "pair_spot_area": np.pi * spots.contact_radius[single] ** 2,
        "pair_patch_area": patches.area[patch],
        "pair_patch_force": patches.force[patch],
        "pair_patch_nodes": patches.nodes[patch],
        "pair_curvature_radius": spots.radius_of_curvature[single],
        # The centre of a single spot is its summit.
        "pair_fourth_order": fourth_order_terms(surface, spots.position[single]),
    }
