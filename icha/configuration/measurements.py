"""Section `measurements`: measured contact areas (figure 5), and measured values of indenters (figures 17 to 19)."""

import math
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, model_validator

from icha.support.formatting import format_quantity
from icha.support.titles import contradicting_unit, problem_with_numbers, problem_with_words
from icha.support.units import find_factor
from icha.support.values import NOTHING, File, Name, Positive, Problem, Section, Text, unknown
from icha.surfaces.moments import largest_gaussian_value

# Reduced pressure at which contact without adhesion is complete, for a side of 10^6 shortest wavelengths. Surfaces with
# fewer wavelengths are in full contact at smaller pressures.
_FULL_CONTACT = largest_gaussian_value(1e6) / 2
# Quantities of indenters, with their SI units, and those that may be negative.
_UNITS = {"force": "N", "indentation": "m", "contact_radius": "m", "rms_height": "m"}
_UNITS |= {"advancing_work": "J/m^2", "receding_work": "J/m^2"}
_SIGNED = "force", "indentation"
# Quantities of each figure, which a table must contain together.
_TOGETHER = (("load", "area"), ("force", "indentation"), ("force", "contact_radius"))
_TOGETHER += (("rms_height", "advancing_work"), ("rms_height", "receding_work"))
# Smallest plausible unit of nominal pressures, Pa. `mPa` is a thousandth of a pascal; most often, MPa is meant.
_SMALLEST_UNIT = 0.01


class Column(Section):
    """A column of a table of measurements."""

    column: Text
    """Heading of the column."""
    unit: Annotated[str, Field(strict=True)]
    """Unit of the numbers in the column, such as `mN`: `1` or `percent` for ratios, a unit of pressure for nominal
    pressures. If the heading contains a unit, it must be the same unit."""


class Measurement(Section):
    """A table of measured values, which figures show together with the runs of a study.

    Contact areas against load are for figure 5, values of an indenter for figures 17 to 19.
    """

    path: File
    """Path of a CSV file with headings in the first line. The path is relative to the configuration file."""
    label: Text
    """Name in the legend of the figure. Write formulas between two `$`."""
    citation: Text
    """Source of the numbers. The report prints this text."""
    study: Name
    """Name of the study that is compared with the measurement."""
    load: Column | None = None
    """Column of the loads. Loads with the unit `1` are reduced pressures p/(E* h'rms). Loads with a unit of pressure,
    such as `kPa`, are nominal pressures, and need the key `material`."""
    area: Column | None = None
    """Column of the contact area fractions A/A0, with the unit `1` or `percent`."""
    force: Column | None = None
    """Column of the forces on an indenter, negative in tension, in the order of the test."""
    indentation: Column | None = None
    """Column of the indentations, which figure 17 shows; 0 where the shape touches the undeformed plane."""
    contact_radius: Column | None = None
    """Column of the contact radii, which figure 18 shows. The surfaces of the study need the radius of the lens."""
    rms_height: Column | None = None
    """Column of the rms heights of rough indenters, for works of adhesion."""
    advancing_work: Column | None = None
    """Column of the works of adhesion of loading. Figure 19 divides them by that of the `material`."""
    receding_work: Column | None = None
    """Column of the works of adhesion of unloading. Figure 19 divides them by that of the `material`."""
    material: Name | None = None
    """Material of the measurement. This key is required for nominal pressures and for works of adhesion. Figure 17
    shows the measurement only beside this material."""
    rms_slope: Positive | None = None
    """Rms slope h'rms of the measured roughness. This key is required if the loads are nominal pressures; or, if a
    surface of the study has a shape, if they are reduced pressures."""

    @property
    def load_is_pressure(self) -> bool:
        """True if the column of the load contains nominal pressures."""
        return self.load is not None and find_factor(self.load.unit, "1") is None

    @property
    def si_units(self) -> dict[str, str]:
        """SI units of the quantities in the table."""
        units = {"load": "Pa" if self.load_is_pressure else "1", "area": "1"} | _UNITS
        return {name: unit for name, unit in units.items() if getattr(self, name) is not None}

    @property
    def columns(self) -> dict[str, float]:
        """Headings of the columns, with the factors that convert the numbers to SI units."""
        found = [(getattr(self, name), unit) for name, unit in self.si_units.items()]
        return {column.column: find_factor(column.unit, unit) for column, unit in found}

    @property
    def signed(self) -> set[str]:
        """Headings of the columns whose numbers may be negative."""
        return {getattr(self, name).column for name in self.si_units if name in _SIGNED}

    @model_validator(mode="after")
    def _check_units(self):
        if self.load_is_pressure and find_factor(self.load.unit, "Pa") is None:
            raise ValueError(f"load: the unit is {self.load.unit!r}; expected '1' or a unit of pressure, such as 'kPa'")
        if self.load_is_pressure and find_factor(self.load.unit, "Pa") < _SMALLEST_UNIT:
            raise ValueError(f"load: the unit {self.load.unit!r} is implausibly small; expected 'MPa', 'kPa' or 'Pa'")
        for key, si_unit in self.si_units.items():
            column = getattr(self, key)
            if find_factor(column.unit, si_unit) is None:
                expected = "'1' or 'percent'" if si_unit == "1" else f"a unit such as {si_unit!r}"
                raise ValueError(f"{key}: the unit is {column.unit!r}; expected {expected}")
            if stated := contradicting_unit(column.column, column.unit, si_unit):
                raise ValueError(
                    f"{key}: the unit is {column.unit!r}, but the heading {column.column!r} states {stated!r}; "
                    "expected the same unit. Correct `unit`, or the heading in the table and in `column`"
                )
            if problem := problem_with_numbers(column.column, column.unit, si_unit):
                raise ValueError(
                    f"{key}: the heading {column.column!r} {problem}. Correct `unit` or the table, and if the numbers "
                    f"are in the unit {column.unit!r}, rename the heading in the table and in `column`"
                )
            if problem := problem_with_words(column.column, key):
                raise ValueError(f"{key}: the heading {column.column!r} {problem} in the table and in `column`")
        groups = [group for group in _TOGETHER if self.si_units.keys() >= {*group}]
        if self.si_units.keys() != {name for group in groups for name in group} or not groups:
            raise ValueError(
                f"has columns of {', '.join(self.si_units) or 'no quantity'}; expected load and area (figure 5), force "
                "and indentation (figure 17), force and contact_radius (figure 18), or rms_height with advancing_work "
                "or receding_work (figure 19)"
            )
        if self.load and len(groups) > 1:
            raise ValueError("has columns of figure 5 and of indenters; expected an entry for each")
        if len(self.columns) < len(self.si_units):
            raise ValueError("several quantities have the same column; expected a column for each")
        if self.material is None and (self.load_is_pressure or "rms_height" in self.si_units):
            what, other = (f"load in {self.load.unit!r}", ", or the unit '1'") if self.load else ("rms_height", "")
            raise ValueError(f"{what} without material; expected this key{other}")
        return self

    def _beside_shape(self, campaign):
        """Return whether a surface of the study has a shape. Then figure 5 shows relative loads F/(E* A0)."""
        return any(campaign.surfaces[name].shape for name in campaign.studies[self.study].surfaces)

    def limits(self, campaign: Any) -> dict[str, tuple[float, str]]:
        """Return the largest load and area in SI units, with texts for messages, by heading of the column."""
        if self.load is None:
            return {}
        modulus = campaign.materials[self.material].contact_modulus if self.load_is_pressure else None
        slope = self.rms_slope or math.nan  # without a limit if the slope is missing, which `problems` reports
        study = campaign.studies[self.study]
        # Pressures of complete contact with layers have no such limit.
        layers = any(campaign.materials[name].thickness for name in study.materials)
        if layers or self._beside_shape(campaign):
            most, reason = modulus or 1 / slope, "F/(E* A0) = 1, too large for linear elasticity"
        else:
            most = _FULL_CONTACT * (modulus * slope if modulus else 1.0)
            reason = f"p/(E* h'rms) = {_FULL_CONTACT:.2g}, where every rough surface is in full contact"
        load = format_quantity(most, "Pa") if modulus and most > 0 else f"{most:.3g}"
        keys = "unit, material and rms_slope" if modulus else "unit"
        return {
            self.load.column: (most, f"{load} ({reason}); expected smaller loads. Correct {keys}"),
            self.area.column: (1.0, "100 %; expected a fraction of the area. Check the unit of the column"),
        }

    def problems(self, campaign: Any) -> Iterator[Problem]:
        """Yield a problem for each name that the campaign does not define, and for loads without a needed rms slope."""
        yield from unknown(("study",), self.study, campaign.studies)
        if self.material is not None:
            yield from unknown(("material",), self.material, campaign.materials)
        if self.contact_radius and self.study in campaign.studies:
            surfaces = campaign.studies[self.study].surfaces
            shapes = [campaign.surfaces[name].shape for name in surfaces if name in campaign.surfaces]
            radii = {getattr(shape and shape.shape, "radius", None) for shape in shapes}
            if len(radii) > 1:
                reason = "has a study whose surfaces have different radii; expected one radius, that of the lens"
                yield ("contact_radius",), self.contact_radius.column, reason
        if self.load and self.rms_slope is None and self.study in campaign.studies:
            shaped = self._beside_shape(campaign)
            if shaped != self.load_is_pressure:
                loads = f"loads in {self.load.unit!r}" + (" beside a surface with a shape" if shaped else "")
                yield ("rms_slope",), NOTHING, f"the key is missing; expected the measured rms slope, for {loads}"
