"""Fig. 10: how far contact area and mean separation are from boundary elements, against load."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import Declaration
from icha.figures.errors import Quantity, draw_errors
from icha.figures.options import ComparedFigure, model_error_only

DECLARATION = Declaration(
    description=(
        "Relative error of contact area and mean separation against boundary elements. The study needs both `models`, "
        "or an entry of `boundary_elements`."
    ),
    caption=(
        "Error of the model: contact area and mean separation of ICHA over those of boundary elements, less one, in "
        "per cent, against the reduced pressure F/(E* h'rms A0). Both press the same topographies. The boundary "
        "elements are those in the limit of a short range of attraction, unless the legend says otherwise. Points: "
        "mean over the seeds; bars: the 95 % confidence of that mean (Student's t); open markers are without adhesion. "
        "At a finite range they are an independent code with the interaction range of the material, and their contact "
        "area is corrected by the perimeter of the contact (Yastrebov et al., 2017); with adhesion that contact is "
        "where the gap is zero, and a zone around it attracts as well: dotted lines, where there are any, are errors "
        "against the energetic area, energy of adhesion over that of full contact, which tends to the area of JKR "
        "sooner as the range vanishes. At the ranges of attraction that a grid resolves they show practically no "
        "hysteresis between loading and unloading: with adhesion they bound the error in the limit of short ranges, "
        "they do not prove it."
    ),
    options=ComparedFigure,
    inputs=model_error_only,
)

QUANTITIES = (
    Quantity("area_error", r"error of $A/A_0$ (%)", 100, other="energetic_area_error"),
    Quantity("separation_error", r"error of $\bar{u}$ (%)", 100),
)

figure = partial(draw_errors, quantities=QUANTITIES)
