"""Fig. 10: error of contact area and mean separation against load."""

from __future__ import annotations

from functools import partial

from icha.figures.errors import draw_errors

figure = partial(draw_errors, names=("area_error", "separation_error"), percent=True)
