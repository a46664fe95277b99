"""Fields of displacement and gap as whole arrays, and the nodes that spots cover."""

import numpy as np

from icha.equilibrium.distributions import cover_grid
from icha.half_space.grid_displacement import DisplacementField


def displacement_field(*args, free=False):
    """Return the displacement (n, n) at all nodes; arguments as of `DisplacementField`."""
    return np.concatenate(DisplacementField(*args, free=free).map_blocks(lambda _, w: w))


def displacement(law, surface, state):
    """Displacement (n, n) at the surface's nodes, m."""
    spots = state.spots
    a, R = spots.contact_radius, spots.radius_of_curvature
    return displacement_field(law, surface.period, surface.grid, spots.position, a, R, free=surface.free)


def gap(law, surface, state):
    """Gap (n, n) at the surface's nodes, m: meaningful outside the spots."""
    return displacement(law, surface, state) + (state.separation - surface.heights)


def covered_nodes(surface, spots):
    """Return whether each node lies inside a spot, (n, n) bool."""
    return cover_grid(surface.period, surface.grid, spots.position, spots.contact_radius, surface.free)[1]


def contact_cover(surface, spots):
    """Return the fraction of every node's cell that spots cover, (n, n) float."""
    return cover_grid(surface.period, surface.grid, spots.position, spots.contact_radius, surface.free)[0]
