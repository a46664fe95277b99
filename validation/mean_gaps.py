"""Boundary elements at finite ranges at given mean gaps, in tension or compression."""

from collections.abc import Callable, Iterable, Iterator

from icha.asperity.material import Material
from icha.references.finite_range import DEFAULT_TOLERANCE, GapContact, NodalState, refine
from icha.support.rules import LENGTH, TOLERANCE
from icha.surfaces.surface import Surface


def states_at_mean_separations(
    surface: Surface,
    material: Material,
    mean_separations: Iterable[float],
    *,
    refinement: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[str], None] | None = None,
) -> Iterator[NodalState]:
    """Solve an adhesive contact at given mean gaps, in tension or compression, each from the last.

    Parameters
    ----------
    mean_separations : m, positive, in any order; going up and down shows hysteresis.
    surface, material, refinement, tolerance, progress : as for `finite_range_solution`.

    Raises
    ------
    ValueError
        If an argument is out of range, the material has no adhesion, or the grid does not resolve it.
    NotSolved
        If the solver does not reach its tolerance.
    """
    if material.surface_energy == 0:
        raise ValueError("surface_energy: 0; without adhesion the load is given, not the mean gap")
    fine = refine(surface, material, refinement, progress)
    separations = [LENGTH.validate("mean_separations", separation) for separation in mean_separations]
    contact = GapContact(fine, material, TOLERANCE.validate("tolerance", tolerance))
    return (contact.solve(separation) for separation in separations)
