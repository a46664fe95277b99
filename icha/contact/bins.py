"""Bins in which gaps and pressures are counted, the same for every solution of a contact.

Of the gap in units of h_rms: one from zero, then 20 per decade. Of the pressure in units of E* h'_rms: linear where the
bulk is, 20 per decade in the tails. JKR pressures tend to minus infinity at the edge of a spot as |p|^-3, hence the
long tail.
"""

import numpy as np

GAPS_PER_DECADE = 20
GAP_BINS = np.concatenate([[0.0], np.logspace(-4, 1.5, 111)])
PRESSURE_BINS = np.concatenate([-np.logspace(8, 0, 161)[:-1], np.linspace(-1, 5, 301), 5 * np.logspace(0, 2, 41)[1:]])
