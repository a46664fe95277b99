"""The square that is cut out of a scan."""

from icha.support import in_words
from icha.surfaces.measured.scan import Scan
from icha.surfaces.measured.settings import Preparation, UnfitTopography
from icha.surfaces.surface import PERIODIC

# Rounding of the quotient of two lengths must not cost a pixel.
_ROUNDING = 1e-9
# Relative difference of the two sides of a square of whole pixels that are not square.
_SQUARE = 1e-3


def cropped(scan: Scan, how: Preparation) -> tuple[Scan, list[str]]:
    """The square of whole pixels that the settings ask for, and what is to be said about it."""
    rows, columns = scan.heights.shape
    dx, dy = scan.pixel
    width, height = map(in_words.length, scan.size)
    pixel = " x ".join(map(in_words.length, scan.pixel))
    if how.crop is None:
        side = min(scan.size)
        nx, ny = (int(side / each * (1 + _ROUNDING)) for each in (dx, dy))
        first_x, first_y = (columns - nx) // 2, (rows - ny) // 2
    else:
        x, y, side = (how.crop[name] for name in ("x", "y", "side"))
        first_x, first_y = round(x / dx), round(y / dy)
        nx, ny = round(side / dx), round(side / dy)
        if first_x + nx > columns or first_y + ny > rows:
            raise UnfitTopography(
                "crop",
                f"ends at x = {in_words.length(x + side)}, y = {in_words.length(y + side)}, outside of the scan"
                f"{scan.remark_on_unit}; allowed: up to x = {width}, y = {height}",
            )
    if nx < 8 or ny < 8:
        raise UnfitTopography(
            "crop" if how.crop else "path",
            f"leaves {nx} x {ny} points{scan.remark_on_unit}; allowed: at least 8 x 8 of them",
        )
    if how.boundary == PERIODIC and (nx, ny) != (columns, rows):
        raise UnfitTopography(
            "boundary",
            f"needs a square, and the scan is {width} x {height}; allowed: a square one, or another boundary",
        )
    if abs(nx * dx / (ny * dy) - 1) > _SQUARE:
        raise UnfitTopography(
            "crop",
            f"leaves {nx} x {ny} pixels of {pixel}, which are no square; allowed: x, y and a "
            "side of whole pixels both ways",
        )
    if nx != ny and how.grid is None:
        raise UnfitTopography(
            "grid",
            f"is missing, and the pixels of {pixel} are not square; allowed: the nodes along a "
            f"side to which {nx} x {ny} points are resampled",
        )
    part = scan.heights[first_y : first_y + ny, first_x : first_x + nx]
    said = [] if part.shape == scan.heights.shape else [f"cut to {nx} x {ny} points from ({first_x}, {first_y})"]
    return Scan(part, (nx * dx, ny * dy)), said
