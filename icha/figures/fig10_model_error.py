"""Fig. 10: how far contact area and mean separation are from boundary elements, against load."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import ComparedFigure, Declaration, campaign_and_model_error
from icha.figures.errors import Quantity, draw_errors

DECLARATION = Declaration(
    description=(
        "Relative error of contact area and mean separation against boundary elements. The study needs both `models`, "
        "or an entry of `finite_range`."
    ),
    options=ComparedFigure,
    inputs=campaign_and_model_error,
)

QUANTITIES = (
    Quantity("area_error", r"error of $A/A_0$ (%)", 100, other="energetic_area_error"),
    Quantity("separation_error", r"error of $\bar{u}$ (%)", 100),
)

figure = partial(draw_errors, quantities=QUANTITIES)
