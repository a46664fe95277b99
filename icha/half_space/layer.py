"""Elastic layer that is bonded to a rigid base, without friction at its surface; pressures are in E*."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from icha.asperity.material import Material

# A layer is not displaced farther than _FAR thicknesses from a load. Largest a = q t in `layer_correction`.
_FAR, _LARGEST_A = 20.0, 20.0


@dataclass(frozen=True)
class Layer:
    """Elastic layer bonded to a rigid base: thickness, in the unit of all lengths, and Poisson ratio."""

    thickness: float
    poisson_ratio: float

    @property
    def uniform_compliance(self) -> float:
        """Displacement by a uniform unit pressure, E* t/M, in units of length; M is the modulus of uniaxial strain."""
        return self.thickness * (1 - 2 * self.poisson_ratio) / (1 - self.poisson_ratio) ** 2

    def factor(self, q: np.ndarray) -> np.ndarray:
        """Return the compliance of the layer divided by that of a half-space, for wave numbers q > 0.

        ((3 - 4 nu) sinh 2a - 2a) / ((3 - 4 nu) cosh 2a + 2a^2 + 5 - 12 nu + 8 nu^2) with a = q t: K. L. Johnson,
        Contact Mechanics, 1985, sec. 13.5.
        """
        a, nu = q * self.thickness, self.poisson_ratio
        # Multiplied by 2 exp(-2a) above and below, so that nothing overflows.
        decay = np.exp(-2 * a)
        above = (3 - 4 * nu) * -np.expm1(-4 * a) - 4 * a * decay
        below = (3 - 4 * nu) * (1 + decay**2) + 2 * decay * (2 * a**2 + 5 - 12 * nu + 8 * nu**2)
        return above / below


def softness_of(material: Material) -> Callable[[np.ndarray], np.ndarray] | None:
    """Return `Layer.factor` as a function of wave numbers in 1/m; None for a half-space."""
    return Layer(material.thickness, material.poisson_ratio).factor if material.layered else None


def layer_compliance(q: np.ndarray, layer: Layer) -> np.ndarray:
    """Return the displacement by a unit pressure wave of wave number q on a layer without friction, times E*.

    The compliance is (2/q) phi with phi from `Layer.factor`; for q = 0 it is `uniform_compliance`.
    """
    safe = np.where(q > 0, q, 1.0)
    return np.where(q > 0, 2 / safe * layer.factor(safe), layer.uniform_compliance)


def layer_correction(r: np.ndarray, layer: Layer) -> np.ndarray:
    """Return the displacement at distances r from the middle of a cell on a layer, minus that on a half-space.

    It is the Hankel transform (1/pi t) int (phi(a) - 1) J0(a r/t) exp(-a^2/(24 t^2)) da. The factor exp averages over a
    cell. Farther than `_FAR` thicknesses, a layer is not displaced.
    """
    # Slow to import; a campaign is read without them.
    from scipy.interpolate import make_interp_spline
    from scipy.special import j0

    t = layer.thickness
    far = min(_FAR * t, float(np.max(r)))
    # phi - 1 vanishes as exp(-2a). The nodes resolve the oscillations of J0 up to `far`.
    node, weight = np.polynomial.legendre.leggauss(200 + int(_LARGEST_A * far / t))
    a = _LARGEST_A * (node + 1) / 2
    factor = _LARGEST_A / 2 * weight * (layer.factor(a / t) - 1) * np.exp(-((a / t) ** 2) / 24) / (np.pi * t)
    table = np.linspace(0, far, 64 + int(16 * far / t))
    spline = make_interp_spline(table, np.array([np.dot(factor, j0(a * each / t)) for each in table]), k=5)
    return np.where(r <= far, spline(np.minimum(r, far)), -1 / (np.pi * np.maximum(r, 1.0)))
