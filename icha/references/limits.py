"""Limits of a run that are known before it starts: cells that resolve the contact, and the range of the attraction."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from icha.asperity.material import Material
from icha.asperity.tabor import describe_short_range
from icha.contact.attraction import SHORT_RANGE, attraction_on, resolving_spacing
from icha.contact.models import MODELS
from icha.path.targets import (
    AREAS,
    CONTACT_RADIUS,
    FORCE,
    INDENTATION,
    MEAN_SEPARATION,
    NOMINAL_PRESSURE,
    REDUCED_PRESSURE,
    Path,
)
from icha.references.indentation import contact_radius_at, pull_off_state
from icha.support.formatting import format_quantity
from icha.surfaces.resolution import LEAST_CELLS, RADIUS, Resolution, resolution_of
from icha.surfaces.shapes import Shape
from icha.surfaces.surface import FREE, Surface

# Cells in the contact radius of a sphere or cone at pull-off, below which the force is 10 to 30 %, or 6 %, too small.
_POOR_CELLS, _FAIR_CELLS = 2.0, 3.0
# Cells by which the edge of a punch is too small; cells in its radius from which this describes the error; and the
# largest error, in per cent, that is not mentioned.
_LOST_CELLS, _LEAST_EDGE, _SMALL_ERROR = 1.35, 6.0, 5.0


def radius_at_target(shape: Shape, side: float, material: Material, kind: str, value: float) -> float:
    """Return the contact radius of a smooth shape on a half-space at a target of the first loading, m.

    A layer counts as a half-space, and a shape as in `contact_radius_at`. The result is 0 if there is no contact yet.

    Parameters
    ----------
    side : side of the square, m; the radius is at most that of a circle around the square.
    kind, value : target, as in `icha.path.targets.Target`.
    """
    quantity, prescribed = convert_target(shape, side, material.contact_modulus, kind, value)
    if quantity == CONTACT_RADIUS:
        return prescribed
    if prescribed <= 0 and shape.end_radius is None:
        return 0.0
    radius = contact_radius_at(quantity, prescribed, shape, material.contact_modulus, material.surface_energy)
    return min(radius, side / math.sqrt(2))


def convert_target(shape: Shape, side: float, contact_modulus: float, kind: str, value: float) -> tuple[str, float]:
    """Convert a target on a square with a shape to a contact radius (m), an indentation (m) or a force (N).

    An area counts as that of a circle.

    Parameters
    ----------
    side : side of the square, m.
    contact_modulus : E*, Pa.
    kind, value : target, as in `icha.path.targets.Target`.

    Returns
    -------
    CONTACT_RADIUS, INDENTATION or FORCE, and its value.
    """
    area = side**2
    if kind in AREAS:
        return CONTACT_RADIUS, value if kind == CONTACT_RADIUS else math.sqrt(value * area / math.pi)
    if kind in (INDENTATION, MEAN_SEPARATION):
        return INDENTATION, value if kind == INDENTATION else -value
    if kind == REDUCED_PRESSURE:
        # The unit of slopes of a shape hardly depends on the grid.
        value *= Surface(np.zeros((64, 64)), side, FREE, shape).unit_slope
    units = {FORCE: 1.0, NOMINAL_PRESSURE: area}
    return FORCE, value * units.get(kind, contact_modulus * area)


def contact_resolution(
    shape: Shape, side: float, grid: int, material: Material, targets: Iterable[tuple[str, float]]
) -> Resolution:
    """Return the number of cells in the smallest contact radius of a smooth shape at targets (kind, value)."""
    radii = [radius_at_target(shape, side, material, *target) for target in targets]
    return Resolution(min((radius for radius in radii if radius), default=math.inf) * grid / side, RADIUS)


def describe_coarse_pull_off(shape: Shape, spacing: float, radius: float) -> str:
    """Describe the error of a pull-off force by boundary elements, for a smooth shape; "" if it is at most 5 %.

    At the sharp edge of a punch the front has half of its width, so the force is that of a punch whose radius is
    smaller by 1.35 cells (docs/indenter.md). Spheres and cones had errors of 18 to 29 % with 0.8 to 1.2 cells at
    pull-off, 10 % with 1.6 and 1.8 cells, 6 % with 2.4 cells, and at most 4 % with more.

    Parameters
    ----------
    spacing : size of a cell, m.
    radius : contact radius at pull-off by theory, m.
    """
    cells = radius / spacing
    if shape.end_radius is None:
        error = "10 to 30 %" if cells < _POOR_CELLS else "up to 6 %" if cells < _FAIR_CELLS else ""
    else:
        percent = 100 * (1 - max(1 - _LOST_CELLS / cells, 0.0) ** 1.5)
        error = "" if percent < _SMALL_ERROR else "a third or more" if cells < _LEAST_EDGE else f"about {percent:.0f} %"
    return error and f"the contact radius at pull-off has {cells:.2g} cells: the computed force is {error} too small"


def doubts(surface: Surface, material: Material, path: Path, model: str) -> list[str]:
    """Describe what makes the results of a run doubtful before it starts: a coarse grid, or a long range of attraction.

    A campaign refuses such runs unless they are confirmed. `icha.simulate` warns.
    """
    coarse = [resolution_of(surface)]
    if surface.smooth:
        targets = [(target.kind, target.value) for target in path.targets]
        coarse.append(contact_resolution(surface.shape, surface.period, surface.grid, material, targets))
    found = [
        f"the grid of {surface.grid} nodes gives {each}; expected {each.grids(surface.grid)}"
        for each in coarse
        if not each.reaches(LEAST_CELLS)
    ]
    if MODELS[model].by_cells and attraction_on(material, surface.spacing) == SHORT_RANGE:
        if surface.smooth and path.unload and not material.layered:
            pull_off = pull_off_state(surface.shape, material.contact_modulus, material.receding.surface_energy)
            if pull_off and (text := describe_coarse_pull_off(surface.shape, surface.spacing, pull_off.contact_radius)):
                found.append(text)
        if text := describe_short_range(tabor_parameter_of(surface, material)):
            cells = format_quantity(resolving_spacing(material), "m")
            found.append(
                f"the grid does not resolve the range of attraction, so boundary elements assume a short range, but "
                f"{text}; expected grid cells of at most {cells}"
            )
    return found


def tabor_parameter_of(surface: Surface, material: Material) -> float:
    """Return the Tabor parameter of a summit, or of a smooth shape; infinite for a shape without a radius."""
    if surface.smooth and surface.shape.sphere_radius is None:
        return math.inf
    return float(material.tabor_parameter(surface.summit_radius))
