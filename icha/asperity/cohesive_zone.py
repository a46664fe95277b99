"""Which range of attraction a grid resolves: the cohesive zone around an adhesive contact must span its cells.

With traction (dgamma/rho) exp(-u/rho) at a gap u, two dimensionless numbers decide: the spacing against the length of
the cohesive zone, and the step by which a single node jumps into contact against the range rho (A. Wang, Y. Zhou and
M. H. Müser, Lubricants 9 (2021) 17, doi:10.3390/lubricants9020017).
"""

import math

from icha.asperity.material import Material

# Grids are refused from this strength number on: there nodes jump into contact one at a time.
MAX_STRENGTH_NUMBER = 0.5


def longest_spacing(material: Material) -> float:
    """8 rho^2 E*/(3 pi dgamma), m: the widest grid that resolves the cohesive zone; infinite without adhesion."""
    if material.surface_energy == 0:
        return math.inf
    return 8 * material.interaction_range**2 / (3 * math.pi * material.adhesion_length)


def strength_number(material: Material, spacing: float) -> float:
    """sqrt(dgamma dx/E*)/rho of a grid of spacing dx (m)."""
    return math.sqrt(material.adhesion_length * spacing) / material.interaction_range


def is_resolved(material: Material, spacing: float) -> bool:
    """Whether a grid of this spacing (m) resolves the attraction; always without adhesion."""
    return spacing <= longest_spacing(material) and strength_number(material, spacing) < MAX_STRENGTH_NUMBER


def shortest_range(material: Material, spacing: float) -> float:
    """The range of attraction, m, above which a grid of this spacing resolves it at this energy and modulus."""
    zone = math.sqrt(3 * math.pi * material.adhesion_length * spacing / 8)
    return max(zone, math.sqrt(material.adhesion_length * spacing) / MAX_STRENGTH_NUMBER)


def resolution_problem(material: Material, spacing: float) -> str | None:
    """What keeps a grid of this spacing (m) from resolving the attraction, with all numbers; None if nothing does."""
    if is_resolved(material, spacing):
        return None
    return (
        f"a range of {material.interaction_range:.4g} m is not resolved by a grid of spacing {spacing:.4g} m: "
        f"sqrt(dgamma dx/E*)/range is {strength_number(material, spacing):.3g}, which must be less than "
        f"{MAX_STRENGTH_NUMBER:g}, and the spacing may be {longest_spacing(material):.3g} m at most; allowed: ranges "
        f"above {shortest_range(material, spacing):.4g} m, or a finer grid"
    )
