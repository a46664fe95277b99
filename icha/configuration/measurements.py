"""Section `measurements`: measured contact areas, which figure 5 shows."""

import math
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, model_validator

from icha.asperity.full_contact import gaussian_complete_pressure
from icha.support.formatting import format_quantity
from icha.support.titles import contradicting_unit, problem_with_numbers
from icha.support.units import conversion_factor
from icha.support.values import NOTHING, File, Name, Positive, Problem, Section, Text, unknown

# Reduced pressure at which contact without adhesion is complete, for a side of 10^6 shortest wavelengths. Surfaces with
# fewer wavelengths are in full contact at smaller pressures.
_FULL_CONTACT = gaussian_complete_pressure(1e6)
# Smallest plausible unit of nominal pressures, Pa. `mPa` is a thousandth of a pascal; most often, MPa is meant.
_SMALLEST_UNIT = 0.01


def _factor(unit: str, si_unit: str) -> float | None:
    """Return the factor from a unit to an SI unit; None if the units belong to different quantities."""
    try:
        return float(conversion_factor(unit, si_unit))
    except ValueError:
        return None


class Column(Section):
    """A column of a table of measurements."""

    column: Text
    """Heading of the column."""
    unit: Annotated[str, Field(strict=True)]
    """Unit of the numbers in the column: `1` or `percent` for ratios, a unit of pressure for nominal pressures. If the
    heading contains a unit, it must be the same unit."""


class Measurement(Section):
    """A table of measured contact areas. Figure 5 shows these areas together with the runs of a study."""

    path: File
    """Path of a CSV file with headings in the first line. The path is relative to the configuration file."""
    label: Text
    """Name in the legend of the figure. Write formulas between two `$`."""
    citation: Text
    """Source of the numbers. The report prints this text."""
    study: Name
    """Name of the study that is compared with the measurement."""
    load: Column
    """Column of the loads. Loads with the unit `1` are reduced pressures p/(E* h'rms). Loads with a unit of pressure,
    such as `kPa`, are nominal pressures, and need the key `material`."""
    area: Column
    """Column of the contact area fractions A/A0, with the unit `1` or `percent`."""
    material: Name | None = None
    """Material of the measurement. This key is required if the loads are nominal pressures."""
    rms_slope: Positive | None = None
    """Rms slope h'rms of the measured roughness. This key is required if the loads are nominal pressures; or, if a
    surface of the study has a shape, if they are reduced pressures."""

    @property
    def load_is_pressure(self) -> bool:
        """True if the column of the load contains nominal pressures."""
        return _factor(self.load.unit, "1") is None

    @property
    def columns(self) -> dict[str, float]:
        """Headings of the columns of load and area, with the factors that convert the numbers to SI units."""
        load = _factor(self.load.unit, "Pa" if self.load_is_pressure else "1")
        return {self.load.column: load, self.area.column: _factor(self.area.unit, "1")}

    @model_validator(mode="after")
    def _check_units(self):
        load, area = self.load.unit, self.area.unit
        if self.load_is_pressure and _factor(load, "Pa") is None:
            raise ValueError(f"load: the unit is {load!r}; expected '1' or a unit of pressure, such as 'kPa'")
        if self.load_is_pressure and _factor(load, "Pa") < _SMALLEST_UNIT:
            raise ValueError(f"load: the unit {load!r} is implausibly small; expected 'MPa', 'kPa' or 'Pa'")
        if _factor(area, "1") is None:
            raise ValueError(f"area: the unit is {area!r}; expected '1' or 'percent'")
        if self.load_is_pressure and self.material is None:
            raise ValueError(f"load in {load!r} without material; expected this key, or the unit '1'")
        for key, si_unit in (("load", "Pa" if self.load_is_pressure else "1"), ("area", "1")):
            column = getattr(self, key)
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
        return self

    def _beside_shape(self, campaign):
        """Return whether a surface of the study has a shape. Then figure 5 shows relative loads F/(E* A0)."""
        return any(campaign.surfaces[name].shape for name in campaign.studies[self.study].surfaces)

    def limits(self, campaign: Any) -> dict[str, tuple[float, str]]:
        """Return the largest load and area in SI units, with texts for messages, by heading of the column."""
        modulus = campaign.materials[self.material].contact_modulus if self.load_is_pressure else None
        slope = self.rms_slope or math.nan  # without a limit if the slope is missing, which `problems` reports
        if self._beside_shape(campaign):
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
        if self.rms_slope is None and self.study in campaign.studies:
            shaped = self._beside_shape(campaign)
            if shaped != self.load_is_pressure:
                loads = f"loads in {self.load.unit!r}" + (" beside a surface with a shape" if shaped else "")
                yield ("rms_slope",), NOTHING, f"the key is missing; expected the measured rms slope, for {loads}"
