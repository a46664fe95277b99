"""Rigid shapes that are pressed against the elastic body: spheres, paraboloids, punches, cones and waves.

All lengths are in metres. Heights are positive towards the elastic body. The apex has height 0 and lies at x = y = 0.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from icha.support.rules import LENGTH, FloatRange

# The amplitude of waves has a sign.
AMPLITUDE = FloatRange("m", least=-1e9, most=1e9)
# Half angle of a cone, between the axis and the side. At pi/2 the cone would be a plane.
HALF_ANGLE = FloatRange("rad", least=1e-6, most=math.pi / 2 - 1e-9)


class Shape(ABC):
    """Base class of shapes; `rules` contains the bounds of the parameters.

    Attributes
    ----------
    sphere_radius : radius of the sphere of Hertz and JKR with which a contact of this shape is compared, m, or None.
    """

    rules: ClassVar[dict[str, FloatRange]] = {}

    def __post_init__(self):
        """Check the parameters."""
        for name, rule in self.rules.items():
            object.__setattr__(self, name, rule.validate(name, getattr(self, name)))

    def __str__(self) -> str:
        """Return name and parameters in SI units, such as "sphere of radius 0.001 m"."""
        names = {kind: name.replace("_", " ") for name, kind in SHAPES.items()}
        words = []
        for name, values in vars(self).items():
            numbers = " and ".join(f"{value:.6g}" for value in np.atleast_1d(values))
            words.append(f"{name.replace('_', ' ')} {numbers} {'rad' if name == 'half_angle' else 'm'}")
        return f"{names[type(self)]} of {', '.join(words)}"

    @abstractmethod
    def heights(self, x, y) -> np.ndarray:
        """Return the heights at distances x, y from the apex (arrays that broadcast, m); -inf where no body is."""

    @property
    def sphere_radius(self) -> float | None:
        """None, because the apex is not that of a sphere."""
        return None

    @property
    def end_radius(self) -> float | None:
        """Radius of the largest circle on the flat end, m; None without a flat end."""
        return None

    @property
    def shortest_wave(self) -> float:
        """Wavelength of the waves of the shape, m; infinite, because the shape has no waves."""
        return math.inf


@dataclass(frozen=True)
class Sphere(Shape):
    """Sphere with the exact height sqrt(R^2 - r^2) - R; `radius` is R, m."""

    radius: float
    rules: ClassVar = {"radius": LENGTH}

    def heights(self, x, y):
        """Return the heights; raise ValueError if a point lies beside the sphere."""
        r = np.hypot(x, y)
        if (farthest := float(np.max(r))) > self.radius:
            raise ValueError(
                f"radius: {self.radius:.6g} m is less than the distance of {farthest:.6g} m between the apex and the "
                "farthest node; expected a larger radius or a smaller square"
            )
        # This form does not subtract nearly equal numbers.
        return -(r**2) / (self.radius + np.sqrt((self.radius - r) * (self.radius + r)))

    def slope(self, r):
        """Return the slope -dh/dr at radii r < R."""
        return r / np.sqrt((self.radius - r) * (self.radius + r))

    @property
    def sphere_radius(self):
        """Radius of the sphere, m."""
        return self.radius


@dataclass(frozen=True)
class Paraboloid(Shape):
    """Paraboloid of height -x^2/(2 Rx) - y^2/(2 Ry); `radii` are Rx and Ry, m."""

    radii: tuple[float, float]

    def __post_init__(self):
        """Check the radii."""
        if not isinstance(self.radii, (tuple, list)) or len(self.radii) != 2:
            raise ValueError(f"radii: {self.radii!r} must be two lengths in m, along x and along y")
        object.__setattr__(self, "radii", tuple(LENGTH.validate("radii", radius) for radius in self.radii))

    def heights(self, x, y):
        """Return the heights."""
        return -(np.square(x) / self.radii[0] + np.square(y) / self.radii[1]) / 2

    @property
    def sphere_radius(self):
        """Geometric mean of the radii, m: the equivalent radius of Johnson & Greenwood, J. Phys. D 38 (2005) 1042."""
        return math.sqrt(self.radii[0]) * math.sqrt(self.radii[1])


@dataclass(frozen=True)
class CylinderPunch(Shape):
    """Cylinder with a flat circular end; `radius` is the radius of the end, m."""

    radius: float
    rules: ClassVar = {"radius": LENGTH}

    def heights(self, x, y):
        """Return 0 on the end and -inf outside."""
        return np.where(np.hypot(x, y) <= self.radius, 0.0, -np.inf)

    @property
    def end_radius(self):
        """Radius of the end, m."""
        return self.radius


@dataclass(frozen=True)
class FlatPunch(Shape):
    """Prism with a flat square end; `side` is the side of the square, m. The sides are parallel to x and y."""

    side: float
    rules: ClassVar = {"side": LENGTH}

    def heights(self, x, y):
        """Return 0 on the end and -inf outside."""
        return np.where(np.maximum(np.abs(x), np.abs(y)) <= self.side / 2, 0.0, -np.inf)

    @property
    def end_radius(self):
        """Half the side of the end, m."""
        return self.side / 2


@dataclass(frozen=True)
class Cone(Shape):
    """Cone of height -r/tan(half_angle); `half_angle` is the angle between axis and side, rad, less than pi/2."""

    half_angle: float
    rules: ClassVar = {"half_angle": HALF_ANGLE}

    def heights(self, x, y):
        """Return the heights."""
        return -np.hypot(x, y) / math.tan(self.half_angle)

    def slope(self, r):
        """Return the slope -dh/dr at radii r."""
        return np.full(np.shape(r), 1 / math.tan(self.half_angle))


@dataclass(frozen=True)
class Wave(Shape):
    """Paraboloid with concentric waves, of height -r^2/(2 R) - A (1 - cos(2 pi r/lambda)).

    The shape is -f of P. R. Guduru, J. Mech. Phys. Solids 55 (2007) 445-472, with the same sign of A.

    Parameters
    ----------
    radius : R, m.
    amplitude : A, m; the centre is a crest of the waves if A is positive, and a trough if A is negative.
    wavelength : lambda, m.
    """

    radius: float
    amplitude: float
    wavelength: float
    rules: ClassVar = {"radius": LENGTH, "amplitude": AMPLITUDE, "wavelength": LENGTH}

    def heights(self, x, y):
        """Return the heights; rings may be higher than the apex if the amplitude is negative."""
        r = np.hypot(x, y)
        return -(r**2) / (2 * self.radius) - 2 * self.amplitude * np.sin(np.pi * r / self.wavelength) ** 2

    def slope(self, r):
        """Return the slope -dh/dr at radii r."""
        q = 2 * np.pi / self.wavelength
        return r / self.radius + self.amplitude * q * np.sin(q * r)

    @property
    def sphere_radius(self):
        """Radius R of the paraboloid without waves, m."""
        return self.radius

    @property
    def shortest_wave(self):
        """Wavelength of the waves, m; infinite without amplitude."""
        return self.wavelength if self.amplitude else math.inf


# Shapes by the names of the configuration.
SHAPES: dict[str, type[Shape]] = {
    "sphere": Sphere,
    "paraboloid": Paraboloid,
    "cylinder_punch": CylinderPunch,
    "flat_punch": FlatPunch,
    "cone": Cone,
    "wave": Wave,
}


def make_shape(settings: Mapping[str, Mapping]) -> Shape:
    """Return the shape of settings in SI units, such as `{"sphere": {"radius": 1e-3}}`."""
    ((name, arguments),) = settings.items()
    return SHAPES[name](**arguments)


def shape_settings(shape: Shape) -> dict[str, dict]:
    """Return the settings of a shape, the inverse of `make_shape`."""
    (name,) = (name for name, kind in SHAPES.items() if type(shape) is kind)
    return {name: dict(vars(shape))}
