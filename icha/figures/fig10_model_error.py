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

LABELS = {"area_error": r"$A/A_{\mathrm{BEM}}-1$  (%)", "separation_error": r"$\bar{u}/\bar{u}_{\mathrm{BEM}}-1$  (%)"}

figure = partial(draw_errors, labels=LABELS, percent=True)
