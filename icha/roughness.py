"""What a rough surface is to statistical theories: three moments of its spectrum, and numbers made of them.

Surfaces are taken to be isotropic: the moments are those of a profile along any direction, as in P. R. Nayak, J.
Lubr. Technol. 93 (1971) 398-407, doi:10.1115/1.3451608.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from icha.material import Material
from icha.surface import Surface

# Contact area over load in the limit of small areas, A E* h'_rms/F, in the theory of Pastewka & Robbins.
REPULSIVE_AREA_SLOPE = 2.0


class SpectralMoments(NamedTuple):
    """Variances of a profile's height (m0, m^2), slope (m2, 1) and curvature (m4, m^-2)."""

    m0: float
    m2: float
    m4: float

    @property
    def nayak_parameter(self) -> float:
        """Nayak's alpha = m0 m4/m2^2, the breadth of the spectrum; at least 3/2 for an isotropic surface."""
        return self.m0 * self.m4 / self.m2**2

    @property
    def rms_height(self) -> float:
        """Root mean square height, m."""
        return self.m0**0.5

    @property
    def rms_slope(self) -> float:
        """Root mean square of |grad h|, whose square is twice that of a profile's slope."""
        return (2 * self.m2) ** 0.5

    @property
    def rms_laplacian(self) -> float:
        """Root mean square of the Laplacian of h, 1/m, whose square is 8/3 of that of a profile's curvature."""
        return (8 / 3 * self.m4) ** 0.5

    def scaled_to_rms_slope(self, rms_slope: float) -> SpectralMoments:
        """Those of the same topography with its heights multiplied so that the rms slope is `rms_slope`."""
        factor = (rms_slope / self.rms_slope) ** 2
        return SpectralMoments(*(moment * factor for moment in self))


def spectral_moments(surface: Surface) -> SpectralMoments:
    """Moments of a profile of the surface, averaged over its directions."""
    height, slope, laplacian = surface.spectral_moments
    return SpectralMoments(height, slope / 2, 3 / 8 * laplacian)


def stickiness(moments: SpectralMoments, material: Material) -> float:
    r"""Attraction over repulsion where surfaces touch; those above 1 stick, without adhesion it is 0.

    L. Pastewka and M. O. Robbins, PNAS 111 (2014) 3298-3303, doi:10.1073/pnas.1320846111. The contact, of area A, feels
    the mean repulsive pressure h' E*/kappa with kappa = 2. Around it lies the area of a gap less than the range r of
    the attraction, of the stress dgamma/r; by Hertz's gap beside a contact of mean diameter d = 4 h'/h'' that area is

        A_att/A = pi [3 h'' r/(16 h'^2)]^(2/3).

    The ratio of the two forces is kappa/kappa_att in their notation, and their criterion for sticking,

        (h' r E*/(kappa dgamma)) [h' d/(4 r)]^(2/3) < pi (3/16)^(2/3) = 1.03,

    is that it exceeds 1. h' is the rms slope, h'' the rms Laplacian. They ask for an attraction of short range, whose
    area stays small beside A: J. M. Monti, A. Sanner and L. Pastewka, Tribol. Lett. 69 (2021),
    doi:10.1007/s11249-021-01454-6. The range of the material stands for r.

    Parameters
    ----------
    moments : of the surface, at its own rms slope.
    material : contact modulus, surface energy and range of attraction.
    """
    slope, reach = moments.rms_slope, material.interaction_range
    attractive_area = np.pi * np.cbrt(3 * moments.rms_laplacian * reach / (16 * slope**2)) ** 2
    return float(REPULSIVE_AREA_SLOPE * material.adhesion_length / (slope * reach) * attractive_area)
