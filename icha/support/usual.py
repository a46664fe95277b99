"""Usual values of physical quantities, and the category of ICHA's warnings in Python.

A value outside its usual range is most often due to a wrong unit. Campaigns refuse such a value unless it is confirmed;
`icha.simulate` and `icha.Surface` warn.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple


class IchaWarning(UserWarning):
    """Warning: an argument is unusual, or the results of a run must not be used without care."""


class Usual(NamedTuple):
    """Usual range of the values of a key.

    Attributes
    ----------
    least, most : ends of the range, in `unit`.
    text : range with its reason, for messages after "expected".
    unit : SI unit of the values.
    """

    least: float
    most: float
    text: str
    unit: str = "1"

    def contains(self, value: float) -> bool:
        """Return whether a value is in the usual range; True for invalid values, which other checks report."""
        return value <= 0 or self.least <= value <= self.most

    def __str__(self):
        """Return the usual range and its reason, as text for messages."""
        return self.text


_MODULUS = Usual(1e3, 2e12, "1 kPa to 2000 GPa (from soft gels to diamond on a rigid body, 1150 GPa)", "Pa")
_ENERGY = "0 or 0.001 mJ/m^2 to 3 J/m^2 (van der Waals forces give 10 to 200 mJ/m^2, clean metals 1 to 3 J/m^2)"
_RANGE = "0.05 nm to 1 um (chemical bonds have less than 1 nm, van der Waals forces some nm; a coarse grid may need "
_RANGE += "some 100 nm)"
SIDE = Usual(1e-9, 1.0, "1 nm to 1 m (from a few atoms to a machine part)", "m")
_WAVE = Usual(1e-10, 1.0, "0.1 nm to 1 m (from an atom to a machine part)", "m")
_RADIUS = Usual(1e-9, 10.0, "1 nm to 10 m (from the tip of a microscope to a nearly flat lens)", "m")
RMS_SLOPE = Usual(1e-4, 5.0, "1e-4 to 5 (superpolished mirrors have 1e-3, fracture surfaces about 1)")
# Usual values by key. The ranges contain every reasonable value and exclude most values with a wrong unit prefix.
USUAL = {
    "contact_modulus": _MODULUS,
    "youngs_modulus": _MODULUS,
    "surface_energy": Usual(1e-6, 3.0, _ENERGY, "J/m^2"),
    "interaction_range": Usual(5e-11, 1e-6, _RANGE, "m"),
    "period": SIDE,
    "side": SIDE,
    "thickness": SIDE,
    "radius": _RADIUS,
    "radii": _RADIUS,
    "size": SIDE,
    "rolloff_wavelength": _WAVE,
    "short_wavelength": _WAVE,
    "cutoff": _WAVE,
    "rms_slope": RMS_SLOPE,
    "rms_slopes": RMS_SLOPE,
}


def unusual_arguments(arguments: Mapping[str, Any]) -> Iterator[str]:
    """Yield a message for each argument of a function that is outside its usual range; infinite values are valid."""
    for name, value in arguments.items():
        if isinstance(value, float) and name in USUAL and value < math.inf and not USUAL[name].contains(value):
            unit = "" if USUAL[name].unit == "1" else f" {USUAL[name].unit}"
            yield f"{name}: {value:.4g}{unit} is unusual; expected {USUAL[name]}. Check the unit; all are SI units"
