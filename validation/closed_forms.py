"""Adhesive contacts in the limit of short range whose solution is known in closed form.

All are of one kind: a contact that is known without adhesion, and a tension on top that acts as on flat punches of the
same contact area (K. L. Johnson, Contact Mechanics, Cambridge 1985). At the front the pressure then has the stress
intensity K, and the front stands where the energy release rate G = K^2/(2 E*) is the surface energy (D. Maugis,
Contact, Adhesion and Rupture of Elastic Solids, Springer 2000), E* being the modulus of both sides together.
Separations are mean gaps; gap = separation - heights + displacement, with a displacement of zero mean.
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


@dataclass(frozen=True)
class RoundPunch:
    """A flat punch of circular face, alone (K. Kendall, J. Phys. D: Appl. Phys. 4 (1971) 1186).

    radius : of the face, m.
    """

    material: Material
    radius: float

    @property
    def pull_off_force(self) -> float:
        """sqrt(8 pi E* dgamma a^3), N: where K = F/(2 sqrt(pi) a^(3/2)) all along its edge is that of equilibrium."""
        E, gamma = self.material.contact_modulus, self.material.surface_energy
        return math.sqrt(8 * math.pi * E * gamma * self.radius**3)

    def displacement(self, force: float) -> float:
        """F/(2 E* a) of the punch, m; of the sign of the force."""
        return force / (2 * self.material.contact_modulus * self.radius)

    def displacement_in_cell(self, force: float, period: float) -> float:
        """The same with periodic images and without mean displacement, m, to the third order in a/period.

        The pressure has the mean square radius 2 a^2/3, on the punch as under it: images act by their force and by
        their second moments, a quarter of that.
        """
        by_images = IMAGES / period + 2 * IMAGES_CUBED / period**3 * self.radius**2 / 6
        return self.displacement(force) + force * by_images / (math.pi * self.material.contact_modulus)


@dataclass(frozen=True)
class Strips:
    """Flat strips side by side, infinitely long: what is between them are cracks in a row.

    half_width : a of the strips, m. period : L, from one to the next, m. Source: W. T. Koiter, Ing.-Arch. 28 (1959)
    168, K^2 = sigma^2 L cot(pi a/L) under the nominal tension sigma.
    """

    material: Material
    half_width: float
    period: float

    @property
    def pull_off_tension(self) -> float:
        """Nominal tension at equilibrium, sqrt(2 E* dgamma tan(pi a/L)/L), Pa."""
        return intensity_at_equilibrium(self.material) * math.sqrt(
            math.tan(math.pi * self.half_width / self.period) / self.period
        )

    @property
    def compliance(self) -> float:
        """Mean gap over the nominal tension, -2 L ln sin(pi a/L)/(pi E*), m/Pa.

        Its derivative by a gives G = K^2/(2 E*) at both edges.
        """
        sine = math.sin(math.pi * self.half_width / self.period)
        return -2 * self.period * math.log(sine) / (math.pi * self.material.contact_modulus)


@dataclass(frozen=True)
class Sinusoid:
    """A wave h = amplitude cos(2 pi x/wavelength) pressed on (K. L. Johnson, Int. J. Solids Struct. 32 (1995) 423).

    Without adhesion H. M. Westergaard's solution (J. Appl. Mech. 6 (1939) A49), p = p* sin^2(pi a/L) with p* = pi E*
    amplitude/L, of which the mean gap follows by integrating du = -compliance of strips dp; with it a tension as on
    `Strips` comes on top. Functions are of psi = pi a/L between 0 and pi/2, a half the width of contact, any shape.

    amplitude : of the wave from its mean, m. wavelength : L, m.
    """

    material: Material
    amplitude: float
    wavelength: float

    @property
    def full_contact_pressure(self) -> float:
        """p* = pi E* amplitude/L: the least that makes contact everywhere without adhesion, Pa."""
        return math.pi * self.material.contact_modulus * self.amplitude / self.wavelength

    @property
    def alpha(self) -> float:
        """Johnson's parameter of adhesion, sqrt(2 E* dgamma/L)/p*."""
        return intensity_at_equilibrium(self.material) / math.sqrt(self.wavelength) / self.full_contact_pressure

    def tension(self, psi):
        """What adhesion takes off the mean pressure at the same contact, Pa."""
        return self.full_contact_pressure * self.alpha * np.sqrt(np.tan(psi))

    def pressure(self, psi):
        """Mean pressure p* (sin^2 psi - alpha sqrt(tan psi)), Pa."""
        return self.full_contact_pressure * np.sin(psi) ** 2 - self.tension(psi)

    def separation(self, psi):
        """Mean gap, m: amplitude (cos^2 psi + s ln s - alpha sqrt(tan psi) ln s) with s = sin^2 psi."""
        s = np.sin(psi) ** 2
        return self.amplitude * (1 - s + s * np.log(s)) + self.tension(psi) * self._compliance(psi)

    def stored_energy(self, psi):
        """Elastic energy less that of adhesion over the nominal area, J/m^2; 0 out of contact.

        Of Westergaard's contact, of the tension that is put on it then, and of the contact area 2 psi/pi.
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
    """The round gap in the trough of h = amplitude (cos qx + cos qy)/2, q = 2 pi/L, left before contact is full.

    In full contact the pressure is p + p0 (cos qx + cos qy)/2 with p0 = E* q amplitude/2, which tears at the trough;
    its mean around it is p - p0 J0(qr). A crack under such a tension t(r) has K = 2/sqrt(pi c) int t r/sqrt(c^2 - r^2)
    dr (I. N. Sneddon, Proc. R. Soc. Lond. A 187 (1946) 229) and, by reciprocity with an even tension, the volume
    8/E* int t r sqrt(c^2 - r^2) dr. Cracks of neighbouring cells, and what tension has no symmetry about the trough,
    are left out: both are of the order of (c/L)^3 or less.

    amplitude : of the wave from its mean, m. period : L, m.
    """

    material: Material
    amplitude: float
    period: float

    def _moments(self, c):
        """Integrals of J0(qr) r/sqrt(c^2 - r^2) and J0(qr) r sqrt(c^2 - r^2) up to c."""
        q = 2 * math.pi / self.period
        return math.sin(q * c) / q, (math.sin(q * c) - q * c * math.cos(q * c)) / q**3

    @property
    def tearing(self) -> float:
        """p0 = pi E* amplitude/L, Pa."""
        return math.pi * self.material.contact_modulus * self.amplitude / self.period

    def pressure(self, c: float) -> float:
        """Mean pressure that holds a crack of radius c (m) open, Pa; negative in tension."""
        root, _ = self._moments(c)
        return (self.tearing * root - intensity_at_equilibrium(self.material) * math.sqrt(math.pi * c) / 2) / c

    def separation(self, c: float) -> float:
        """Mean gap, m, the volume of the crack over the cell."""
        _, cubed = self._moments(c)
        volume = 8 / self.material.contact_modulus * (self.tearing * cubed - self.pressure(c) * c**3 / 3)
        return volume / self.period**2

    def radius(self, separation: float) -> float:
        """Radius (m) of the crack at a mean gap (m).

        Raises
        ------
        ValueError
            If it is not within a quarter of the period.
        """
        return brentq(lambda c: self.separation(c) - separation, 1e-6 * self.period, self.period / 4, xtol=1e-15)


@dataclass(frozen=True)
class SphereInCell:
    """A paraboloid under Johnson, Kendall & Roberts' law in the middle of a square cell that is repeated periodically.

    Its images displace its centre and bend the half-space under it; both are proportional to its force, and known to
    the fifth order of contact radius over period (of the fourth-order term of the images' field nothing is taken).

    radius_of_curvature : R, m. period : side of the cell, m.
    """

    material: Material
    radius_of_curvature: float
    period: float

    @property
    def _law(self):
        return JKR(self.material)

    def _curvature_radius(self, a):
        """R of the sphere less the half-space that its images bend, m, for contact radii a."""
        law, R = self._law, self.radius_of_curvature
        bend = IMAGES_CUBED / (2 * math.pi * self.material.contact_modulus * self.period**3)
        # The force is linear in the curvature, and that in the force.
        slope = law.repulsive_force(a, 1.0)
        force = (slope / R - law.adhesive_force(a)) / (1 - slope * bend)
        return 1 / (1 / R + bend * force)

    def force(self, a):
        """Contact force, N, of contact radii a (m)."""
        return self._law.force(a, self._curvature_radius(a))

    def approach(self, a):
        """Approach of the summit to the mean plane of the cell, m: its height less the mean separation."""
        R, modulus = self._curvature_radius(a), math.pi * self.material.contact_modulus
        images = IMAGES / self.period * self._law.force(a, R)
        images = images + IMAGES_CUBED / self.period**3 * self._law.second_moment(a, R)
        return self._law.approach(a, R) + images / modulus

    @property
    def jump_off_radius(self) -> float:
        """Contact radius at which contact is lost at given separation, where the approach is least, m."""
        alone = float(self._law.jump_off_radius(self.radius_of_curvature))
        if alone == 0:
            return 0.0
        return float(
            minimize_scalar(self.approach, bounds=(0.3 * alone, 3 * alone), options={"xatol": 1e-10 * alone}).x
        )

    def contact_radius(self, approach: float) -> float:
        """Contact radius of the stable contact at an approach, m.

        Raises
        ------
        ValueError
            If there is none, or a radius beyond a quarter of the period.
        """
        return brentq(
            lambda a: float(self.approach(a)) - approach, self.jump_off_radius, self.period / 4, xtol=1e-14, rtol=1e-14
        )

    def loaded_radius(self, force: float) -> float:
        """The larger contact radius under a force (N), m.

        Raises
        ------
        ValueError
            If there is none: the force is a larger tension than that of pull-off.
        """
        least = float(np.cbrt(9 * np.pi / 8 * self.material.adhesion_length * self.radius_of_curvature**2))
        if least:
            bounds = (0.5 * least, 2 * least)
            least = float(minimize_scalar(self.force, bounds=bounds, options={"xatol": 1e-10 * least}).x)
        return brentq(lambda a: float(self.force(a)) - force, least, self.period / 4, xtol=1e-14, rtol=1e-14)

    @property
    def pull_off_force(self) -> float:
        """Largest tension, N; that of a sphere alone is 3/2 pi dgamma R."""
        alone = float(np.cbrt(9 * np.pi / 8 * self.material.adhesion_length * self.radius_of_curvature**2))
        bounds = (0.5 * alone, 2 * alone)
        return -float(minimize_scalar(self.force, bounds=bounds, options={"xatol": 1e-10 * alone}).fun)
