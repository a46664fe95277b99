"""Fig. 10: how far contact area and mean separation are from boundary elements, against load."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import Declaration
from icha.figures.ensembles import POINTS_OF_SEEDS
from icha.figures.errors import Quantity, draw_errors
from icha.figures.options import ComparedFigure, campaign_and_model_error

DECLARATION = Declaration(
    description=(
        "Relative error of contact area and mean separation against boundary elements. The study needs both `models`, "
        "or an entry of `finite_range`."
    ),
    caption=(
        "Error of the model: contact area and mean separation of interacting asperities divided by those of boundary "
        "elements, minus one, in per cent, against the reduced pressure F/(E* h'rms A0). Topographies and loads are "
        "the same. The boundary elements are those in the limit of a short range of attraction, unless the legend "
        f"says otherwise. {POINTS_OF_SEEDS} Open markers are without adhesion. Of more than two surfaces every "
        "material has a row of panels of its own, and colours and shapes tell the surfaces apart. Points of one load "
        "are drawn a little apart. Boundary elements at a finite range are those by an independent code at the "
        "interaction range of the material; their contact area is corrected by the perimeter of the contact "
        "(Yastrebov et al., 2017). With adhesion, their contact is where the gap is zero, but a zone around it "
        "attracts as well. Dotted lines, if there are any, are errors relative to the energetic area, which is the "
        "energy of adhesion over that of full contact and tends to the area of JKR sooner as the range vanishes. At "
        "ranges that a grid resolves, these boundary elements show practically no hysteresis between loading and "
        "unloading; with adhesion they therefore bound the error in the limit of short ranges, but do not determine "
        "it."
    ),
    options=ComparedFigure,
    inputs=campaign_and_model_error,
)

QUANTITIES = (
    Quantity("area_error", r"error of $A/A_0$ (%)", 100, other="energetic_area_error"),
    Quantity("separation_error", r"error of $\bar{u}$ (%)", 100),
)

figure = partial(draw_errors, quantities=QUANTITIES)
