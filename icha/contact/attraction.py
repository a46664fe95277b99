"""Range of attraction of an interface on a grid: the rule that decides by which law boundary elements compute it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from icha.asperity.material import Material

# Names of the laws, the values of the attribute `attraction` of a run by boundary elements.
SHORT_RANGE, FINITE_RANGE, NO_ATTRACTION = "short range", "finite range", "none"
# Compliance of the last row of cells of a straight contact (kernel 2/q, cell size h), in h/E*. At a short range, the
# compliance of a cell's bond is larger by a factor. Above 1 no cell snaps; with 3.5, patches follow JKR at any position
# (docs/short_range.md).
_ROW_COMPLIANCE, _BOND_FACTOR = 1.7316, 3.5
BOND_COMPLIANCE = _BOND_FACTOR * _ROW_COMPLIANCE


def straight_strength(adhesion_length: float) -> float:
    """Return the tension at which a closed cell at a straight edge starts to open at a short range, in E*.

    adhesion_length : dgamma/E*, in cell sizes.
    """
    return math.sqrt(2 * adhesion_length / BOND_COMPLIANCE)


def attraction_on(material: Material, spacing: float) -> str:
    """Return the name of the law of attraction on a grid of the given spacing, m, by what the grid resolves.

    A grid resolves the range of attraction if the strength of the interface is not larger than the tension at which a
    cell at a straight edge opens. Then the front is at least as wide as at a short range on this grid.
    """
    if not material.surface_energy:
        return NO_ATTRACTION
    strength = material.interface_strength / material.contact_modulus
    return FINITE_RANGE if strength <= straight_strength(material.adhesion_length / spacing) else SHORT_RANGE


def resolving_spacing(material: Material) -> float:
    """Return the largest spacing of a grid that resolves the range of attraction of a material with adhesion, m."""
    strength = material.interface_strength / material.contact_modulus
    return 2 * material.adhesion_length / (BOND_COMPLIANCE * strength**2)
