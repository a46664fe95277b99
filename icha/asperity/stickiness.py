"""Stickiness of rough surfaces: attraction over repulsion where they touch."""

import numpy as np

from icha.asperity.material import Material
from icha.surfaces.moments import SpectralMoments

# Contact area over load in the limit of small areas, A E* h'_rms/F, in the theory of Pastewka & Robbins.
REPULSIVE_AREA_SLOPE = 2.0


def stickiness(moments: SpectralMoments, material: Material) -> float:
    r"""Return the ratio of attraction to repulsion in contact; surfaces above 1 stick, and without adhesion it is 0.

    L. Pastewka and M. O. Robbins, PNAS 111 (2014) 3298-3303, doi:10.1073/pnas.1320846111. The contact, of area A, feels
    the mean repulsive pressure h' E*/kappa with kappa = 2. Around it lies the area of a gap less than the range r of
    the attraction, of the stress dgamma/r; by Hertz's gap beside a contact of mean diameter d = 4 h'/h'' that area is

        A_att/A = pi [3 h'' r/(16 h'^2)]^(2/3).

    The ratio of the two forces is kappa/kappa_att in their notation. It exceeds 1 where their criterion for sticking
    holds,

        (h' r E*/(kappa dgamma)) [h' d/(4 r)]^(2/3) < pi (3/16)^(2/3) = 1.03.

    Here h' is the rms slope, h'' the rms Laplacian. The criterion needs an attraction of short range,
    whose area stays small compared with A: J. M. Monti, A. Sanner and L. Pastewka, Tribol. Lett. 69 (2021),
    doi:10.1007/s11249-021-01454-6. Here r is the range of the material.

    Parameters
    ----------
    moments : of the surface, at its own rms slope.
    material : contact modulus, surface energy and range of attraction.
    """
    slope, reach = moments.rms_slope, material.interaction_range
    attractive_area = np.pi * np.cbrt(3 * moments.rms_laplacian * reach / (16 * slope**2)) ** 2
    return float(REPULSIVE_AREA_SLOPE * material.adhesion_length / (slope * reach) * attractive_area)
