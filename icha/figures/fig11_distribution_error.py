"""Fig. 11: errors of three results against load: pressure distribution, gap distribution and contact map."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import ComparedFigure, Declaration, dataset_and_model_error
from icha.figures.errors import draw_errors

DECLARATION = Declaration(
    description="Differences of distributions and contact maps between the asperity model and boundary elements.",
    options=ComparedFigure,
    inputs=dataset_and_model_error,
)

NAMES = ("pressure_distribution_distance", "gap_distribution_distance", "jaccard")

figure = partial(draw_errors, names=NAMES, percent=False)
