"""A square height map of the rigid rough surface that faces the elastic half-space.

Heights are in metres and positive towards the elastic body. The first axis of an array of heights is y, the second is
x. Node (iy, ix) lies at (x, y) = (ix, iy) * spacing.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft

from icha.support.formatting import format_quantity, html_table
from icha.support.parallel import blocks, on_cores
from icha.support.rules import LENGTH, SLOPE, FloatRange, IntegerRange
from icha.support.usual import IchaWarning, unusual_arguments
from icha.surfaces.moments import FullContact

if TYPE_CHECKING:
    from icha.surfaces.shapes import Shape

# Values of `boundary`: one cell of a periodic surface, or a single square on a half-space.
PERIODIC, FREE = "periodic", "free"

# Bounds of the range of heights divided by the period.
_STEEPNESS = FloatRange(least=1e-24, most=1e9)
# Rows or columns that are transformed at a time.
_LINES = 64
# Largest number of lines inside a cell whose steps `edges_fit` compares with the step between cells.
_COMPARED_LINES = 256
# Edges fit if the misfit between cells is at most this value times the largest misfit inside a cell. The misfit is the
# rms, along a line, of a step minus the mean of the steps beside it. Ratios are up to 1.3 on periodic surfaces, up to
# 2.4 on white noise of 8 x 8 nodes, and at least 3.2 on halves of periodic surfaces with 4 nodes per shortest wave.
_MISFIT = 3.0
# Edges also fit if the step between cells is at most this value times the largest step inside a cell; steps are rms
# along a line. The ratio is 1.03 for a symmetric dome, whose opposite edges meet without a step.
_STEP = 1.1
MISFIT_OF_EDGES = (
    f"boundary: {PERIODIC!r}, but there is a step at the edges: heights differ much more between opposite edges than "
    f"between neighbouring nodes. Use boundary={FREE!r}, or icha.read_scan for a measured surface"
)


# Distance of the apex of a shape from the middle of a square of n x n cells, along x and y, in cells.
_OFF_THE_NODES = 0.29
# Least unit of length of a surface with a shape, divided by the side of the shape: the unit of a flat punch.
_LEAST_UNIT = 1e-3


@dataclass(frozen=True, eq=False)
class Surface:
    """A rough surface of zero mean height: one cell of a periodic surface, or a single square, which may have a shape.

    Statistics, spectrum and energy of full contact are those of the roughness, without the shape.

    Parameters
    ----------
    heights : (n, n) array, metres: the roughness. The mean height is removed; the array is copied and made read-only.
    period : side of the square, metres, in [1e-24, 1e9]; a periodic surface repeats after this length.
    boundary : "periodic" (in both directions), or "free" (a single square; the half-space is larger than the square).
    shape : smooth shape that carries the roughness, such as `icha.Sphere`, with its apex in the middle of the square;
        only with the boundary "free". The roughness may then be zero.
    short_wavelength : shortest wavelength of the roughness, m, in [1e-24, 1e9]; None if it is unknown.

    Warns
    -----
    IchaWarning
        If the period or the rms slope is unusual, mostly because of a wrong unit, or if heights of a periodic surface
        have a step at the edges.

    Raises
    ------
    ValueError
        If the heights are not a square array of at least 8 x 8 finite numbers, or are all the same although there is no
        shape. Also if the range of heights divided by the period is not in [1e-24, 1e9], or if the period, the boundary
        or the shape is invalid.
    """

    heights: np.ndarray
    period: float
    boundary: str = PERIODIC
    shape: Shape | None = None
    short_wavelength: float | None = None

    def __post_init__(self):
        """Check the arguments, remove the mean height, and make the heights read-only."""
        try:
            given = np.asarray(self.heights)
            if given.dtype.kind not in "fiu":
                raise TypeError(f"they are of type {given.dtype.name}")
            if np.ma.is_masked(self.heights):
                raise ValueError("some are masked; fill or crop them first")
            heights = np.array(given, dtype=np.float64, order="C")
        except (TypeError, ValueError) as error:
            raise ValueError(f"heights: must be an array of real numbers in metres ({error})") from None
        if heights.ndim != 2 or heights.shape[0] != heights.shape[1] or heights.shape[0] < 8:
            raise ValueError(f"heights: an array of shape {heights.shape}; expected a square of at least 8 x 8 heights")
        if bad := int(np.count_nonzero(~np.isfinite(heights))):
            raise ValueError(f"heights: {bad} of {heights.size} heights that are not finite; expected numbers")
        if heights.max() == heights.min() and self.shape is None:
            raise ValueError("heights: heights that are all the same; expected a rough surface")
        object.__setattr__(self, "period", LENGTH.validate("period", self.period))
        if self.short_wavelength is not None:
            wavelength = LENGTH.validate("short_wavelength", self.short_wavelength)
            object.__setattr__(self, "short_wavelength", wavelength)
        if not self.smooth:
            with np.errstate(over="ignore"):
                _STEEPNESS.validate("heights: their range over the period", np.ptp(heights) / self.period)
        heights -= heights.mean()
        heights.flags.writeable = False
        object.__setattr__(self, "heights", heights)
        if self.boundary not in (PERIODIC, FREE):
            raise ValueError(f"boundary: {self.boundary!r} must be one of {PERIODIC}, {FREE}")
        if self.shape and not self.free:
            raise ValueError(f"boundary: {self.boundary!r}; a surface with a shape needs {FREE!r}")
        if self.shape and (not np.isfinite(self.profile).any() or np.isnan(self.profile).any()):
            raise ValueError(f"shape: {self.shape} does not fit a square of side {self.period:g} m")
        # Only surfaces that users make cause warnings. Campaigns report the same problems of other surfaces.
        if sys._getframe(2).f_globals.get("__name__", "").startswith(("icha.", "dataclasses")):
            return
        if not self.free and not edges_fit(heights):
            warnings.warn(MISFIT_OF_EDGES, IchaWarning, stacklevel=3)
        for text in unusual_arguments({"period": self.period} | ({} if self.smooth else {"rms_slope": self.rms_slope})):
            warnings.warn(text, IchaWarning, stacklevel=3)

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        rows = {
            "nodes": f"{self.grid} × {self.grid}",
            "side": format_quantity(self.period, "m"),
            "boundary": self.boundary,
            "rms height": format_quantity(self.rms_height, "m"),
            "rms slope": f"{self.rms_slope:.4g}",
        }
        return html_table("Surface", rows | ({"shape": str(self.shape)} if self.shape else {}))

    @property
    def grid(self) -> int:
        """Number of nodes along a side."""
        return self.heights.shape[0]

    @property
    def spacing(self) -> float:
        """Distance between neighbouring nodes, metres."""
        return self.period / self.grid

    @property
    def free(self) -> bool:
        """True if the surface is a single square."""
        return self.boundary == FREE

    @property
    def smooth(self) -> bool:
        """True if there is no roughness, but only a shape."""
        return self.shape is not None and not self.heights.any()

    @cached_property
    def profile(self) -> np.ndarray:
        """Heights of shape and roughness together, (n, n), m; -inf where a shape has no surface.

        Without roughness, the apex of the shape has the height 0.
        """
        if self.shape is None:
            return self.heights
        profile = self.heights + self._form
        profile.flags.writeable = False
        return profile

    @property
    def summit_radius(self) -> float:
        """Typical radius of curvature of a summit, m: 1/`rms_curvature`; without roughness, that of the shape."""
        if self.shape and self.smooth:
            return self.shape.sphere_radius or self.period
        return 1 / self.rms_curvature

    @property
    def apex(self) -> float:
        """Coordinate x = y of the apex of the shape, m, from the edge of the square.

        It lies a little beside the middle, so that the rows of cells at the edge of contact close one after another.
        """
        return 0.5 * self.period + _OFF_THE_NODES * self.spacing

    @cached_property
    def _form(self) -> np.ndarray:
        """Heights of the shape alone, (n, n), m."""
        if self.shape is None:
            return np.zeros_like(self.heights)
        x = (np.arange(self.grid) + 0.5) * self.spacing - self.apex
        return self.shape.heights(x, x[:, None])

    @cached_property
    def _units(self) -> tuple[float, float]:
        """Units of length (m) and of slope: rms height and slope; with a shape, the same for every roughness."""
        if self.shape is None:
            return self.rms_height, self.rms_slope
        form = self._form[np.isfinite(self._form)]
        side = self.spacing * math.sqrt(form.size)
        height = max(float(np.std(form)), _LEAST_UNIT * side)
        return height, height / side

    @property
    def unit_height(self) -> float:
        """Unit of separations and gaps, m: the rms height; with a shape, the rms height of the shape."""
        return self._units[0]

    @property
    def unit_slope(self) -> float:
        """Unit of slopes: the rms slope; with a shape, `unit_height` divided by the side of the square."""
        return self._units[1]

    def by_wave_vector(self, function) -> list:
        """Call `function(k2, count, power)` for blocks of all wave vectors, and return the list of the results.

        Wave vectors are 2 pi/L (kx, ky) with integers kx and ky. k2 is the array of kx^2 + ky^2. power is the array of
        |h_q|^2 in m^2, with 0 for k2 = 0. count is 2 in columns where power is the sum over two opposite wave vectors,
        else 1. A free square is treated as one cell of a periodic surface.
        """
        n = self.grid
        half = np.empty((n, n // 2 + 1), dtype=complex)

        def along_x(rows):
            half[rows] = scipy.fft.rfft(self.heights[rows], axis=1, norm="forward", workers=1)

        ky2 = scipy.fft.fftfreq(n, 1 / n) ** 2

        def along_y(columns):
            modes = scipy.fft.fft(half[:, columns], axis=0, norm="forward", workers=1)
            power = modes.real**2 + modes.imag**2
            # Only the first column and, on even grids, the last column contain both q and -q of a wave.
            kx = np.arange(columns.start, columns.stop)
            count = np.where((kx > 0) & (2 * kx < n), 2.0, 1.0)
            power *= count
            if columns.start == 0:
                power[0, 0] = 0.0
            return function(ky2[:, None] + kx**2, count, power)

        on_cores(along_x, blocks(n, _LINES))
        return on_cores(along_y, blocks(n // 2 + 1, _LINES))

    @cached_property
    def spectral_moments(self) -> tuple[float, float, float]:
        """Sums of |h_q|^2, q^2 |h_q|^2 and q^4 |h_q|^2 over all wave vectors, in m^2, 1 and m^-2.

        The sums equal the mean squares of height, of slope |grad h| and of the Laplacian. A free square has no
        spectrum; a quintic spline gives the mean squares at the nodes.
        """
        if self.free:
            return _mean_squares(self.heights, self.spacing)

        sums = self.by_wave_vector(lambda k2, _, power: [np.sum(power), np.sum(power * k2), np.sum(power * k2**2)])
        moments = np.sum(sums, axis=0)
        q2 = (2 * np.pi / self.period) ** 2
        return float(moments[0]), float(moments[1] * q2), float(moments[2] * q2**2)

    @property
    def rms_height(self) -> float:
        """Root mean square height, metres."""
        return self.spectral_moments[0] ** 0.5

    @property
    def rms_slope(self) -> float:
        """Root mean square of |grad h|, computed from the spectral moments, not by finite differences."""
        return self.spectral_moments[1] ** 0.5

    @property
    def rms_curvature(self) -> float:
        """Root mean square curvature of profiles in 1/m: sqrt(3/8 sum q^4 |h_q|^2) for an isotropic surface.

        The Contact Mechanics Challenge uses the inverse curvature, R_c = 60.1 nm, as the radius in the Tabor parameter.
        """
        return (3 / 8 * self.spectral_moments[2]) ** 0.5

    def full_contact(self, softness: Callable[[np.ndarray], np.ndarray] | None = None) -> FullContact:
        """Return energy and largest tension of full contact at zero load, with `softness` of `full_contact_pressure`.

        Half the work of the pressure on the heights is the elastic energy. A free square counts as a quarter of a
        periodic surface that consists of the square and its mirror images. This surface has no steps at the edges.
        """
        pressure = full_contact_pressure(self.heights, self.period, free=self.free, softness=softness)
        # The zero avoids -0.0 for a smooth surface.
        return FullContact(float(np.vdot(self.heights, pressure)) / (2 * pressure.size), 0.0 - float(pressure.min()))

    @property
    def full_contact_energy(self) -> float:
        """Elastic energy of full contact with a half-space per area, divided by E*: 1/4 sum q |h_q|^2, m."""
        return self.full_contact().energy

    def scaled_to_rms_slope(self, rms_slope: float) -> Surface:
        """Return the surface with heights scaled to the rms slope `rms_slope`; a smooth surface is not scaled."""
        if self.smooth:
            return self
        rms_slope = SLOPE.validate("rms_slope", rms_slope)
        factor = rms_slope / self.rms_slope
        scaled = replace(self, heights=self.heights * factor)
        # `cached_property` keeps its values in `vars`.
        vars(scaled)["spectral_moments"] = tuple(moment * factor**2 for moment in self.spectral_moments)
        return scaled

    def refined(self, factor: int) -> Surface:
        """Interpolate the heights by Fourier series on a grid `factor` times as fine; old nodes keep their heights.

        Raises ValueError if the factor is not an integer of at least 1, or the surface is a free square.
        """
        if self.free:
            raise ValueError(
                f"boundary: {FREE!r}; a trigonometric interpolant needs a surface of boundary {PERIODIC!r}"
            )
        if IntegerRange(1).validate("factor", factor) == 1:
            return self
        # Slow to import, and rarely needed.
        from scipy.signal import resample

        heights = self.heights
        for axis in (0, 1):
            heights = resample(heights, factor * self.grid, axis=axis)
        return Surface(heights, self.period, short_wavelength=self.short_wavelength)


def full_contact_pressure(
    heights: np.ndarray,
    period: float,
    *,
    free: bool = False,
    softness: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Return the pressure in full contact at zero load, divided by E*: (n, n) array with p(q) = q h(q)/2 for waves q.

    Parameters
    ----------
    heights : (n, n), m.
    period : side of the square, m.
    free : True if mirror images continue the heights at the edges; False for a periodic surface.
    softness : function of q (1/m) that returns the compliance divided by that of a half-space, such as `Layer.factor`;
        None for a half-space.
    """
    n = len(heights)

    def stiffness(ky, kx, unit):
        q = np.hypot(ky[:, None], kx)
        q *= unit
        if softness:
            q[0, 0] = unit
            q /= softness(q)
        q[0, 0] = 0.0
        q /= 2
        return q

    if free:
        modes, k = scipy.fft.dctn(heights, workers=1), np.arange(n)
        modes *= stiffness(k, k, np.pi / period)
        return scipy.fft.idctn(modes, workers=1, overwrite_x=True)
    modes, each = scipy.fft.rfft2(heights, workers=1), np.fft.fftfreq(n, 1 / n)
    modes *= stiffness(each, each[: modes.shape[1]], 2 * np.pi / period)
    return scipy.fft.irfft2(modes, s=heights.shape, workers=1, overwrite_x=True)


def edges_fit(heights: np.ndarray) -> bool:
    """Return whether the heights at opposite edges meet without a step when the surface repeats."""
    n = len(heights)
    compared = np.unique(np.linspace(1, n - 3, min(n, _COMPARED_LINES)).astype(int))
    for lines in (heights, heights.T):
        before, first, second, after = (lines[(np.append(compared, n - 1) + shift) % n] for shift in (-1, 0, 1, 2))
        misfit = np.sqrt(np.mean((1.5 * (second - first) - 0.5 * (after - before)) ** 2, axis=1))
        step = np.sqrt(np.mean((second - first) ** 2, axis=1))
        if step[-1] > _STEP * np.max(step[:-1]) and misfit[-1] > _MISFIT * np.max(misfit[:-1]) + 1e-9 * np.ptp(heights):
            return False
    return True


def _mean_squares(heights, spacing):
    """Compute the mean squares of height, slope and Laplacian at the nodes, with quintic splines along both axes."""
    # Slow to import, and rarely needed.
    from scipy.interpolate import make_interp_spline

    n = len(heights)
    nodes = np.arange(n) * spacing
    laplacian = np.empty_like(heights)

    def along_x(rows):
        spline = make_interp_spline(nodes, heights[rows], k=5, axis=1)
        laplacian[rows] = spline(nodes, 2)
        return np.sum(spline(nodes, 1) ** 2)

    def along_y(columns):
        spline = make_interp_spline(nodes, heights[:, columns], k=5, axis=0)
        laplacian[:, columns] += spline(nodes, 2)
        return np.sum(spline(nodes, 1) ** 2)

    slope2 = sum(sum(on_cores(along, blocks(n, _LINES))) for along in (along_x, along_y))
    return float(np.mean(heights**2)), float(slope2 / n**2), float(np.mean(laplacian**2))
