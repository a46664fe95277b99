"""Fig. 11: how far distributions of pressure and gap, and the contact map, are from boundary elements."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import Declaration
from icha.figures.ensembles import POINTS_OF_SEEDS
from icha.figures.errors import Quantity, draw_errors
from icha.figures.options import ComparedFigure, campaign_and_model_error

DECLARATION = Declaration(
    description=(
        "Distance of the distributions of pressure and gap, and of the contact map, from those of boundary elements. "
        "The study needs both `models`, or an entry of `finite_range`."
    ),
    caption=(
        "Difference between the states of interacting asperities and those of boundary elements, on the same "
        "topographies and at the same loads, against the reduced pressure F/(E* h'rms A0). The boundary elements are "
        "those in the limit of a short range of attraction, unless the legend says otherwise. First Wasserstein "
        "distances W1 (areas between the two cumulative distributions: how far the values have to be moved in the "
        "mean for both to agree) over the nominal area are shown for the contact pressure, P(p), in units of the "
        "nominal pressure, and for the gap, P(u), in units of the rms height. The overlap of the contact maps is the "
        "area in contact in both divided by the area in contact in at least one, on the nodes of the boundary "
        f"elements: 1 where they agree, 0 where they have nothing in common. {POINTS_OF_SEEDS} Open markers are "
        "without adhesion. Boundary elements at a finite range are those by an independent code. At ranges that a "
        "grid resolves they show practically no hysteresis; with adhesion they therefore bound the difference in the "
        "limit of short ranges (JKR), but do not determine it."
    ),
    options=ComparedFigure,
    inputs=campaign_and_model_error,
)

QUANTITIES = (
    Quantity("pressure_distribution_distance", r"distance of $P(p)$,  $W_1/p$", limits=(0, None), positive=True),
    Quantity(
        "gap_distribution_distance",
        r"distance of $P(u)$,  $W_1/h_{\mathrm{rms}}$",
        limits=(0, None),
        positive=True,
        words="$W_1$: area between the cumulative distributions",
    ),
    Quantity(
        "jaccard",
        "overlap of the contact maps",
        limits=(0, 1),
        positive=True,
        words="overlap: area in contact in both / in at least one",
    ),
)

figure = partial(draw_errors, quantities=QUANTITIES)
