"""The square that is cut out of a scan."""

from icha.support import in_words
from icha.surfaces.measured.pixels import SQUARE
from icha.surfaces.measured.scan import Scan
from icha.surfaces.measured.settings import Preparation, UnfitTopography
from icha.surfaces.surface import PERIODIC

# Rounding of the quotient of two lengths must not cost a pixel.
_ROUNDING = 1e-9


def cropped(scan: Scan, how: Preparation) -> tuple[Scan, list[str]]:
    """The square that the settings ask for, and what is to be said about it.

    It is made of whole pixels. If these are not square, one of its sides may be too long by less than a pixel.
    """
    rows, columns = scan.heights.shape
    dx, dy = scan.pixel
    width, height = map(in_words.length, scan.size)
    if how.crop is None:
        side = min(scan.size)
        nx, ny = (int(side / each * (1 + _ROUNDING)) for each in (dx, dy))
        if abs(dx / dy - 1) <= SQUARE:
            nx = ny = min(nx, ny)
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
    if how.boundary == PERIODIC and ((nx, ny) != (columns, rows) or abs(nx * dx / (ny * dy) - 1) > SQUARE):
        raise UnfitTopography(
            "boundary",
            f"needs a square, and the scan is {width} x {height}; allowed: a square one, or another boundary",
        )
    part = scan.heights[first_y : first_y + ny, first_x : first_x + nx]
    said = [] if part.shape == scan.heights.shape else [f"cut to {nx} x {ny} points from ({first_x}, {first_y})"]
    return Scan(part, (nx * dx, ny * dy)), said
