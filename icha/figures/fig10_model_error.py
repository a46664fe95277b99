"""Fig. 10: error of contact area and mean separation against load."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import ComparedFigure, Declaration, dataset_and_model_error
from icha.figures.errors import draw_errors

DECLARATION = Declaration(
    description="Error of contact area and mean separation of the asperity model, relative to boundary elements.",
    options=ComparedFigure,
    inputs=dataset_and_model_error,
)

figure = partial(draw_errors, names=("area_error", "separation_error"), percent=True)
