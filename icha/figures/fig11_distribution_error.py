"""Fig. 11: how far distributions of pressure and gap, and the contact map, are from boundary elements."""

from __future__ import annotations

from functools import partial

from icha.figures.declaration import Declaration
from icha.figures.errors import Quantity, draw_errors
from icha.figures.options import ComparedFigure, model_error_only

DECLARATION = Declaration(
    description=(
        "How far distributions of pressure and gap and the contact map are from those of boundary elements. The study "
        "needs both `models`, or an entry of `boundary_elements`."
    ),
    caption=(
        "How the states of ICHA differ from those of boundary elements of the same topographies and loads, in the "
        "limit of a short range of attraction unless the legend says otherwise, against the reduced pressure "
        "F/(E* h'rms A0): first Wasserstein distance (area between the cumulative distributions) between the P(p), in "
        "units of the nominal pressure, and between the P(u), in units of the rms height, both over the nominal area; "
        "and the overlap of the contact maps, area in contact in both over area in contact in either, on the nodes of "
        "the boundary elements. Points: mean over the seeds; bars: the 95 % confidence of that mean (Student's t); "
        "open markers are without adhesion. Where boundary elements have a finite range they are an independent code: "
        "at the ranges that a grid resolves they show practically no hysteresis, so that with adhesion they bound the "
        "limit of short ranges (JKR), and do not prove it."
    ),
    options=ComparedFigure,
    inputs=model_error_only,
)

QUANTITIES = (
    Quantity("pressure_distribution_distance", r"distance of $P(p)$,  $W_1/p$", limits=(0, None)),
    Quantity("gap_distribution_distance", r"distance of $P(u)$,  $W_1/h_{\mathrm{rms}}$", limits=(0, None)),
    Quantity("jaccard", "overlap of the contact maps", limits=(0, 1)),
)

figure = partial(draw_errors, quantities=QUANTITIES)
