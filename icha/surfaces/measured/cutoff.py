"""Short waves of a scan, taken out by the Gaussian S-filter of ISO 25178."""

import math
from dataclasses import replace

from icha.support import in_words
from icha.surfaces.measured.scan import Scan
from icha.surfaces.measured.settings import Preparation, UnfitTopography
from icha.surfaces.surface import PERIODIC

# Standard deviation of the weights over the nesting index: alpha/sqrt(2 pi), alpha = sqrt(ln 2/pi) (ISO 16610-61).
DEVIATION = math.sqrt(math.log(2) / 2) / math.pi
# Below so many pixels the weights are too few to have the transmission of the standard.
LEAST_PIXELS = 4
# Standard deviations after which the weights end; what is cut off is 2e-9.
_REACH = 6


def without_short_waves(scan: Scan, how: Preparation) -> tuple[Scan, list[str]]:
    """After the areal Gaussian filter of ISO 16610-61, whose nesting index is the cut-off: it halves that wave.

    A wave of length l is multiplied by 2^-(cutoff/l)^2. At the edges heights go on by reflection (ISO 16610-28),
    those of a periodic scan by its period.
    """
    if how.cutoff is None:
        return scan, []
    # Slow to import, and seldom needed.
    from scipy.ndimage import gaussian_filter

    least, most = LEAST_PIXELS * max(scan.pixel), min(scan.size)
    if not least * (1 - 1e-9) <= how.cutoff <= most:
        raise UnfitTopography(
            "cutoff",
            f"is {how.cutoff / max(scan.pixel):.3g} pixels{scan.remark_on_unit}; allowed: from {LEAST_PIXELS} pixels, "
            f"{in_words.length(least)}, to the side of the square, {in_words.length(most)}",
        )
    dx, dy = scan.pixel
    sigma = DEVIATION * how.cutoff
    mode = "wrap" if how.boundary == PERIODIC else "reflect"
    heights = gaussian_filter(scan.heights, (sigma / dy, sigma / dx), mode=mode, truncate=_REACH)
    said = f"Gaussian S-filter (ISO 16610-61) with a nesting index of {how.cutoff:.6g} m"
    return replace(scan, heights=heights), [said]
