"""Fig. 11: errors of three results against load: pressure distribution, gap distribution and contact map."""

from __future__ import annotations

from functools import partial

from icha.figures.errors import draw_errors

NAMES = ("pressure_distribution_distance", "gap_distribution_distance", "jaccard")

figure = partial(draw_errors, names=NAMES, percent=False)
