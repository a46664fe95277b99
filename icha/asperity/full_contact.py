"""Energy of full contact, divided by the work of adhesion: it shows whether a surface is sticky.

In full contact the pressure p(q) = q E* h(q)/2 flattens the wave h(q) of wave number q. Source: B. N. J. Persson and
E. Tosatti, J. Chem. Phys. 115 (2001) 5597-5610, doi:10.1063/1.1398300.
"""

import math

# Below the first value of U_full/dgamma, full contact has a lower energy than no contact. Below the second value, high
# pull-off tensions are expected.
FULL_CONTACT_BELOW, HIGH_PULL_OFF_BELOW = 1.0, 2.0
MEANING = (
    f"below {FULL_CONTACT_BELOW:g}, full contact has a lower energy than separated surfaces; below about "
    f"{HIGH_PULL_OFF_BELOW:g}, a high pull-off tension is expected"
)


def full_contact_energy_ratio(full_contact_energy: float, contact_modulus: float, surface_energy: float) -> float:
    """Return U_full/dgamma: elastic energy of full contact, divided by work of adhesion; infinite without adhesion.

    full_contact_energy : U_full/E* of the surface on the elastic body (`icha.surfaces.moments.FullContact`), m.
    contact_modulus, surface_energy : E* (Pa) and dgamma (J/m^2).
    """
    return full_contact_energy * contact_modulus / surface_energy if surface_energy > 0 else math.inf


def expected_behaviour(energy_ratio: float, receding_ratio: float) -> str:
    """Return a text that describes how a surface behaves, with the ratios U_full/dgamma of both works of adhesion."""
    if energy_ratio < FULL_CONTACT_BELOW:
        return "sticky: adhesion closes most of the contact, and the strength of the interface decides the pull-off"
    if receding_ratio < HIGH_PULL_OFF_BELOW:
        return "nearly sticky: high pull-off is expected"
    return "closes under load only"
