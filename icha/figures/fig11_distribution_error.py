"""Fig. 11: errors of three results against load: pressure distribution, gap distribution and contact map."""

from __future__ import annotations

from functools import partial

from icha.figures.errors import draw_errors

NAMES = ("pressure_distribution_distance", "gap_distribution_distance", "jaccard")

WORDS = """Differences between the asperity model and boundary elements, on the same topographies at the same loads,
against the reduced pressure F/(E* h'rms A0). The left panels show the first Wasserstein distance W1 between the
distributions of the contact pressure over the nominal area, in units of the nominal pressure. The middle panels show W1
of the gap, in units of the rms height. W1 is the area between two cumulative distributions. The right panels show the
overlap of the contact maps: the area in contact in both models divided by the area in contact in at least one model."""

figure = partial(draw_errors, names=NAMES, percent=False, words=WORDS)
