"""Fig. 10: error of contact area and mean separation against load."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import ComparedFigure, Declaration, dataset_and_model_error
from icha.figures.errors import draw_errors

DECLARATION = Declaration(
    description=(
        "Relative error of contact area and mean separation against boundary elements. The study needs both `models`, "
        "or an entry of `finite_range`."
    ),
    options=ComparedFigure,
    inputs=dataset_and_model_error,
)

LABELS = {"area_error": r"error of $A/A_0$ (%)", "separation_error": r"error of $\bar{u}$ (%)"}

figure = partial(draw_errors, labels=LABELS, percent=True)
