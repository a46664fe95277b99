"""Section `shape` of a surface: a smooth rigid shape that carries the roughness."""

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from icha.support import formatting
from icha.support.values import Length, Section, exactly_one, quantity
from icha.surfaces.resolution import NYQUIST_CELLS, Resolution
from icha.surfaces.shapes import AMPLITUDE, HALF_ANGLE, Shape, make_shape

# Distance between the apex and the nearest node, in cells along x and y, is less than this number.
_NEAREST_NODE = 0.3


class SphereSection(Section):
    """A sphere. The square of the surface must fit on it."""

    radius: Length
    """Radius R."""


class ParaboloidSection(Section):
    """A paraboloid of height -x²/(2 Rx) - y²/(2 Ry)."""

    radii: Annotated[list[Length], Field(min_length=2, max_length=2)]
    """Radii of curvature Rx and Ry at the apex, along x and y, such as `[1 mm, 2 mm]`."""


class CylinderPunchSection(Section):
    """A cylinder with a flat circular end."""

    radius: Length
    """Radius of the end."""


class FlatPunchSection(Section):
    """A prism with a flat square end."""

    side: Length
    """Side of the end."""


class ConeSection(Section):
    """A cone."""

    half_angle: quantity(HALF_ANGLE, "80 deg")  # type: ignore[valid-type]
    """Angle between axis and side, less than 90 deg."""


class WaveSection(Section):
    """A paraboloid with concentric waves, of height -r²/(2R) - A (1 - cos(2πr/λ)) (P. R. Guduru, 2007)."""

    radius: Length
    """Radius of curvature R of the paraboloid."""
    amplitude: quantity(AMPLITUDE, "100 nm")  # type: ignore[valid-type]
    """Amplitude A. The centre is a crest of the waves if A is positive, and a trough if A is negative."""
    wavelength: Length
    """Wavelength λ."""


class ShapeSection(Section):
    """A smooth rigid shape with its apex in the middle of the square. Give exactly one key."""

    sphere: SphereSection | None = None
    """A sphere, such as `{radius: 1 mm}`."""
    paraboloid: ParaboloidSection | None = None
    """A paraboloid, such as `{radii: [1 mm, 2 mm]}`."""
    cylinder_punch: CylinderPunchSection | None = None
    """A cylinder with a flat circular end, such as `{radius: 50 um}`."""
    flat_punch: FlatPunchSection | None = None
    """A prism with a flat square end, such as `{side: 100 um}`."""
    cone: ConeSection | None = None
    """A cone, such as `{half_angle: 80 deg}`."""
    wave: WaveSection | None = None
    """A paraboloid with concentric waves, such as `{radius: 1 mm, amplitude: 100 nm, wavelength: 20 um}`."""

    _check = model_validator(mode="after")(exactly_one)

    @property
    def shape(self) -> Shape:
        """The shape, in SI units."""
        return make_shape(self.model_dump(exclude_none=True))

    def problem(self, side: float, grid: int) -> str | None:
        """Return the reason why the shape does not fit a square of this side (m) and number of nodes; else None."""
        try:
            shape, near = self.shape, _NEAREST_NODE * side / grid
            shape.heights(side / 2, side / 2)
        except ValueError as error:
            return f"shape: {error}"
        if not np.isfinite(shape.heights(near, near)):
            cell = formatting.length(side / grid, 3)
            return f"shape: is smaller than a grid cell of {cell}; expected a larger shape or a finer grid"
        resolution = Resolution(shape.shortest_wave * grid / side)
        if not resolution.representable:
            reason = f"shape: has {resolution}, but at least {NYQUIST_CELLS} are needed"
            return f"{reason}; expected a longer wave, or {resolution.grids(grid)}"
        return None
