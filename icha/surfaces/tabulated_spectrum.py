"""Spectra from tables: read and write a table, and merge the spectra of several scans and profiles of one sample."""

from __future__ import annotations

import itertools
import math
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression

from icha.support.atomic_files import whole_file
from icha.support.rules import LENGTH
from icha.support.tables import check_lengths, is_number, numbers_of, read_rows
from icha.support.titles import bracketed_texts, power_of_length, problem_with_numbers
from icha.support.units import conversion_factor
from icha.surfaces.moments import radial_power_spectrum
from icha.surfaces.spectrum import IsotropicSpectrum
from icha.surfaces.surface import Surface

# Trusted wave numbers begin at this multiple of 2 pi/L, because the removal of the trend weakens longer waves. They end
# at a wavelength of this number of pixels.
_LONGEST, _PIXELS = 2.0, 4.0
# Relative error of wave numbers that a file contains with four digits. The longest wave of the cell must not be lost.
_ROUNDING = 1e-3
# Rows of a merged table per decade of the wave number.
_PER_DECADE = 10
_HEADING = (
    "wave number (rad/m), power spectral density C (m^4); the integral of C over the plane is the mean square height"
)


@dataclass(frozen=True, eq=False)
class SpectrumTable:
    """Isotropic power spectral density as a table.

    Attributes
    ----------
    wave_number : (n,) float, wave numbers q, rad/m, increasing.
    power : (n,) float, C(q), m^4, positive.
    sources : one line for each scan or profile: its trusted range, and what limits the range.
    profile_height : rms height of the waves in the rows of a table of profiles, m, before the conversion; else None.
    """

    wave_number: np.ndarray
    power: np.ndarray
    sources: tuple[str, ...] = ()
    profile_height: float | None = None

    def __post_init__(self):
        """Check the table."""
        q, power = (np.asarray(each, float) for each in (self.wave_number, self.power))
        if q.ndim != 1 or q.shape != power.shape or len(q) < 2:
            raise ValueError("table: expected at least two rows of a wave number and a power")
        if not (np.isfinite(q).all() and np.isfinite(power).all() and (q > 0).all() and (power > 0).all()):
            raise ValueError("table: expected positive, finite wave numbers and powers")
        if not (np.diff(q) > 0).all():
            raise ValueError("table: expected wave numbers in increasing order, each once")
        object.__setattr__(self, "wave_number", q)
        object.__setattr__(self, "power", power)

    @property
    def rms_height(self) -> float:
        """Root mean square height of all waves of the table, m."""
        q = np.geomspace(self.wave_number[0], self.wave_number[-1], 10_000)
        power = np.exp(np.interp(np.log(q), np.log(self.wave_number), np.log(self.power)))
        return math.sqrt(2 * math.pi * float(np.trapezoid(q**2 * power, np.log(q))))

    def in_cell(self, period: float) -> TabulatedSpectrum:
        """Return the spectrum of surfaces in a periodic cell with a side of `period`, m."""
        return TabulatedSpectrum(period, self)

    def save(self, path: str | os.PathLike) -> None:
        """Write the table as text, in SI units, with the sources as remarks."""
        remarks = "\n".join([*self.sources, _HEADING])
        with whole_file(path) as temporary:
            np.savetxt(temporary, np.column_stack([self.wave_number, self.power]), fmt="%.9e", header=remarks)


@dataclass(frozen=True, eq=False)
class TabulatedSpectrum(IsotropicSpectrum):
    """Spectrum of surfaces in a periodic cell, by interpolation of a table in double logarithmic scale.

    Waves outside the table, and waves longer than the cell, have no amplitude.

    Parameters
    ----------
    period : L, side of the periodic cell, m, in [1e-24, 1e9].
    table : the table.
    """

    period: float
    table: SpectrumTable
    plateau: float = field(default=1.0, init=False)

    def __post_init__(self):
        """Check that some waves of the table fit the cell."""
        object.__setattr__(self, "period", LENGTH.validate("period", self.period))
        if not len(self._band[0]):
            raise ValueError(
                f"period: no wave of the table fits a cell of {self.period!r} m; expected more than "
                f"{self.short_wavelength:.3g} m"
            )

    @property
    def short_wavelength(self) -> float:  # type: ignore[override]
        """Shortest wavelength of the table, m."""
        return 2 * math.pi / float(self.table.wave_number[-1])

    def _shape(self, k):
        """Compute C, m^4, for wave numbers in units of 2 pi / L."""
        q = np.asarray(k) * 2 * np.pi / self.period
        known = np.log(self.table.wave_number), np.log(self.table.power)
        with np.errstate(divide="ignore"):
            inside = np.exp(np.interp(np.log(q), *known))
        ends = self.table.wave_number[[0, -1]] * (1 - _ROUNDING, 1 + 1e-9)
        return np.where((q >= ends[0]) & (q <= ends[1]), inside, 0.0)

    @cached_property
    def rms_slope(self) -> float:
        """Rms slope of a periodic cell with this spectrum."""
        _, _, k, _ = self._band
        q = 2 * np.pi / self.period
        return math.sqrt(2 * float(np.sum(self._shape(k) * k**2)) * q**4)


class Convention(NamedTuple):
    """Convention of a table of a power spectral density.

    Attributes
    ----------
    dimension : 2 for the spectrum of a surface, 1 for the spectrum of its profiles.
    wave_factor : factor from the first column to the wave number q in rad/m.
    power_factor : factor from the second column to C, whose integral over all wave vectors (or, for profiles, all
        positive and negative wave numbers) is the mean square height.
    meaning : integral of the table that is the mean square height.
    """

    dimension: int
    wave_factor: float
    power_factor: float
    meaning: str


_TURN = 2 * math.pi
# Jacobs, Junge & Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001, compare the conventions.
CONVENTIONS = {
    "surface": Convention(2, 1.0, 1.0, "2 pi int q C dq"),
    "surface_jacobs": Convention(2, 1.0, _TURN**-2, "1/(2 pi) int q C dq"),
    "surface_frequency": Convention(2, _TURN, _TURN**-2, "2 pi int f C df"),
    "profile": Convention(1, 1.0, 1.0, "2 int C dq"),
    "profile_jacobs": Convention(1, 1.0, 1 / _TURN, "1/pi int C dq"),
    "profile_frequency": Convention(1, _TURN, 0.5 / _TURN, "int C df"),
}


def read_spectrum_table(
    path: str | os.PathLike, length_unit: float | str | None = None, convention: str | None = None
) -> SpectrumTable:
    """Read a table of wave numbers and power spectral densities from a text file with two columns.

    Lines of words above the numbers, and lines that begin with #, are a heading. Units in its titles, such as
    `q (rad/um), C (um^4)`, are those of the columns.

    Parameters
    ----------
    path : file with blanks, tabs, commas or semicolons between the columns.
    length_unit : unit of length of the table, in m or as text, such as "um": q is in rad per unit, C in the fourth
        power of the unit (third power for profiles). Default: the units of the titles, or m.
    convention : a name of `CONVENTIONS`; default: "surface".

    Raises
    ------
    ValueError
        If a line has no two positive numbers, if the numbers are not a spectrum, or if the titles contradict the
        arguments. The attribute `key` names the argument, if any.
    """
    from icha.surfaces.measured.settings import UnfitTopography

    rows, remarks = read_rows(path)
    words = list(itertools.takewhile(lambda row: not any(map(is_number, row[1])), rows))
    rows = rows[len(words) :]
    if len(rows) < 2:
        raise ValueError(f"has {len(rows)} rows; expected at least two rows of a wave number and a power")
    check_lengths(rows, 2)
    unit = float(conversion_factor(length_unit, "m")) if isinstance(length_unit, str) else length_unit or 1.0
    chosen = CONVENTIONS[convention or "surface"]
    per_length, power_unit = 1 / unit, unit ** (chosen.dimension + 2)
    if units := _units_of(words, remarks):
        text, angle, stated_per_length, stated_power, exponent = units
        if convention is None and angle != "rad":
            raise UnfitTopography(
                f"is missing, and the titles state {text} without rad, so the first column may be q or f = "
                f"q/(2 pi); expected one of {', '.join(CONVENTIONS)}",
                "convention",
            )
        excluded = "rad" if chosen.wave_factor > 1 else "cycles"
        if angle == excluded or exponent not in (None, chosen.dimension + 2):
            raise UnfitTopography(
                f"is {convention or 'missing'}, but the titles state {text}; expected another of "
                f"{', '.join(CONVENTIONS)}",
                "convention",
            )
        stated = stated_per_length, stated_power or stated_per_length ** -(chosen.dimension + 2)
        if length_unit and not np.allclose(stated, [per_length, power_unit], rtol=1e-6, atol=0):
            raise UnfitTopography(f"does not agree with the titles, which state {text}. Remove the key", "length_unit")
        per_length, power_unit = stated
    else:
        for line in (*remarks, *(" ".join(row) for _, row in words)):
            name = next(iter(_NAMED_UNIT.findall(line)), "")
            found = power_of_length(name)
            if found and found[1] == 1 and not math.isclose(found[0], unit):
                raise UnfitTopography(
                    f"is {f'{unit:g} m' if length_unit else 'missing'}, but the heading states {line[:60]!r}; expected "
                    f"{name}, with q in rad/{name}, or titles with units, such as q (rad/um), C (um^4)",
                    "length_unit",
                )
    q, power = numbers_of(rows, {0: "1", 1: "2"})
    q, power = q * per_length * chosen.wave_factor, power * power_unit * chosen.power_factor
    if not (np.diff(q) > 0).all():
        raise ValueError("has wave numbers that do not increase from row to row; expected each once, sorted")
    height = None
    if chosen.dimension == 1:
        height = math.sqrt(2 * float(np.trapezoid(power, q)))
        q, power = _isotropic_from_table(q, power)
    return SpectrumTable(q, power, tuple(line for line in remarks if line.startswith(("scan", "profiles"))), height)


_ANGLE = re.compile(r"(rad(?:ians?)?\b)|((?:cycles?|lines?)\b)")
# A line with a unit of all columns, such as `units: nm`.
_NAMED_UNIT = re.compile(r"\bunits?\b(?:[^:=]*[:=]|\s+of)\s*([^\s,;]+)", re.IGNORECASE)
_WAVELENGTH = re.compile(r"\W*(?:wave\s?length|lambda|λ)", re.IGNORECASE)


def _units_of(words, remarks) -> tuple[str, str, float, float | None, int | None] | None:
    """Return the units in the titles above the numbers; None if there are none. Raises ValueError for other titles.

    The units are: their text; "rad", "cycles" or "" for the angle in the first unit; the first unit, 1/m; the second
    unit and its power of m, which are None if the titles do not state it.
    """
    for row in [*(row for _, row in reversed(words)), *(remark.split() for remark in remarks[-1:])]:
        line = " ".join(row)
        if problem := problem_with_numbers(re.sub(r"2\s*[*·]?\s*(?:pi|π)", "", line), "Pa", "Pa"):
            raise ValueError(f"has the titles {line[:60]!r}. This {problem}")
        texts = bracketed_texts(line) or row
        if not 1 <= len(texts) <= 2 or (texts is row and None in map(power_of_length, row)):
            # Units without brackets, such as q in rad/um, C in um^4.
            tokens = re.sub(r"\b(rad|cycles)\s+", r"\1*", re.sub(r"\sin\s", " ", line)).split()
            units = {token.strip(",;:"): found for token in tokens if (found := power_of_length(token))}
            texts = list(units) if [exponent for _, exponent in units.values()][:-1] == [-1] else texts
        if not 1 <= len(texts) <= 2:
            continue
        first, *others = (power_of_length(text) for text in texts)
        if first is not None and first[1] == -1 and None not in others:
            angle = next(("rad" if rad else "cycles" for rad, _ in _ANGLE.findall(texts[0])), "")
            power, exponent = others[0] if others and others[0] else (None, None)
            return " and ".join(texts), angle, first[0], power, exponent
        if _WAVELENGTH.match(line) or (first is not None and first[1] == 1 and texts is not row):
            raise ValueError(
                f"has the titles {line[:60]!r}, so the first column looks like a wavelength; expected wave numbers, "
                "such as q (rad/um), C (um^4). Replace each wavelength by q = 2 pi/wavelength, and sort the rows by q"
            )
        if re.search(r"/|\d", "".join(texts)):
            raise ValueError(
                f"has the titles {line[:60]!r}; expected units of length in brackets, such as q (rad/um), C (um^4)"
            )
    return None


def merge_spectra(
    scans: Iterable[Surface] = (),
    profiles: Iterable[tuple[np.ndarray, np.ndarray]] = (),
    *,
    tip_radius: float | None = None,
) -> SpectrumTable:
    """Merge the spectra of scans and profiles of one isotropic sample at several magnifications.

    Each scan is trusted from half its side down to four pixels, to the noise floor of its spectrum, or to the
    wavelength below which a tip of `tip_radius` distorts the heights (SurfaceTopography), whichever is longest. The
    table contains the mean of all spectra that are trusted at a wave number.

    Parameters
    ----------
    scans : measured surfaces, such as from `icha.read_scan`, in their own units of length.
    profiles : positions x and heights z, m, of line scans with equal steps. Their spectra are converted under the
        assumption of an isotropic surface whose spectrum is locally a power law (Jacobs, Junge & Pastewka, 2017).
    tip_radius : radius of the tip of the instrument, m; None if the tip does not matter.

    Raises
    ------
    ValueError
        If nothing is given, or if no wave is trusted.
    """
    members = [(*radial_power_spectrum(surface)[:2], _trusted_range(surface, tip_radius)) for surface in scans]
    scan_count = len(members)
    members += _of_profiles([_profile(each) for each in profiles])
    if not members:
        raise ValueError("scans: expected at least one scan or profile")
    trusted = []
    for q, power, (low, high, _) in members:
        known = (q >= low) & (q <= high) & (power > 0)
        trusted.append((q[known], power[known]))
    lows, highs = ([end[k] for q, _ in trusted if len(q) for end in [(q[0], q[-1])]] for k in (0, 1))
    if not lows:
        raise ValueError("scans: no wave is between the longest wave and the noise, pixel or tip of a scan")
    count = max(2, math.ceil(_PER_DECADE * math.log10(max(highs) / min(lows))) + 1)
    grid = np.geomspace(min(lows), max(highs), count)
    logarithms = np.full((len(trusted), count), np.nan)
    for row, (q, power) in zip(logarithms, trusted, strict=True):
        if len(q) > 1:
            inside = (grid >= q[0] * (1 - 1e-9)) & (grid <= q[-1] * (1 + 1e-9))
            row[inside] = np.interp(np.log(grid[inside]), np.log(q), np.log(power))
    covered = np.isfinite(logarithms).any(axis=0)
    sources = tuple(
        f"{f'scan {k + 1}' if k < scan_count else 'profiles'}: wavelengths from {2 * math.pi / high:.4g} m to "
        f"{2 * math.pi / low:.4g} m; {reason}"
        for k, (_, _, (low, high, reason)) in enumerate(members)
    )
    return SpectrumTable(grid[covered], np.nanmean(np.exp(logarithms[:, covered]), axis=0), sources)


def _profile(pair):
    """Return positions and heights of a profile as arrays, nan where masked."""
    try:
        x, z = (np.ma.filled(np.ma.asarray(each).astype(float), np.nan) for each in pair)
    except (TypeError, ValueError):
        raise ValueError("profiles: expected a list of pairs (x, z) of positions and heights, m") from None
    return np.atleast_1d(x), np.atleast_1d(z)


def _trusted_range(surface: Surface, tip_radius: float | None) -> tuple[float, float, str]:
    """Return the smallest and the largest trusted wave number of a scan, rad/m, and what limits the largest."""
    from icha.surfaces.measured.resolution import noise_floor

    low = _LONGEST * 2 * math.pi / surface.period if surface.free else 2 * math.pi / surface.period
    shortest = {f"{_PIXELS:g} pixels": _PIXELS * surface.spacing}
    if (noise := noise_floor(surface)) is not None:
        shortest["noise floor"] = noise.wavelength
    if tip_radius is not None:
        from SurfaceTopography import Topography

        tip = {"instrument": {"parameters": {"tip_radius": {"value": tip_radius, "unit": "m"}}}}
        sides = (surface.period, surface.period)
        topography = Topography(surface.heights, sides, unit="m", periodic=not surface.free, info=tip)
        if (cutoff := topography.short_reliability_cutoff()) is not None:
            shortest["tip radius"] = float(cutoff)
    reason = max(shortest, key=shortest.__getitem__)
    return low, 2 * math.pi / shortest[reason], f"shorter waves: {reason}"


def _of_profiles(profiles):
    """Return wave numbers, isotropic spectrum and trusted range of each group of profiles with equal positions."""
    groups: dict[tuple[float, int], list[np.ndarray]] = {}
    for x, z in profiles:
        if not (np.isfinite(x).all() and np.isfinite(z).all()):
            raise ValueError(
                "profiles: a profile has missing heights; expected finite positions and heights. Interpolate short "
                "gaps, such as by numpy.interp, or use the longest part without a gap"
            )
        steps = np.diff(x)
        equal = x.ndim == 1 and x.shape == z.shape and len(x) >= 16 and steps[0] > 0
        if not equal or not np.allclose(steps, steps[0], rtol=1e-3, atol=0):
            raise ValueError("profiles: expected positions with equal, positive steps and as many heights, at least 16")
        if np.ptp(z - np.polyval(np.polyfit(x, z, 1), x)) <= 1e-12 * np.max(np.abs(z)):
            raise ValueError("profiles: a profile has heights that are all the same, apart from its tilt")
        groups.setdefault((float(f"{steps[0]:.6g}"), len(x)), []).append(_spectrum_of_profile(x, z))
    found = []
    for (step, count), spectra in groups.items():
        q, one = _in_rings(2 * np.pi / (step * count) * np.arange(1, len(spectra[0]) + 1), np.mean(spectra, axis=0))
        trusted = _LONGEST * 2 * np.pi / (step * count), 2 * np.pi / (_PIXELS * step), _ISOTROPIC
        found.append((q, isotropic_from_profile(q, _falling(one)), trusted))
    return found


def _spectrum_of_profile(x, z):
    """Return C1D, m^3, at the multiples of 2 pi/length; its integral over all q is the mean square height."""
    level = z - np.polyval(np.polyfit(x, z, 1), x)
    window = np.sin(np.pi * (np.arange(len(x)) + 0.5) / len(x)) ** 2
    modes = np.abs(np.fft.rfft(level * window, norm="forward")) ** 2 / np.mean(window**2)
    return modes[1:-1] * (x[1] - x[0]) * len(x) / (2 * np.pi)


def _in_rings(q, power):
    """Return means of wave numbers and powers in intervals with equal steps of the logarithm.

    The mean is that of power/q^s, where q^s is the best power law, so a power law remains unchanged. The first and the
    last mean stand at the ends of the table.
    """
    edges = np.geomspace(0.999 * q[0], 1.001 * q[-1], max(3, math.ceil(_PER_DECADE * math.log10(q[-1] / q[0])) + 1))
    ring = np.searchsorted(edges, q) - 1
    count = np.bincount(ring)
    exponent = np.polyfit(np.log(q), np.log(power), 1)[0]
    log_q, level = (
        np.bincount(ring, weights=each)[count > 0] / count[count > 0] for each in (np.log(q), power / q**exponent)
    )
    log_q[[0, -1]] = np.log(q[[0, -1]])
    return np.exp(log_q), level * np.exp(exponent * log_q)


_ISOTROPIC = "one-dimensional spectrum, converted for an isotropic surface"


def _falling(one):
    """Return the nearest spectrum of profiles that nowhere rises; its surface has no negative power."""
    return isotonic_regression(one, increasing=False).x


def _isotropic_from_table(q, one):
    """Convert all rows of a spectrum of profiles; convert means over intervals of q if noise makes a power negative."""
    power = isotropic_from_profile(q, one)
    if not (power > 0).all():
        q, one = _in_rings(q, one)
        power = isotropic_from_profile(q, _falling(one))
    if not (power > 0).all():
        raise ValueError(
            f"has a spectrum of profiles that does not fall from q = {q[np.argmin(power > 0)]:.3g} rad/m to its end; "
            "profiles of an isotropic surface contain all shorter waves, so their spectrum falls. Remove rows of noise"
        )
    return q, power


def isotropic_from_profile(q: Sequence[float], one: Sequence[float]) -> np.ndarray:
    """Convert the spectrum of profiles of an isotropic surface to the spectrum of the surface.

    Each row contains all waves of the surface with at least this wave number, C1D(q) = 2 int_0^inf C(sqrt(q^2 + s^2))
    ds. This is an Abel transform; its inverse is C(q) = -1/pi int_q^inf C1D'(k)/sqrt(k^2 - q^2) dk, in which
    k = q cosh(u). Between two rows, C1D is a power law. That of the last two rows continues behind the last row, so
    waves beyond the table are not added to the rows. The result, m^4, is not positive if these are not the profiles of
    an isotropic surface.

    Parameters
    ----------
    q : wave numbers, rad/m, increasing.
    one : C1D(q), m^3; its integral over positive and negative wave numbers is the mean square height.
    """
    log_q, log_one = np.log(q), np.log(one)
    exponent = -np.diff(log_one) / np.diff(log_q)
    u = np.linspace(0.0, 12.0, 2001)
    power = np.empty(len(log_q))
    with np.errstate(over="ignore", invalid="ignore"):  # for a last power law that rises
        for row, start in enumerate(log_q):
            log_k = start + np.log(np.cosh(u))
            piece = np.clip(np.searchsorted(log_q, log_k, side="right") - 1, 0, len(exponent) - 1)
            law = exponent[piece]
            integrand = law * np.exp(log_one[piece] - law * (log_k - log_q[piece]) - log_k)
            power[row] = np.trapezoid(integrand, u) / np.pi
    return power
