"""Fig. 10: error of contact area and mean separation against load."""

from __future__ import annotations

from functools import partial

from icha.figures.errors import draw_errors

WORDS = """Relative differences between asperity model and boundary elements in contact area (left) and mean separation
(right), on the same topographies at the same loads, against the reduced pressure F/(E* h'rms A0)."""

figure = partial(draw_errors, names=("area_error", "separation_error"), percent=True, words=WORDS)
