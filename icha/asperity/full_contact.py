"""Full contact: its energy, and the pressures at which it is complete and opens.

They show before a run whether a surface is sticky. In full contact the pressure p(q) = q E* h(q)/2 flattens
the waves of the surface.

B. N. J. Persson and E. Tosatti, J. Chem. Phys. 115 (2001) 5597-5610, doi:10.1063/1.1398300 (energy).
"""

import math

# Values of U_full/dgamma below which full contact has a lower energy than no contact, and high pull-off is expected.
FULL_CONTACT_BELOW, HIGH_PULL_OFF_BELOW = 1.0, 2.0
MEANING = (
    f"below {FULL_CONTACT_BELOW:g} full contact has the lower energy; below about {HIGH_PULL_OFF_BELOW:g} high "
    "pull-off is expected"
)


def full_contact_energy_ratio(full_contact_energy: float, contact_modulus: float, surface_energy: float) -> float:
    """Return the elastic energy of full contact over the work of adhesion, U_full/dgamma; infinite without adhesion.

    Parameters
    ----------
    full_contact_energy : U_full/E* of the surface (`icha.surfaces.surface.Surface.full_contact_energy`), m.
    contact_modulus : E*, Pa.
    surface_energy : dgamma, J/m^2.
    """
    return full_contact_energy * contact_modulus / surface_energy if surface_energy > 0 else math.inf


def theoretical_strength(surface_energy: float, interaction_range: float) -> float:
    """Return the largest tension of a Lennard-Jones attraction, 16/(9 sqrt(3)) dgamma/epsilon, Pa.

    Parameters
    ----------
    surface_energy : dgamma, J/m^2.
    interaction_range : epsilon, m.
    """
    return 16 / (9 * math.sqrt(3)) * surface_energy / interaction_range


def flaw_strength(contact_modulus: float, surface_energy: float, flaw_radius: float) -> float:
    """Return the tension at which a penny-shaped crack in the interface grows, sqrt(pi E* dgamma/(2 a)), Pa.

    Its stress intensity K = 2 sigma sqrt(a/pi) reaches the energy release rate K^2/(2 E*) = dgamma
    (I. N. Sneddon, Proc. R. Soc. A 187 (1946) 229-260, for one of two bodies rigid).

    Parameters
    ----------
    contact_modulus : E*, Pa.
    surface_energy : dgamma, J/m^2.
    flaw_radius : a, m.
    """
    return math.sqrt(math.pi * contact_modulus * surface_energy / (2 * flaw_radius))


def gaussian_complete_pressure(waves: float) -> float:
    """Estimate the pressure over E* h'_rms at which contact with a Gaussian surface is complete without adhesion.

    It compensates the largest tension of full contact at zero load: the largest of about 2 pi waves^2 independent
    values with the standard deviation E* h'_rms/2. For five spectra the mean of five realisations was 0 to 9 % off.

    Parameters
    ----------
    waves : number of the shortest waves along a side.
    """
    return math.sqrt(2 * math.log(2 * math.pi * waves**2)) / 2


def expected_behaviour(energy_ratio: float) -> str:
    """Describe what a ratio U_full/dgamma leads to."""
    if energy_ratio < FULL_CONTACT_BELOW:
        return "sticky: closes by itself, and the strength of the interface decides the pull-off"
    if energy_ratio < HIGH_PULL_OFF_BELOW:
        return "nearly sticky: high pull-off is expected"
    return "closes under load only"
