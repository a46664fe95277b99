"""JKR test: contact modulus and works of adhesion, with intervals, from measured points of a sphere."""

from __future__ import annotations

import math
import os
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from icha.asperity.full_contact import HIGH_PULL_OFF_BELOW, full_contact_energy_ratio
from icha.asperity.material import VAN_DER_WAALS_RANGE, Material
from icha.asperity.tabor import describe_short_range
from icha.references.indentation import axisymmetric_contact, sphere_contact, sphere_energy_release_rate
from icha.references.jkr_loop import FREE, Loop, fit_loop, range_in_contact
from icha.references.jkr_tables import LEAST_POINTS, Points, read_points, refuse_lost_order, refuse_wrong_signs
from icha.support.formatting import choose_unit, format_count, format_quantity
from icha.support.rules import INDENTATIONS, LENGTH, POSITIVE
from icha.support.usual import USUAL, IchaWarning, unusual_arguments
from icha.surfaces.shapes import Sphere

if TYPE_CHECKING:
    from icha.surfaces.surface import Surface

# Probability that an interval contains the true value.
PROBABILITY = 0.9
# Largest relative error of the force without a warning, by the curvature of the sphere and by the thickness of a layer.
_FORCE_ERROR = 0.02
# The zero of the force is shifted if the median force of points without contact exceeds its standard error by the first
# factor, and the pull-off force times the second.
_CLEAR_SHIFT, _LEAST_SHIFT = 4.0, 0.01
# Standard error of the median of normal values times the root of their number, over their median absolute deviation.
_OF_MEDIAN = 1.4826 * math.sqrt(math.pi / 2)
# Smallest work of adhesion without a warning, J/m^2.
_LEAST_WORK = 1e-3
# Largest force over the pull-off force without a warning; docs/estimates.md gives the intervals of larger loads.
_MOST_FORCE = 12.0
# Neighbouring residuals are not random if their correlation exceeds the first number, and the second number divided by
# the root of the number of points. Smaller residuals than the third number, in units of the errors, are rounded.
_CORRELATION, _BY_CHANCE, _ROUNDING = 0.3, 2.5, 1e-4


class Estimate(NamedTuple):
    """Fitted value with the ends of its 90 % interval, in SI units."""

    value: float
    low: float
    high: float

    def text(self, unit: str) -> str:
        """Return value and interval with a prefixed unit, such as `31.2 mJ/m², 90 % interval 29.0 to 33.4 mJ/m²`."""
        factor, name = choose_unit(max(map(abs, self)), unit)
        width = factor * (self.high - self.low)
        places = min(max(0, 1 - math.floor(math.log10(width))), 9) if width > 0 else 3
        value, low, high = (f"{each * factor:.{places}f}" for each in self)
        return f"{value} {name}, {100 * PROBABILITY:.0f} % interval {low} to {high} {name}"


@dataclass(frozen=True, eq=False)
class JKRTest:
    """Result of `icha.fit_jkr_test`, in SI units.

    Parameters
    ----------
    radius : radius of the lens, m.
    contact_modulus : E*, Pa.
    advancing_work : work of adhesion of loading, J/m^2.
    receding_work : work of adhesion of unloading, J/m^2; None if fewer than three points have a receding contact.
    indentation_offset : indentation of the table where the lens touches the undeformed plane, m; None if not fitted.
    measured : (n,) float by quantity, the points of the table in its order.
    fitted : (n,) float by quantity, the nearest state of the fit to each point; NaN for points that are left out.
    used_for : (n,) text: `loading`, `stuck` or `receding`, or why the point is left out.
    loop : the fitted loop.
    warnings : why the values must not be used without care.
    """

    radius: float
    contact_modulus: Estimate
    advancing_work: Estimate
    receding_work: Estimate | None
    indentation_offset: Estimate | None
    measured: dict[str, np.ndarray]
    fitted: dict[str, np.ndarray]
    used_for: np.ndarray
    loop: Loop
    warnings: tuple[str, ...] = ()

    @property
    def residuals(self) -> dict[str, np.ndarray]:
        """Measured minus fitted values by quantity; NaN for points that are left out."""
        return {name: values - self.fitted[name] for name, values in self.measured.items()}

    @property
    def counts(self) -> dict[str, int]:
        """Number of points by use, or by the reason for which they are left out."""
        return dict(Counter(self.used_for.tolist()))

    def __str__(self) -> str:
        """Return the values with their intervals, the use of the points, and the warnings."""
        values = {
            "contact modulus E*": (self.contact_modulus, "Pa"),
            "work of adhesion, advancing": (self.advancing_work, "J/m²"),
            "work of adhesion, receding": (self.receding_work, "J/m²"),
            "offset of the indentation": (self.indentation_offset, "m"),
        }
        lines = [f"{name:<28} {value.text(unit)}" for name, (value, unit) in values.items() if value]
        stiff = " and an instrument without compliance" * ("indentation" in self.measured)
        lines.append(f"intervals are those of random errors, with a correct zero of the force{stiff}")
        lines.append("points: " + ", ".join(f"{count} {use}" for use, count in self.counts.items()))
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])


def fit_jkr_test(
    table: str | os.PathLike | Mapping[str, Any],
    radius: float,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    indentation_offset: float | None = None,
    errors: Mapping[str, float] | None = None,
    interaction_range: float = VAN_DER_WAALS_RANGE,
    thickness: float = math.inf,
    roughness: Surface | None = None,
) -> JKRTest:
    """Fit contact modulus and works of adhesion to the measured points of a lens that is pressed and pulled off.

    Points of loading follow the law of Johnson, Kendall and Roberts with the advancing work of adhesion. Points of
    unloading first have a constant contact radius, and then follow the law with the receding work. The largest force is
    the turning point, unless there is a column `branch`.

    Parameters
    ----------
    table : path of a CSV file with a line of headings, or a mapping or data frame of columns. Columns: the force,
        positive in compression; the contact radius or the indentation or both; optionally the branch, loading or
        unloading. Units are those of the headings, such as `force (mN)`. Columns of a mapping without units are in SI
        units.
    radius : radius of the lens, m.
    columns : headings by quantity (`force`, `contact_radius`, `indentation`, `branch`), if ICHA does not find them.
    units : units by quantity, if the headings have none.
    indentation_offset : indentation of the table where the lens touches the undeformed plane, m; None to fit it.
    errors : standard deviation of each quantity, in SI units; only their ratios have an effect. Default: the same
        fraction of the largest contact radius, of the range of the force, and of that of the indentation in contact.
    interaction_range : range of the attraction, m, for the warning of small Tabor parameters.
    thickness : thickness of an elastic layer, m; infinite for a half-space.
    roughness : surface with the roughness of lens and sample, for the warning of rough surfaces.

    Raises
    ------
    ValueError
        If the table or an argument is wrong; the message names column and line.

    Warns
    -----
    IchaWarning
        For each of the `warnings` of the result.
    """
    radius = LENGTH.validate("radius", radius)
    if indentation_offset is not None:
        indentation_offset = INDENTATIONS.validate("indentation_offset", indentation_offset)
    if thickness != math.inf:
        LENGTH.validate("thickness", thickness)
    try:
        points = read_points(table, columns or {}, units or {})
        used_for, unloading = _choose_points(points, radius)
        measured, branch = points.values, np.array([FREE])
        while FREE in branch:  # Each fit finds points without contact, and the next one leaves them out.
            used = used_for == ""
            if 0 < np.sum(used & unloading) < LEAST_POINTS:  # Noise at the turning point is not unloading.
                used_for[used & unloading] = f"unloading (fewer than {LEAST_POINTS})"
                used, unloading = used & ~unloading, np.zeros_like(unloading)
            _refuse_few(int(np.sum(used & ~unloading)), int(np.sum(used & unloading)), "contact_radius" in measured)
            chosen = {quantity: values[used] for quantity, values in measured.items()}
            sigma = _errors(chosen, errors)
            places = [points.places[k] for k in np.flatnonzero(used)]
            options = radius, indentation_offset, PROBABILITY, places
            loops, near, branch = fit_loop(chosen, unloading[used], sigma, *options)
            used_for[used] = np.where(branch == FREE, FREE, "")
        used_for[used] = branch
        if loops[0].contact_modulus > USUAL["contact_modulus"].most:
            raise ValueError(*unusual_arguments({"contact_modulus": loops[0].contact_modulus}))
    except ValueError as error:
        name = os.fspath(table) if isinstance(table, str | os.PathLike) else "table"
        raise ValueError(f"{name}: {error}") from None
    fitted = {name: np.full(len(used), np.nan) for name in chosen}
    for name, nearest in zip(chosen, near, strict=True):
        fitted[name][used] = nearest
    modulus, advancing, receding, _, offset = map(Estimate, *loops)
    recedes = np.sum(used_for == "receding") >= LEAST_POINTS
    fits_offset = "indentation" in chosen and indentation_offset is None
    values = modulus, advancing, receding if recedes else None, offset if fits_offset else None
    test = JKRTest(radius, *values, measured, fitted, used_for, loops[0])
    test = replace(test, warnings=tuple(_warnings(test, sigma, interaction_range, thickness, roughness)))
    for reason in test.warnings:
        warnings.warn(reason, IchaWarning, stacklevel=2)
    return test


def _errors(chosen, given):
    """Return the standard deviation of each quantity: the given ones, or shares of its size in contact."""
    if not given:
        sizes = {"force": np.ptp, "contact_radius": np.max, "indentation": lambda _: range_in_contact(chosen)}
        given = {name: float(sizes[name](each)) for name, each in chosen.items()}
    elif missing := chosen.keys() - given.keys():
        raise ValueError(f"errors: no value for {min(missing)}; expected one for {', '.join(chosen)}")
    return {name: POSITIVE.validate(f"errors, {name}", given[name]) for name in chosen}


def _choose_points(points: Points, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return why each point is left out ("" if it is used), and which points belong to unloading."""
    values, places = points.values, points.places
    force, contact = values["force"], values.get("contact_radius")
    top = int(np.argmax(force))
    refuse_wrong_signs(values, places)
    if contact is not None and (large := np.flatnonzero(contact >= radius)).size:
        raise ValueError(
            f"contact radius, {places[large[0]]}: {contact[large[0]]:.4g} m is not less than the radius of the lens, "
            f"{radius:.4g} m. Check the units, and that the column contains radii, not diameters or areas"
        )
    if points.unloading is None:
        refuse_lost_order(values, places)
    unloading = np.arange(len(force)) > top if points.unloading is None else points.unloading
    if contact is not None:
        left_out = np.where(contact == 0, FREE, "").astype(object)
        used = np.flatnonzero(contact)
        if points.unloading is None and (gaps := np.flatnonzero(np.diff(used) > 1)).size:
            raise ValueError(
                f"contact radius, {places[used[gaps[0]] + 1]}: 0 between points with contact; expected 0 only before "
                "and after the contact. Remove the points without a measured radius"
            )
    else:
        left_out = np.full(len(force), "", object)  # The fit finds points without contact.
    if constant := [quantity for quantity, column in values.items() if not np.ptp(column[left_out == ""]) > 0]:
        raise ValueError(f"column of {constant[0]}: all values are the same; expected measured values")
    return left_out, unloading


def _refuse_few(loading, unloading, has_radius):
    """Raise ValueError if the numbers of points in contact are too small for the unknowns of a fit."""
    unknowns = 3 - has_radius + 2 * bool(unloading)
    if loading < LEAST_POINTS or loading + unloading <= unknowns:
        raise ValueError(
            f"has {format_count(loading, 'point')} of loading and {unloading} of unloading with contact; expected at "
            f"least {LEAST_POINTS} of loading and {unknowns + 1} together, in the order of the test or with a column "
            "`branch`"
        )


def force_increase_by_layer(ratio: float) -> float:
    """Return the force on a sphere on a bonded, incompressible layer over that on a half-space, minus 1.

    Both forces are for the same indentation, and `ratio` is the contact radius over the thickness of the layer. The
    first order in this ratio is that of E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798. The second order is
    fitted to boundary elements without adhesion; up to a ratio of 2, the fit is within 6 %.
    """
    return ratio * (1.133 + 1.2 * ratio)


def _warnings(test, errors, interaction_range, thickness, roughness) -> Iterator[str]:
    """Yield why the result must not be used without care, with the size of the error."""
    modulus, advancing = test.contact_modulus.value, test.advancing_work.value
    unloading, largest = np.isin(test.used_for, ["stuck", "receding"]), test.loop.stuck_radius
    work = max(advancing, test.receding_work.value if test.receding_work else 0.0)
    works = {"advancing": test.advancing_work, "receding": test.receding_work}
    seen = {name: each.value for name, each in works.items() if each and each.low}
    fitted = {"radius": test.radius, "contact_modulus": modulus} | ({"surface_energy": work} if seen else {})
    yield from unusual_arguments(fitted)
    for name, branch in (("advancing", "loading"), ("receding", "unloading")):
        if works[name] and name not in seen:
            yield f"points of {branch} show no adhesion: the interval of the {name} work of adhesion begins at 0"
    if seen and work < _LEAST_WORK:
        yield (
            f"the work of adhesion, {1e3 * work:.2g} mJ/m², is less than {1e3 * _LEAST_WORK:g} mJ/m²; expected 10 to "
            "200 mJ/m² between smooth surfaces. Check the units of the radius and of the columns"
        )
    if not unloading.any():
        yield (
            f"fewer than {LEAST_POINTS} points of unloading have contact, so there is no receding work of adhesion; "
            "measure up to pull-off"
        )
    elif not test.receding_work:
        last = np.flatnonzero(unloading)[np.argmin(test.measured["force"][unloading])]
        rate = sphere_energy_release_rate(test.fitted["force"][last], largest, test.radius, modulus)
        yield (
            "the contact is stuck at nearly all points of unloading, so there is no receding work of adhesion; it is "
            f"at least about {1e3 * rate:.3g} mJ/m². Measure up to pull-off, or load less"
        )
    elif test.receding_work.high < test.advancing_work.low:
        yield (
            "the receding work of adhesion is less than the advancing one, which no law of adhesion explains; check "
            "that the points are in the order of the test, not in the reverse order"
        )
    force, pull_off = float(test.measured["force"].max()), 1.5 * math.pi * test.radius * work
    if seen and force > _MOST_FORCE * pull_off:
        yield (
            f"the largest force is {force / pull_off:.3g} times the pull-off force: noise "
            "hides the adhesion, and may look like adhesion; smaller loads give narrower intervals"
        )
    free = test.measured["force"][test.used_for == FREE]
    if len(free) >= LEAST_POINTS:
        shift = np.median(free)
        error = _OF_MEDIAN * np.median(np.abs(free - shift)) / math.sqrt(len(free))
        if abs(shift) > max(_CLEAR_SHIFT * error, _LEAST_SHIFT * pull_off):
            shown = format_quantity(float(f"{shift:.3g}"), "N")
            yield (
                f"the median force of points without contact is {shown}, so the zero of the force is shifted, and the "
                "works of adhesion are wrong: subtract this force from all forces"
            )
    size = min(largest, 0.99 * test.radius)
    exact = axisymmetric_contact(size, Sphere(test.radius).slope, modulus).force
    if (error := float(exact / sphere_contact(size, test.radius, modulus).force - 1)) > _FORCE_ERROR:
        yield (
            f"the contact radius is up to {largest / test.radius:.2g} times the radius of the lens: JKR is for a "
            f"paraboloid, and on a sphere the force without adhesion is {100 * error:.1f} % larger; use smaller loads"
        )
    ratio = largest / thickness
    if (error := force_increase_by_layer(ratio)) > _FORCE_ERROR:
        yield (
            f"the contact radius is up to {ratio:.2g} times the thickness: on a bonded, incompressible layer, the "
            f"force at an indentation is about {100 * error:.0f} % larger than on a half-space; use thicker samples or "
            "smaller loads"
        )
    for name, energy in seen.items():
        tabor = Material(modulus, energy, interaction_range).tabor_parameter(test.radius)
        if short := describe_short_range(float(tabor)):
            yield f"{name} work: {short}"
    if seen:
        energy = next(iter(seen.values()))
        bending = full_contact_energy_ratio(roughness.full_contact_energy, modulus, energy) if roughness else 0.0
        if bending > 1 / HIGH_PULL_OFF_BELOW:
            yield (
                f"U_full/Δγ = {bending:.2g}: full contact with the roughness needs {bending:.2g} times the fitted work "
                "of adhesion, which is an apparent one, below that of smooth surfaces"
            )
    residual = np.stack([test.residuals[name] / error for name, error in errors.items()])
    residual = residual[:, (np.abs(residual) > _ROUNDING).any(axis=0)]
    correlation = np.sum(residual[:, 1:] * residual[:, :-1]) / max(np.sum(residual**2), np.finfo(float).tiny)
    if correlation > max(_CORRELATION, _BY_CHANCE / math.sqrt(max(residual.shape[1], 1))):
        yield (
            f"residuals of neighbouring points are correlated ({correlation:.2f}), so the law does not describe the "
            "points within their noise, and the intervals are too narrow; look at the residuals in the figure"
        )
