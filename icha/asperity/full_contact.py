"""Elastic energy of full contact. Its ratio to the work of adhesion shows before a run whether a surface is sticky.

B. N. J. Persson and E. Tosatti, J. Chem. Phys. 115 (2001) 5597-5610, doi:10.1063/1.1398300.
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
