"""Fig. 11: error of distributions of pressure and gap, and of the contact map, against load."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import ComparedFigure, Declaration, dataset_and_model_error
from icha.figures.errors import ErrorPanel, draw_errors

DECLARATION = Declaration(
    description=(
        "Distance of the distributions of pressure and gap, and of the contact map, from those of boundary elements. "
        "The study needs both `models`, or an entry of `finite_range`."
    ),
    options=ComparedFigure,
    inputs=dataset_and_model_error,
)

QUANTITIES = (
    ErrorPanel("pressure_distribution_distance", r"distance of $P(p)$,  $W_1/p$", positive=True),
    ErrorPanel("gap_distribution_distance", r"distance of $P(u)$,  $W_1/h_{\mathrm{rms}}$", positive=True),
    ErrorPanel("jaccard", "overlap of the contact maps", positive=True),
)

figure = partial(draw_errors, quantities=QUANTITIES)
