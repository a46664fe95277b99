"""Labels of logarithmic axes."""

from __future__ import annotations

import numpy as np
from matplotlib.ticker import LogFormatterSciNotation


class FewLabels(LogFormatterSciNotation):
    """Labels of the ticks between powers of ten: twos and fives where an axis shows less than two powers.

    Where these are too few as well, some of the ticks that there are.
    """

    _MOST = 3

    def set_locs(self, locs):
        """Choose among the ticks."""
        low, high = sorted(self.axis.get_view_interval())
        powers = np.floor(np.log10(high)) - np.ceil(np.log10(low)) + 1
        inside = [at for at in locs if low <= at <= high]
        digits = [at / 10 ** np.floor(np.log10(at)) for at in inside]
        chosen = [at for at, digit in zip(inside, digits, strict=True) if np.isclose(digit, (2, 5)).any()]
        if len(chosen) + powers < 2:
            chosen = inside[:: -(-len(inside) // self._MOST) or 1]
        self._chosen = chosen if powers < 2 else []

    def __call__(self, x, pos=None):
        """The label of a tick."""
        return super().__call__(x, pos) if x in self._chosen else ""
