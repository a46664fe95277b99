"""JKR test: contact modulus and works of adhesion, with intervals, from measured points of a sphere."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from icha.asperity.full_contact import HIGH_PULL_OFF_BELOW, full_contact_energy_ratio
from icha.asperity.material import VAN_DER_WAALS_RANGE, Material
from icha.asperity.tabor import describe_short_range
from icha.references.indentation import ContactState, axisymmetric_contact, sphere_contact, sphere_energy_release_rate
from icha.references.jkr_loop import LEAST_POINTS, LOADING, RECEDING, STUCK, Loop, fit_loop
from icha.references.jkr_tables import Points, read_points
from icha.support.formatting import choose_unit, format_count
from icha.support.rules import INDENTATIONS, LENGTH, POSITIVE, SEED
from icha.support.usual import IchaWarning, unusual_arguments
from icha.surfaces.shapes import Sphere

if TYPE_CHECKING:
    from icha.surfaces.surface import Surface

# Probability that an interval contains the true value, and number of fits for the intervals.
PROBABILITY, _RESAMPLES = 0.9, 500
# Reasons for which points are left out.
BEFORE, AFTER, WITHOUT = "before contact", "after pull-off", "without contact"
# Under displacement control, a sphere of JKR jumps off at 5/9 of the pull-off force. Points with less tension, after
# the point of the largest tension, are without contact.
_JUMP_OFF_SHARE = 0.5
# The largest tension of loading shows the jump-in if it exceeds the noise by this factor.
_CLEAR_TENSION = 4.0
# Largest relative error of the force without a warning, by the curvature of the sphere and by the thickness of a layer.
_FORCE_ERROR = 0.02
# Largest force over the pull-off force without a warning. docs/estimates.md gives the share of intervals that contain
# the truth at 10 and 20 times the pull-off force.
_MOST_FORCE = 12.0
# Neighbouring residuals are not random if their correlation exceeds the first number, and the second number divided by
# the root of the number of points.
_CORRELATION, _BY_CHANCE = 0.3, 2.5
# Residuals below this fraction of the errors are due to rounding.
_ROUNDING = 1e-4


class Estimate(NamedTuple):
    """Fitted value with the ends of its 90 % interval, in SI units."""

    value: float
    low: float
    high: float

    def text(self, unit: str) -> str:
        """Return value and interval with a prefixed unit, such as `31 (29 to 33) mJ/m²`."""
        factor, name = choose_unit(max(map(abs, self)), unit)
        value, low, high = (f"{each * factor:.3g}" for each in self)
        return f"{value} {name}, {PROBABILITY:.0%} interval {low} to {high} {name}".replace("%", " %")


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
    warnings : why the values must not be used without care.
    loop : the fitted loop.
    """

    radius: float
    contact_modulus: Estimate
    advancing_work: Estimate
    receding_work: Estimate | None
    indentation_offset: Estimate | None
    measured: dict[str, np.ndarray]
    fitted: dict[str, np.ndarray]
    used_for: np.ndarray
    warnings: tuple[str, ...]
    loop: Loop

    @property
    def residuals(self) -> dict[str, np.ndarray]:
        """Measured minus fitted values by quantity; NaN for points that are left out."""
        return {name: values - self.fitted[name] for name, values in self.measured.items()}

    @property
    def counts(self) -> dict[str, int]:
        """Number of points by use, or by the reason for which they are left out."""
        return {use: int(np.sum(self.used_for == use)) for use in dict.fromkeys(self.used_for.tolist())}

    def curves(self) -> dict[str, ContactState]:
        """Return the fitted states by branch, from the smallest to the largest contact and back."""
        branches = {"loading": LOADING}
        if np.isin(self.used_for, _UNLOADING).any():
            branches["stuck"] = STUCK
        if self.receding_work:
            branches["receding"] = RECEDING
        return {
            name: self.loop.state(self.radius, np.array(branch), *self.loop.trace(self.radius, branch))
            for name, branch in branches.items()
        }

    def __str__(self) -> str:
        """Return the values with their intervals, the use of the points, and the warnings."""
        values = {
            "contact modulus E*": (self.contact_modulus, "Pa"),
            "work of adhesion, advancing": (self.advancing_work, "J/m²"),
            "work of adhesion, receding": (self.receding_work, "J/m²"),
            "offset of the indentation": (self.indentation_offset, "m"),
        }
        lines = [f"{name:<28} {value.text(unit)}" for name, (value, unit) in values.items() if value]
        lines.append("points: " + ", ".join(f"{count} {use}" for use, count in self.counts.items()))
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])


_USES = np.array(["loading", "stuck", "receding"], dtype=object)
_UNLOADING = ["stuck", "receding"]


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
    seed: int = 0,
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
        fraction of the range of each quantity.
    interaction_range : range of the attraction, m, for the warning of small Tabor parameters.
    thickness : thickness of an elastic layer, m; infinite for a half-space.
    roughness : surface with the roughness of lens and sample, for the warning of rough surfaces.
    seed : seed of the resamples that give the intervals.

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
    seed = SEED.validate("seed", seed)
    if indentation_offset is not None:
        indentation_offset = INDENTATIONS.validate("indentation_offset", indentation_offset)
    if thickness != math.inf:
        LENGTH.validate("thickness", thickness)
    name = f"{os.fspath(table)}: " if isinstance(table, str | os.PathLike) else "table: "
    try:
        points = read_points(table, columns or {}, units or {})
        used_for, unloading = _choose_points(points, radius)
    except ValueError as error:
        raise ValueError(f"{name}{error}") from None
    used = np.array([not use for use in used_for])
    chosen = {quantity: values[used] for quantity, values in points.values.items()}
    fit_offset = indentation_offset is None and "indentation" in chosen
    if indentation_offset is not None and "indentation" in chosen:
        chosen["indentation"] = chosen["indentation"] - indentation_offset
    ranges = {q: float(np.max(v) if q == "contact_radius" else np.ptp(v)) for q, v in chosen.items()}
    if missing := [quantity for quantity in chosen if errors and quantity not in errors]:
        raise ValueError(f"errors: no value for {missing[0]}; expected one for {', '.join(chosen)}")
    deviations = {q: POSITIVE.validate(f"errors, {q}", errors[q]) for q in chosen} if errors else ranges
    fit = fit_loop(chosen, unloading[used], deviations, radius, fit_offset=fit_offset, resamples=_RESAMPLES, seed=seed)
    used_for[used] = _USES[fit.branch]
    loop = fit.loop if indentation_offset is None else fit.loop._replace(offset=indentation_offset)
    ends = (1 - PROBABILITY) / 2, (1 + PROBABILITY) / 2
    estimates = {
        name: Estimate(value, *(float(end) for end in np.quantile(drawn, ends)))
        for name, value, drawn in zip(Loop._fields, fit.loop, fit.resampled, strict=True)
    }
    fitted = {quantity: np.full(len(used), np.nan) for quantity in points.values}
    for quantity, values in fitted.items():
        values[used] = getattr(fit.states, quantity)
    if indentation_offset is not None and "indentation" in fitted:
        fitted["indentation"] += indentation_offset
    found = JKRTest(
        radius,
        estimates["contact_modulus"],
        estimates["advancing_work"],
        estimates["receding_work"] if np.sum(fit.branch == RECEDING) >= LEAST_POINTS else None,
        estimates["offset"] if fit_offset else None,
        points.values,
        fitted,
        used_for,
        (),
        loop,
    )
    reasons = tuple(_warnings(found, fit.states, ranges, interaction_range, thickness, roughness))
    for reason in reasons:
        warnings.warn(reason, IchaWarning, stacklevel=2)
    object.__setattr__(found, "warnings", reasons)
    return found


def _choose_points(points: Points, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return why each point is left out ("" if it is used), and which points belong to unloading.

    Raises
    ------
    ValueError
        If the points are not those of a JKR test.
    """
    values, places = points.values, points.places
    force, contact = values["force"], values.get("contact_radius")
    top, bottom = int(np.argmax(force)), int(np.argmin(force))
    size = contact if contact is not None else values["indentation"]
    if not force[top] > 0 or (size[bottom] > size[top] and force[top] < -force[bottom]):
        reason = (
            "no force is positive"
            if not force[top] > 0
            else f"the contact is larger at {places[bottom]} than at {places[top]}, the largest force"
        )
        raise ValueError(f"{reason}; expected forces that are positive in compression. Change the sign of the forces")
    if contact is not None and (large := np.flatnonzero(contact >= radius)).size:
        raise ValueError(
            f"contact radius, {places[large[0]]}: {contact[large[0]]:.4g} m is not less than the radius of the lens, "
            f"{radius:.4g} m. Check the units, and that the column contains radii, not diameters or areas"
        )
    order = np.arange(len(force))
    unloading = order > top if points.unloading is None else points.unloading
    left_out = np.full(len(force), "", dtype=object)
    if contact is not None:
        left_out[contact == 0] = WITHOUT
    else:
        left_out[:] = np.where(_without_contact(force, unloading), np.where(unloading, AFTER, BEFORE), "")
    kept = left_out == ""
    if (count := int(np.sum(kept & ~unloading))) < LEAST_POINTS:
        raise ValueError(
            f"has {format_count(count, 'point')} of loading with contact; expected at least {LEAST_POINTS}, in the "
            "order of the test or with a column `branch`"
        )
    unknowns = 2 + (contact is None) + 2 * bool((kept & unloading).any())
    if kept.sum() <= unknowns:
        raise ValueError(f"has {kept.sum()} points with contact; expected more than {unknowns}, the number of unknowns")
    for quantity, column in values.items():
        if not np.ptp(column[kept]) > 0:
            raise ValueError(f"column of {quantity}: all values are the same; expected measured values")
    return left_out, unloading


def _without_contact(force, unloading):
    """Return which points are before the contact forms or after it breaks, for tests without contact radii."""
    outside = np.zeros(len(force), bool)
    loading, after = np.flatnonzero(~unloading), np.flatnonzero(unloading)
    if loading.size and force[loading].min() <= 0:
        # Contact begins with the largest tension of loading; or, if noise hides it, after the last force of 0.
        lowest, last = int(np.argmin(force[loading])), int(np.flatnonzero(force[loading] <= 0)[-1])
        noise = np.median(np.abs(np.diff(force[loading[: last + 1]]))) / 0.95 if last else 0.0
        clear = -force[loading[lowest]] > _CLEAR_TENSION * noise
        outside[loading[: lowest if clear else last + 1]] = lowest > 1
    if after.size and (largest := -force[after].min()) > 0:
        lowest = int(np.argmin(force[after]))
        off = np.flatnonzero(-force[after[lowest:]] < _JUMP_OFF_SHARE * largest)
        if off.size:
            outside[after[lowest + off[0] :]] = True
    return outside


def _warnings(test, states, ranges, interaction_range, thickness, roughness) -> Iterator[str]:
    """Yield why the result must not be used without care."""
    modulus, advancing = test.contact_modulus.value, test.advancing_work.value
    receding = test.receding_work.value if test.receding_work else None
    works = {"surface_energy": max(advancing, receding or 0.0)}
    yield from unusual_arguments({"radius": test.radius, "contact_modulus": modulus} | works)
    unloading = np.isin(test.used_for, _UNLOADING)
    if not unloading.any():
        yield "there are no points of unloading with contact, so there is no receding work of adhesion"
    elif receding is None:
        stuck = np.flatnonzero(unloading)[np.argmin(test.measured["force"][unloading])]
        rate = sphere_energy_release_rate(test.fitted["force"][stuck], test.loop.stuck_radius, test.radius, modulus)
        yield (
            "the contact is stuck at nearly all points of unloading, so there is no receding work of adhesion; it is "
            f"at least about {1e3 * rate:.3g} mJ/m². Measure up to pull-off, or load less"
        )
    elif receding < advancing:
        yield "the receding work of adhesion is less than the advancing one, which no law of adhesion explains"
    if advancing * 1.5 * math.pi * test.radius < 1e-3 * ranges["force"]:
        yield "Hertz's law fits the points of loading: their work of adhesion is too small for these forces"
    pull_off = 1.5 * math.pi * test.radius * works["surface_energy"]
    if (force := float(test.measured["force"].max())) > _MOST_FORCE * pull_off > 0:
        yield (
            f"the largest force is {force / pull_off:.0f} times the pull-off force: noise hides the adhesion, and the "
            "intervals are too narrow; use smaller loads"
        )
    if not unloading.any() and test.indentation_offset:
        yield "without unloading, the offset of the indentation is hardly distinguishable from adhesion"
    yield from _limits_of_jkr(test, float(np.max(states.contact_radius)), interaction_range, thickness, roughness)
    if (correlation := _largest_correlation(test, ranges)) > 0:
        yield (
            f"residuals of neighbouring points are correlated ({correlation:.2f}), so the law does not describe the "
            "points within their noise, and the intervals are too narrow; look at the residuals in the figure"
        )


def _limits_of_jkr(test, largest, interaction_range, thickness, roughness):
    """Yield the limits of the law of JKR that a test exceeds, with the size of the error."""
    modulus, advancing = test.contact_modulus.value, test.advancing_work.value
    size = min(largest, 0.99 * test.radius)
    exact = axisymmetric_contact(size, Sphere(test.radius).slope, modulus).force
    if (error := float(exact / sphere_contact(size, test.radius, modulus).force - 1)) > _FORCE_ERROR:
        yield (
            f"the contact radius is up to {largest / test.radius:.2g} times the radius of the lens: JKR is for a "
            f"paraboloid, and on a sphere the force without adhesion is {error:.1%} larger; use smaller loads"
        ).replace("%", " %")
    if thickness != math.inf and (error := _layer_error(largest / thickness)) > _FORCE_ERROR:
        yield (
            f"the contact radius is up to {largest / thickness:.2g} times the thickness: on a bonded, incompressible "
            f"layer, the force at an indentation is about {100 * error:.0f} % larger than on a half-space; use thicker "
            "samples or smaller loads"
        )
    energy = advancing or (test.receding_work.value if test.receding_work else 0.0)
    if not energy:
        return
    material = Material(modulus, energy, interaction_range)
    if short := describe_short_range(float(material.tabor_parameter(test.radius))):
        yield short
    if roughness is not None:
        ratio = full_contact_energy_ratio(roughness.full_contact_energy, modulus, energy)
        if ratio > 1 / HIGH_PULL_OFF_BELOW:
            yield (
                f"U_full/Δγ = {ratio:.2g}: bending the surface into the roughness takes {100 * ratio:.0f} % of the "
                "fitted work of adhesion, which is an apparent one, below that of smooth surfaces"
            )


def _layer_error(ratio):
    """Return the relative increase of Hertz's force by a bonded layer of Poisson ratio 1/2.

    ratio : contact radius sqrt(R delta) over thickness. Source: E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798,
    doi:10.1016/S0006-3495(02)75620-8.
    """
    return np.polynomial.polynomial.polyval(ratio, [0.0, 1.133, 1.283, 0.769, 0.0975])


def _largest_correlation(test, ranges):
    """Return the correlation of neighbouring residuals of the force on a branch if they are not random; else 0."""
    found = [0.0]
    for uses in (["loading"], _UNLOADING):
        residual = test.residuals["force"][np.isin(test.used_for, uses)]
        # Residuals of a stuck contact whose radius is measured have no component along the force.
        residual = residual[np.abs(residual) > _ROUNDING * 1e-2 * ranges["force"]]
        if len(residual) > 2 * LEAST_POINTS:
            correlation = float(residual[1:] @ residual[:-1] / (residual @ residual))
            if correlation > max(_CORRELATION, _BY_CHANCE / math.sqrt(len(residual))):
                found.append(correlation)
    return max(found)
