"""Check whether the grid resolves a measured surface: summits, noise of the instrument, recommended settings."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft

from icha.surfaces.measured.defects import Defects
from icha.surfaces.measured.settings import Preparation
from icha.surfaces.measured.topography import LEAST_PIXELS, PreparedTopography, defects_of, prepared_topography
from icha.surfaces.moments import radial_power_spectrum
from icha.surfaces.resolution import LEAST_CELLS, RECOMMENDED_CELLS, Resolution, resolution_of
from icha.surfaces.summits import Asperities, locate_summits
from icha.surfaces.surface import FREE, PERIODIC, Surface

# Conditions for a noise floor: it falls less steeply than q^_FLOOR_FALLS, and spans a factor of _FLOOR_SPANS in wave
# number. A self-affine spectrum falls at least as steeply as q^-2; the spectrum of uncorrelated noise is flat.
_FLOOR_FALLS, _FLOOR_SPANS = -1.0, 1.3
# A noise floor counts as a rounding error if its power, divided by the largest power, is below this value.
_ROUNDING = 1e-20
# A coarser grid is recommended if its number of nodes along a side is at most this fraction of the present number.
_WORTH = 0.75
# A cut-off is recommended only if noise contributes at least this fraction of the mean square slope.
_NOTICEABLE = 0.01


@dataclass(frozen=True)
class NoiseFloor:
    """Noise floor: flat part of the spectrum of a scan at short wavelengths.

    Attributes
    ----------
    wavelength : wavelength at which surface and noise have equal power, m; shorter waves are mostly noise.
    rms : rms height of the noise, m.
    slope_share : fraction (0 to 1) of the mean square slope that waves shorter than `wavelength` contribute.
    """

    wavelength: float
    rms: float
    slope_share: float


@dataclass(frozen=True, eq=False)
class ScanResolution(PreparedTopography):
    """A prepared scan, and the same scan before the filter of short waves.

    Attributes
    ----------
    measured : square that is cut out of the scan, before filter, treatment of edges and change of grid.
    settings : settings of the preparation.
    """

    measured: Surface
    settings: Preparation

    @cached_property
    def defects(self) -> Defects:
        """Outliers, offsets of scan lines and curvature of the scan, before they are removed."""
        return defects_of(self.square)

    @property
    def noise_share_after_filter(self) -> float:
        """Fraction of the mean square slope of the filtered surface that is noise; 0 without a noise floor."""
        if self.noise is None:
            return 0.0
        q, power, edges = radial_power_spectrum(self.measured)
        slopes = q**2 * np.diff(edges**2) * 4.0 ** -((self.settings.cutoff * q / (2 * np.pi)) ** 2)
        floor = np.minimum(power, (self.noise.rms * self.measured.spacing / (2 * math.pi)) ** 2)
        return float(np.sum(slopes * floor) / np.sum(slopes * power))

    @cached_property
    def asperities(self) -> Asperities:
        """Summits of the prepared surface, and its unsupported maxima; see `Asperities`."""
        return locate_summits(self.surface)

    @cached_property
    def resolution(self) -> Resolution:
        """Number of cells per shortest wave of the prepared surface, estimated from its spectrum."""
        return resolution_of(self.surface)

    @cached_property
    def noise(self) -> NoiseFloor | None:
        """Noise floor of the spectrum of the scan; None if the spectrum has no noise floor."""
        return noise_floor(self.measured)

    @property
    def advice(self) -> dict[str, float | int]:
        """Recommended `cutoff` (m) and `grid` for a grid that resolves the surface; empty if no change is needed."""
        found = {}
        cutoff, pixel = self.settings.cutoff or 0.0, self.measured.spacing
        noise = self.noise if self.noise is not None and self.noise.slope_share >= _NOTICEABLE else None
        if noise is not None and cutoff < noise.wavelength * (1 - 1e-9):
            found["cutoff"] = _rounded_up(max(noise.wavelength, LEAST_PIXELS * pixel))
        elif not self.resolution.reaches(LEAST_CELLS) and cutoff < RECOMMENDED_CELLS * pixel * (1 - 1e-9):
            found["cutoff"] = _rounded_up(RECOMMENDED_CELLS * pixel)
        cutoff = found.get("cutoff", cutoff)
        if cutoff:
            grid = scipy.fft.next_fast_len(math.ceil(RECOMMENDED_CELLS * self.surface.period / cutoff), real=True)
            if grid <= _WORTH * self.surface.grid:
                found["grid"] = grid
        return found if found.get("cutoff", 0.0) < self.measured.period / RECOMMENDED_CELLS else {}


def filtered_slope_share(surface: Surface, cutoff: float) -> float:
    """Estimate the fraction of the rms slope that remains after a Gaussian filter with nesting index `cutoff` (m)."""
    q, power, edges = radial_power_spectrum(surface)
    slopes = power * q**2 * np.diff(edges**2)
    transmission = 2.0 ** -((cutoff * q / (2 * np.pi)) ** 2)
    return math.sqrt(float(np.sum(slopes * transmission**2) / np.sum(slopes)))


def examine_scan(path: str | os.PathLike, preparation: Mapping) -> ScanResolution:
    """Prepare a scan with and without its filter; arguments and exceptions are those of `prepared_topography`."""
    raw = {key: preparation[key] for key in preparation if key not in ("cutoff", "taper")}
    if preparation["boundary"] != PERIODIC:
        raw |= {"boundary": FREE, "grid": None}
    measured = prepared_topography(path, raw).surface
    return ScanResolution(
        **vars(prepared_topography(path, preparation)),
        measured=measured,
        settings=Preparation(**preparation),
    )


def without_preparation(path: str | os.PathLike, preparation: Mapping) -> Surface:
    """Return the square of a scan with filled points and without tilt, but with all defects; for a comparison."""
    steps = ("cutoff", "taper", "outliers", "levelling", "grid", "shape")
    raw = {key: preparation[key] for key in preparation if key not in steps}
    return prepared_topography(path, raw | {"boundary": FREE, "detrend": "tilt", "missing": "fill"}).surface


def noise_floor(surface: Surface) -> NoiseFloor | None:
    """Find the noise floor at the end of the radial power spectrum of a surface; None if the spectrum has no floor.

    The floor is the longest tail of the spectrum in which the best-fitting power law falls less steeply than 1/q. The
    power of the floor is the geometric mean of the powers in the short-wave half of the tail.
    """
    q, power, edges = radial_power_spectrum(surface)
    log_q, log_power = np.log(q), np.log(np.maximum(power, np.finfo(float).tiny))
    tails = [k for k in range(len(q) - 2) if q[-1] >= _FLOOR_SPANS * q[k]]
    begins = next((k for k in tails if np.polyfit(log_q[k:], log_power[k:], 1)[0] > _FLOOR_FALLS), None)
    if begins is None:
        return None
    floor = float(np.exp(np.mean(log_power[(begins + len(q)) // 2 :])))
    if floor < _ROUNDING * power.max():
        return None
    above = np.flatnonzero(power > 2 * floor)
    # Interpolate the logarithm of the power between rings k and k + 1. If all rings are noise, take the longest wave.
    k = above[-1] if len(above) else 0
    limit = q[k]
    if len(above) and k + 1 < len(q):
        fraction = np.log(power[k] / (2 * floor)) / np.log(power[k] / power[k + 1])
        limit = q[k] * (q[k + 1] / q[k]) ** min(max(fraction, 0.0), 1.0)
    # Contributions of the rings to the mean square slope, up to a common factor.
    slopes = power * q**2 * np.diff(edges**2)
    return NoiseFloor(
        wavelength=float(2 * np.pi / limit),
        rms=math.sqrt(floor) * 2 * math.pi / surface.spacing,
        slope_share=float(np.sum(slopes[q > limit]) / np.sum(slopes)),
    )


def _rounded_up(length: float) -> float:
    """Round a length up to two digits."""
    digit = 10.0 ** (math.floor(math.log10(length)) - 1)
    return float(f"{math.ceil(length / digit * (1 - 1e-9)) * digit:.2g}")
