"""Adhesive contact estimated from a run without adhesion, by the method of Ciavarella.

At the same contact area, adhesion in the limit of JKR retracts the contact by a rigid displacement, as in the exact
solution for a sphere: delta = delta_1 - s and F = F_1 - F_1' s with s = sqrt(2 dgamma A_1'/F_1''). The index 1 denotes
the contact without adhesion; primes are derivatives with respect to the indentation delta_1.

Source: M. Ciavarella, An approximate JKR solution for a general contact, including rough contacts, J. Mech. Phys.
Solids 114 (2018) 209-218. The method assumes that adhesion does not change the shape of the contact at the same area.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

# Degree of the polynomials from which the derivatives follow. Their fit needs twice as many states.
_DEGREE = 5


class AdhesiveStates(NamedTuple):
    """States of an adhesive contact.

    Attributes
    ----------
    relative_load : nominal pressure divided by E*.
    area_fraction : contact area divided by nominal area.
    separation : mean separation, m.
    """

    relative_load: np.ndarray
    area_fraction: np.ndarray
    separation: np.ndarray


def ciavarella_states(
    relative_load: np.ndarray, area_fraction: np.ndarray, separation: np.ndarray, adhesion_length: float
) -> AdhesiveStates | None:
    """Return the adhesive states at the contact areas of a loading path without adhesion.

    Parameters
    ----------
    relative_load, area_fraction, separation : states without adhesion, in the order of decreasing separation.
    adhesion_length : dgamma/E*, m.

    Returns
    -------
    The states with a positive second derivative of the load; None if there are fewer than ten states in contact.
    """
    area, places = np.unique(np.asarray(area_fraction, float), return_index=True)
    load, indentation = np.asarray(relative_load, float)[places], -np.asarray(separation, float)[places]
    touching = (load > 0) & (area > 0)
    if np.count_nonzero(touching) < 2 * _DEGREE:
        return None
    load, area, indentation = load[touching], area[touching], indentation[touching]
    # Functions of t = ln A. In this variable the logarithm of the load is nearly a straight line for every geometry.
    t = np.log(area)
    of_load, of_indentation = (Polynomial.fit(t, values, _DEGREE) for values in (np.log(load), indentation))
    pace = of_indentation.deriv(1)(t)
    stiffness = load * of_load.deriv(1)(t) / pace
    growth = load * (of_load.deriv(2)(t) + of_load.deriv(1)(t) ** 2) - stiffness * of_indentation.deriv(2)(t)
    usable = (pace > 0) & (growth > 0)
    # A'/F'' = (A/pace)/(growth/pace^2)
    shift = np.sqrt(2 * adhesion_length * area[usable] * pace[usable] / growth[usable])
    return AdhesiveStates(load[usable] - stiffness[usable] * shift, area[usable], shift - indentation[usable])
