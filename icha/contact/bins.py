"""Bins in which gaps and pressures are counted, the same for every solution of a contact.

Of the gap in units of h_rms: one from zero, then 20 per decade. Of the pressure in units of E* h'_rms: linear where the
bulk is, 20 per decade in the tails. JKR pressures tend to minus infinity at the edge of a spot as |p|^-3, hence the
long tail. What lies beyond the last bin is counted in it, so that nothing is lost.
"""

import numpy as np

from icha.surfaces.surface import Surface

GAPS_PER_DECADE = 20
GAP_BINS = np.concatenate([[0.0], np.logspace(-4, 1.5, 111)])
PRESSURE_BINS = np.concatenate([-np.logspace(8, 0, 161)[:-1], np.linspace(-1, 5, 301), 5 * np.logspace(0, 2, 41)[1:]])


def gap_bins(surface: Surface) -> np.ndarray:
    """Edges of the bins of the gap on a surface, m.

    The last bin reaches to the largest gap that there is when the surface just touches, its height from the deepest
    pit to the highest peak, if that is more than 31.6 h_rms. By Chebyshev's inequality less than 0.2 % of a surface
    lies so deep, so that this one bin is enough for it.
    """
    edges = GAP_BINS * surface.rms_height
    edges[-1] = max(edges[-1], np.ptp(surface.heights))
    return edges
