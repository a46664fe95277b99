"""Closed forms of adhesive contacts in the limit of short range.

Each superposes a known contact without adhesion and a tension that acts as on flat punches of the same contact area
(K. L. Johnson, Contact Mechanics, Cambridge 1985). At the front the pressure then has the stress intensity K, and the
front is in equilibrium if the energy release rate G = K^2/(2 E*) is the surface energy (D. Maugis, Contact, Adhesion
and Rupture of Elastic Solids, Springer 2000), where E* is the composite modulus. Separations are mean gaps; gap =
separation - heights + displacement, with a displacement of zero mean.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from icha.asperity.jkr import JKR
from icha.asperity.material import Material

# Sums over the square lattice of side 1 without its origin: of 1/r, where a uniform counter-pressure makes the mean
# displacement zero, and of 1/r^3; 4 zeta(s/2) beta(s/2) for s = 1 and 3 (G. H. Hardy, Mess. Math. 49 (1919) 85).
IMAGES, IMAGES_CUBED = -3.9002649200019558, 9.0336216831008950


def intensity_at_equilibrium(material: Material) -> float:
    """Stress intensity at a front in equilibrium, sqrt(2 E* dgamma), Pa m^(1/2)."""
    return math.sqrt(2 * material.contact_modulus * material.surface_energy)


def punch_displacement(material: Material, radius: float, force: float, period: float) -> float:
    """Return the displacement of a round flat punch in a periodic cell with zero mean displacement, m.

    F/(2 E* a), and the displacement by images to third order in a/period: images act by their force and by their second
    moments. The mean square radius of the pressure is 2 a^2/3.
    """
    by_images = IMAGES / period + 2 * IMAGES_CUBED / period**3 * radius**2 / 6
    return force / (2 * material.contact_modulus * radius) + force * by_images / (math.pi * material.contact_modulus)


@dataclass(frozen=True)
class Sinusoid:
    """Contact of a wave h = amplitude cos(2 pi x/L) in m (K. L. Johnson, Int. J. Solids Struct. 32 (1995) 423).

    Without adhesion H. M. Westergaard's solution (J. Appl. Mech. 6 (1939) A49), p = p* sin^2(pi a/L) with p* = pi E*
    amplitude/L; its mean gap follows by integrating du = -compliance of strips dp. Adhesion adds a tension as on flat
    strips (W. T. Koiter, Ing.-Arch. 28 (1959) 168, for the cracks between them). Methods take psi = pi a/L between 0
    and pi/2, with a half the width of contact, of any shape.
    """

    material: Material
    amplitude: float
    wavelength: float

    @property
    def full_contact_pressure(self) -> float:
        """p* = pi E* amplitude/L, the least pressure of full contact without adhesion, Pa."""
        return math.pi * self.material.contact_modulus * self.amplitude / self.wavelength

    @property
    def alpha(self) -> float:
        """Johnson's parameter of adhesion, sqrt(2 E* dgamma/L)/p*."""
        return intensity_at_equilibrium(self.material) / math.sqrt(self.wavelength) / self.full_contact_pressure

    def tension(self, psi):
        """Return the reduction of the mean pressure by adhesion at the same contact, Pa."""
        return self.full_contact_pressure * self.alpha * np.sqrt(np.tan(psi))

    def pressure(self, psi):
        """Return the mean pressure p* (sin^2 psi - alpha sqrt(tan psi)), Pa."""
        return self.full_contact_pressure * np.sin(psi) ** 2 - self.tension(psi)

    def separation(self, psi):
        """Return the mean gap, m: amplitude (cos^2 psi + s ln s - alpha sqrt(tan psi) ln s), s = sin^2 psi."""
        s = np.sin(psi) ** 2
        return self.amplitude * (1 - s + s * np.log(s)) + self.tension(psi) * self._compliance(psi)

    def stored_energy(self, psi):
        """Return elastic minus adhesive energy over the nominal area, J/m^2; 0 out of contact.

        The terms are those of Westergaard's contact, of the tension, and of the contact area 2 psi/pi.
        """
        s = np.sin(psi) ** 2
        pressed = self.full_contact_pressure * self.amplitude * s**2 / 4 * (1 - 2 * np.log(s))
        tension = self.tension(psi)
        pulled = self._compliance(psi) * tension * (tension / 2 - self.full_contact_pressure * s)
        return pressed + pulled - self.material.surface_energy * 2 * psi / np.pi

    def _compliance(self, psi):
        return -2 * self.wavelength * np.log(np.sin(psi)) / (np.pi * self.material.contact_modulus)


@dataclass(frozen=True)
class CrackInTrough:
    """The last round gap in the trough of h = amplitude (cos qx + cos qy)/2, q = 2 pi/L, before full contact.

    In full contact the pressure is p + p0 (cos qx + cos qy)/2 with p0 = E* q amplitude/2, which is tensile at the
    trough; its mean around the trough is p - p0 J0(qr). A crack under such a tension t(r) has K = 2/sqrt(pi c)
    int t r/sqrt(c^2 - r^2) dr (I. N. Sneddon, Proc. R. Soc. Lond. A 187 (1946) 229) and, by reciprocity with an even
    tension, the volume 8/E* int t r sqrt(c^2 - r^2) dr. Cracks of neighbouring cells, and the tension without symmetry
    about the trough, are left out: both are of the order of (c/L)^3 or less. Lengths in m.
    """

    material: Material
    amplitude: float
    period: float

    def _moments(self, c):
        """Return the integrals of J0(qr) r/sqrt(c^2 - r^2) and J0(qr) r sqrt(c^2 - r^2) up to c."""
        q = 2 * math.pi / self.period
        return math.sin(q * c) / q, (math.sin(q * c) - q * c * math.cos(q * c)) / q**3

    @property
    def tearing(self) -> float:
        """p0 = pi E* amplitude/L, Pa."""
        return math.pi * self.material.contact_modulus * self.amplitude / self.period

    def pressure(self, c: float) -> float:
        """Return the mean pressure at which a crack of radius c (m) is in equilibrium, Pa; negative in tension."""
        root, _ = self._moments(c)
        return (self.tearing * root - intensity_at_equilibrium(self.material) * math.sqrt(math.pi * c) / 2) / c

    def separation(self, c: float) -> float:
        """Return the mean gap, m: the volume of the crack over the area of the cell."""
        _, cubed = self._moments(c)
        volume = 8 / self.material.contact_modulus * (self.tearing * cubed - self.pressure(c) * c**3 / 3)
        return volume / self.period**2


@dataclass(frozen=True)
class SphereInCell:
    """A paraboloid of radius of curvature R (m) with the law of Johnson, Kendall & Roberts in a periodic square cell.

    Its images displace its centre and bend the half-space under it, in proportion to its force. The error is of fifth
    order in contact radius over period (m), because the fourth-order term of the field of the images is left out.
    """

    material: Material
    radius_of_curvature: float
    period: float

    @property
    def _law(self):
        return JKR(self.material)

    def _curvature_radius(self, a):
        """Return R of the sphere relative to the half-space that its images bend, m, for contact radii a."""
        law, R = self._law, self.radius_of_curvature
        bend = IMAGES_CUBED / (2 * math.pi * self.material.contact_modulus * self.period**3)
        # The force is linear in the curvature, and the curvature in the force.
        slope = law.repulsive_force(a, 1.0)
        force = (slope / R - law.adhesive_force(a)) / (1 - slope * bend)
        return 1 / (1 / R + bend * force)

    def force(self, a):
        """Return the contact force (N) at contact radii a (m)."""
        return self._law.force(a, self._curvature_radius(a))

    def approach(self, a):
        """Return the approach of the summit to the mean plane of the cell, m."""
        R, modulus = self._curvature_radius(a), math.pi * self.material.contact_modulus
        images = IMAGES / self.period * self._law.force(a, R)
        images = images + IMAGES_CUBED / self.period**3 * self._law.second_moment(a, R)
        return self._law.approach(a, R) + images / modulus

    @property
    def jump_off_radius(self) -> float:
        """Contact radius at jump-off under separation control, where the approach is least, m."""
        single = float(self._law.jump_off_radius(self.radius_of_curvature))
        if single == 0:
            return 0.0
        return float(
            minimize_scalar(self.approach, bounds=(0.3 * single, 3 * single), options={"xatol": 1e-10 * single}).x
        )

    def contact_radius(self, approach: float) -> float:
        """Return the radius of the stable contact at an approach, m; ValueError if there is none below period/4."""
        return brentq(
            lambda a: float(self.approach(a)) - approach, self.jump_off_radius, self.period / 4, xtol=1e-14, rtol=1e-14
        )

    def loaded_radius(self, force: float) -> float:
        """Return the larger contact radius at a force (N), m; ValueError if the tension exceeds pull-off."""
        least = self._pull_off().x if self.material.surface_energy else 0.0
        return brentq(lambda a: float(self.force(a)) - force, least, self.period / 4, xtol=1e-14, rtol=1e-14)

    @property
    def pull_off_force(self) -> float:
        """Largest tension, N; 3/2 pi dgamma R for a single sphere."""
        return -float(self._pull_off().fun)

    def _pull_off(self):
        """Return the contact radius (x) and the force (fun) at the largest tension."""
        single = float(np.cbrt(9 * np.pi / 8 * self.material.adhesion_length * self.radius_of_curvature**2))
        return minimize_scalar(self.force, bounds=(0.5 * single, 2 * single), options={"xatol": 1e-10 * single})
