"""Resolution of the attraction on a grid: the cohesive zone around an adhesive contact must not be shorter than a cell.

The traction at a gap u is (dgamma/rho) exp(-u/rho). Two dimensionless numbers show whether a grid resolves this
traction. The first is the grid spacing divided by the length of the cohesive zone. The second is the distance over
which a single node jumps into contact, divided by the range rho. Source: A. Wang, Y. Zhou and M. H. Müser, Lubricants 9
(2021) 17, doi:10.3390/lubricants9020017.
"""

import math

from icha.asperity.material import Material

# If `strength_number` is this value or larger, nodes jump into contact one at a time. ICHA refuses such a grid.
MAX_STRENGTH_NUMBER = 0.5


def longest_spacing(material: Material) -> float:
    """Return the largest spacing (m) that resolves the cohesive zone, 8 rho^2 E*/(3 pi dgamma); inf if dgamma = 0."""
    if material.surface_energy == 0:
        return math.inf
    return 8 * material.interaction_range**2 / (3 * math.pi * material.adhesion_length)


def strength_number(material: Material, spacing: float) -> float:
    """Return sqrt(dgamma dx/E*)/rho for a spacing dx, m: the distance over which one node jumps, divided by rho."""
    return math.sqrt(material.adhesion_length * spacing) / material.interaction_range


def shortest_range(material: Material, spacing: float) -> float:
    """Return the shortest range of attraction (m) that a grid of the given spacing (m) resolves."""
    zone = math.sqrt(3 * math.pi * material.adhesion_length * spacing / 8)
    return max(zone, math.sqrt(material.adhesion_length * spacing) / MAX_STRENGTH_NUMBER)


def resolution_problem(material: Material, spacing: float) -> str | None:
    """Return the reason why a grid of the given spacing (m) does not resolve the attraction; else None."""
    if spacing <= longest_spacing(material) and strength_number(material, spacing) < MAX_STRENGTH_NUMBER:
        return None
    return (
        f"a range of {material.interaction_range:.4g} m is not resolved by a grid of spacing {spacing:.4g} m. "
        f"sqrt(dgamma dx/E*)/range is {strength_number(material, spacing):.3g} and must be less than "
        f"{MAX_STRENGTH_NUMBER:g}; the spacing must not exceed {longest_spacing(material):.3g} m. Use a range "
        f"above {shortest_range(material, spacing):.4g} m, or a finer grid"
    )
