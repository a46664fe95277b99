"""Units and bounds for the values of arguments and configuration keys.

Functions and classes call `validate` to check their arguments. `icha.support.values` checks configuration keys with the
same bounds. `icha.path.targets` contains the bounds for targets of a path.
"""

import numbers
import sys
from dataclasses import dataclass


@dataclass(frozen=True)
class FloatRange:
    """Bounds and unit of a finite real number.

    Parameters
    ----------
    unit : unit of the number.
    above : exclusive lower bound; the number must be greater.
    least, most : the number must be in [least, most].
    model_ends : True if `most` is the largest value to which the asperity model applies.
    """

    unit: str = "1"
    above: float | None = None
    least: float | None = None
    most: float | None = None
    model_ends: bool = False

    def contains(self, value: float) -> bool:
        """Return whether a number is within all bounds."""
        return (
            (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.most is None or value <= self.most)
        )

    @property
    def interval(self) -> str:
        """Interval between a lower and an upper bound, such as `(0, 1]`."""
        lower = f"[{_short(self.least)}" if self.above is None else f"({_short(self.above)}"
        return f"{lower}, {_short(self.most)}]"

    @property
    def expected(self) -> str:
        """Description of the valid values, for use after "expected" in messages."""
        if self.above is None and self.least is None:
            bounds = "a number" if self.most is None else f"a number of at most {_short(self.most)}"
        elif self.most is None:
            bounds = "a number greater than 0" if self.least is None else "a number, 0 or greater"
        else:
            bounds = f"a number in {self.interval}"
        return bounds + (", where the asperity model holds" if self.model_ends else "")

    def validate(self, name: str, value) -> float:
        """Return a value as a float; for invalid values, raise ValueError with the name of the argument."""
        unit = "" if self.unit == "1" else f" (in {self.unit})"
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise ValueError(f"{name}: {value!r} is not a number{unit}")
        if not abs(value) <= sys.float_info.max:  # infinite, not a number, or an integer too large for a float
            raise ValueError(f"{name}: {value!r} is not finite{unit}")
        number = float(value)
        if not self.contains(number):
            raise ValueError(f"{name}: {number!r} must be {self.expected}{unit}")
        return number


def _short(bound: float) -> str:
    """Format a bound as `0`, `0.15`, `1e-4` or `1e9`."""
    text = f"{bound:.0e}" if 0 < bound < 1e-3 else f"{bound:g}"
    return text.replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


@dataclass(frozen=True)
class IntegerRange:
    """Bounds of an integer: from `least` to `most`."""

    least: int
    most: int = 2**31 - 1

    def contains(self, value) -> bool:
        """Return whether a value is an integer within the bounds."""
        return not isinstance(value, bool) and isinstance(value, numbers.Integral) and self.least <= value <= self.most

    def validate(self, name: str, value) -> int:
        """Return a value as an int; for invalid values, raise ValueError with the name of the argument."""
        if isinstance(value, bool) or not isinstance(value, numbers.Integral):
            raise ValueError(f"{name}: {value!r} is not an integer")
        if not self.contains(value):
            bound = f"least {self.least}" if value < self.least else f"most {self.most}"
            raise ValueError(f"{name}: {value!r} must be at {bound}")
        return int(value)


NUMBER = FloatRange()
POSITIVE = FloatRange(above=0)
# Bounds far beyond physical lengths; within the bounds, products of powers of lengths neither overflow nor underflow.
LENGTH = FloatRange("m", least=1e-24, most=1e9)
INDENTATIONS = FloatRange("m", least=-1e9, most=1e9)
# Loads are negative in tension.
FORCES = FloatRange("N", least=-1e30, most=1e30)
PRESSURES = FloatRange("Pa", least=-1e30, most=1e30)

# Surfaces.
HURST = FloatRange(above=0, most=1)
SLOPE = FloatRange(least=1e-9, most=1e6)
GRID = IntegerRange(8, 32768)
SEED = IntegerRange(0)

# Materials.
CONTACT_MODULUS = FloatRange("Pa", least=1e-9, most=1e15)
SURFACE_ENERGY = FloatRange("J/m^2", least=0, most=1e24)
# Surface energy divided by contact modulus, for materials with adhesion.
ADHESION_LENGTH = FloatRange("m", least=1e-40, most=1e9)
POISSON_RATIO = FloatRange(least=0, most=0.5)
