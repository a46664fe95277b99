"""Stickiness of rough surfaces: two criteria that show whether adhesion overcomes the roughness."""

import numpy as np

from icha.asperity.material import Material
from icha.surfaces.moments import SpectralMoments

# A E* h'_rms/F for small contact areas A at the load F, in the theory of Pastewka & Robbins.
REPULSIVE_AREA_SLOPE = 2.0


def stickiness(moments: SpectralMoments, material: Material) -> float:
    r"""Return the ratio of the attractive to the repulsive force in contact; above 1 the surface is sticky.

    L. Pastewka and M. O. Robbins, PNAS 111 (2014) 3298-3303, doi:10.1073/pnas.1320846111. The mean repulsive pressure
    on the contact area A is h' E*/kappa with kappa = 2. Around the contact, the attractive stress is dgamma/r where the
    gap is less than the range r. Hertz's gap beside a contact of mean diameter d = 4 h'/h'' gives the attractive area

        A_att/A = pi [3 h'' r/(16 h'^2)]^(2/3).

    Here h' is the rms slope and h'' the rms Laplacian. The paper calls the force ratio kappa/kappa_att. It exceeds 1
    if the paper's criterion for sticking is met, (h' r E*/(kappa dgamma)) [h' d/(4 r)]^(2/3) < pi (3/16)^(2/3) = 1.03.
    The criterion is valid if the range is so short that A_att is small compared with A: J. M. Monti, A. Sanner and
    L. Pastewka, Tribol. Lett. 69 (2021), doi:10.1007/s11249-021-01454-6. Without adhesion the ratio is 0.

    moments : spectral moments of the surface at its actual rms slope.
    """
    slope, reach = moments.rms_slope, material.interaction_range
    if not slope:
        return 0.0  # a smooth shape
    attractive_area = np.pi * np.cbrt(3 * moments.rms_laplacian * reach / (16 * slope**2)) ** 2
    return float(REPULSIVE_AREA_SLOPE * material.adhesion_length / (slope * reach) * attractive_area)


def sticky_rms_height(longest_wavelength: float, material: Material) -> float:
    r"""Return the largest rms height, m, of a random surface that is sticky according to the bearing area model (BAM).

    M. Ciavarella, Meccanica 53 (2018) 241-250, doi:10.1007/s11012-017-0701-6. Here u is the mean separation, h the rms
    height, beta = 1/2 and q_L = 2 pi/lambda_L. Attraction acts where the gap is less than the range. The nominal
    tension of attraction is p_a = dgamma/(sqrt(2 pi) h) exp(-u^2/(2 h^2)). Persson's nominal pressure of repulsion is
    p_r = (3/(8 beta)) q_L h E* exp(-u/(beta h)). The maximum of p_a/p_r, at u = h/beta, exceeds 1 if

        h^2 < e^2/(sqrt(2 pi) 3 pi/2) lambda_L dgamma/E* = 0.63 lambda_L dgamma/E*.

    Parameters
    ----------
    longest_wavelength : lambda_L in m, the roll-off wavelength of a self-affine surface.
    material : contact modulus and surface energy.
    """
    factor = np.exp(2) / (np.sqrt(2 * np.pi) * 1.5 * np.pi)
    return float(np.sqrt(factor * longest_wavelength * material.adhesion_length))
