"""What an array needs to be a height map."""

import numpy as np


def flaw_of_heights(heights: np.ndarray) -> str | None:
    """What keeps an array of real numbers from being a height map: its shape, values that are not finite, flatness."""
    if heights.ndim != 2 or heights.shape[0] != heights.shape[1] or heights.shape[0] < 8:
        return f"an array of shape {heights.shape}, not a square of at least 8 x 8"
    bad = int(np.count_nonzero(~np.isfinite(heights)))
    if bad:
        return f"{bad} of {heights.size} heights that are not finite"
    if heights.max() == heights.min():
        return "heights that are all the same"
    return None
