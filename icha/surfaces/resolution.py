"""Resolution of a surface by its grid: the number of grid cells in the shortest wave, and in the contact radius.

One rule holds for every kind of surface and shape. Fewer than LEAST_CELLS cells must be confirmed in a campaign, and
cause a warning in Python. Fewer than RECOMMENDED_CELLS cells cause a statement on the error.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    # `icha.surfaces.surface` imports SciPy, which takes time. Commands that need only the rule should not wait.
    from icha.surfaces.surface import Surface

LEAST_CELLS, RECOMMENDED_CELLS = 4, 8
# A quotient of two lengths may have this relative rounding error.
_ROUNDING = 1e-9
# With fewer cells per shortest wave, the heights of a file are noise of single cells, which results do not describe.
NYQUIST_CELLS = 2
# Half of the mean square curvature of a self-affine surface with H = 0.8 is in waves shorter than this number of
# shortest wavelengths, 2^(1/(4 - 2 H)). For H from 0.3 to 1, the number is 1.23 to 1.41.
_MEDIAN_OF_CURVATURE = 2 ** (1 / 2.4)
# Largest relative error of the estimate by this number, for H from 0.3 to 1 (`tests/surfaces/test_resolution.py`).
_ESTIMATE_ERROR = 0.14

WAVE, RADIUS = "shortest wave", "contact radius"


class Resolution(NamedTuple):
    """Number of grid cells in the shortest length that a grid must resolve.

    Attributes
    ----------
    cells : number of cells; infinite for a smooth shape without waves.
    of : the length, WAVE or RADIUS.
    estimated : whether the length is an estimate from the spectrum of the heights.
    """

    cells: float
    of: str = WAVE
    estimated: bool = False

    def reaches(self, least: float) -> bool:
        """Return whether the length has at least this number of cells, within the error of the number."""
        return self.cells >= least * (1 - (_ESTIMATE_ERROR if self.estimated else _ROUNDING))

    @property
    def representable(self) -> bool:
        """Whether a grid contains a wave of this length, which needs two cells."""
        return self.cells >= NYQUIST_CELLS * (1 - _ROUNDING)

    def grid_of(self, grid: int, cells: float) -> int:
        """Return the number of nodes that gives the length `cells` cells, if `grid` nodes give `self.cells` cells."""
        return math.ceil(grid * cells / self.cells * (1 - _ROUNDING))

    def grids(self, grid: int) -> str:
        """Return the grids that have enough cells as text, if the length has `self.cells` cells on `grid` nodes."""
        least, better = (self.grid_of(grid, cells) for cells in (LEAST_CELLS, RECOMMENDED_CELLS))
        return f"a grid of at least {least} nodes ({LEAST_CELLS} cells), better {better} ({RECOMMENDED_CELLS} cells)"

    @property
    def error(self) -> str:
        """Error of the contact area that boundary elements compute on this grid, as text; "" if it is small.

        Contact areas of random surfaces at p* = 1e-3 and 1e-2 were compared with areas on grids four times as fine. The
        largest errors were 93 % on white noise, 23 % with 2 cells per shortest wave, 15 % with 3, 11 % with 5. Contact
        areas of spheres and cones without adhesion, at 33 forces, had errors of up to 12 % with a contact radius of 1
        to 3 cells, 4 % with 3 to 8 cells, and 1.6 % with 8 to 9 cells.
        """
        if self.reaches(RECOMMENDED_CELLS):
            return ""
        if self.reaches(LEAST_CELLS):
            return "up to a few per cent"
        if self.of == RADIUS:
            return "12 % or more"
        return "up to a quarter" if self.representable else "up to a factor of two"

    def __str__(self):
        """Return the number of cells as text for messages."""
        return f"{self.cells:.3g} cells per {self.of}{', estimated from the spectrum' if self.estimated else ''}"


def shortest_wave(surface: Surface) -> tuple[float, bool]:
    """Return the shortest wavelength of the roughness and the shape, m, and whether it is an estimate.

    The wavelength of a random surface is that of its spectrum. The wavelength of a surface of unknown spectrum is
    estimated: half of the mean square curvature is in waves shorter than 2^(1/2.4) shortest wavelengths, as for a
    self-affine spectrum with H = 0.8. A smooth shape without waves has an infinite wavelength.
    """
    of_shape = math.inf if surface.shape is None else surface.shape.shortest_wave
    if surface.smooth:
        return of_shape, False
    known = surface.short_wavelength
    of_roughness = known or _estimated_short_wavelength(surface)
    return min(of_roughness, of_shape), known is None and of_roughness < of_shape


def resolution_of(surface: Surface) -> Resolution:
    """Return the number of cells per shortest wave of a surface."""
    wavelength, estimated = shortest_wave(surface)
    return Resolution(wavelength / surface.spacing, estimated=estimated)


def _estimated_short_wavelength(surface: Surface) -> float:
    """Estimate the shortest wavelength, m, from the median wave number of the mean square curvature."""
    from icha.surfaces.moments import radial_power_spectrum

    q, power, edges = radial_power_spectrum(surface)
    share = np.cumsum(power * q**4 * np.diff(edges**2))
    median = float(np.interp(share[-1] / 2, np.insert(share, 0, 0.0), edges))
    return 2 * math.pi / (median * _MEDIAN_OF_CURVATURE)
