"""Rules for values, said once: unit and bounds of whatever arguments and configurations give.

Functions and classes hold an argument against its rule by `checked`; the types of a configuration's values
(`icha.support.values`) are made of the same rules. Those of a path's states stand in `icha.path.targets`.
"""

import math
import numbers
from dataclasses import dataclass

# What the limits of the asperity model have to do with boundary elements, which could go further.
ALL_MODELS = "to which boundary elements are limited, too"


@dataclass(frozen=True)
class Real:
    """A finite real number: in `unit`, greater than `above`, at least `least`, at most `most`.

    `model_ends` says that beyond `most` the asperity model does not hold, and that all models end there.
    """

    unit: str = "1"
    above: float | None = None
    least: float | None = None
    most: float | None = None
    model_ends: bool = False

    def holds(self, value: float) -> bool:
        """Whether a number is within the bounds."""
        return (
            (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.most is None or value <= self.most)
        )

    @property
    def interval(self) -> str:
        """The bounds of a number that has two of them: `(0, 1]`."""
        lower = f"[{_short(self.least)}" if self.above is None else f"({_short(self.above)}"
        return f"{lower}, {_short(self.most)}]"

    @property
    def allowed(self) -> str:
        """What may be given instead."""
        if self.above is None and self.least is None:
            words = "a number" if self.most is None else f"a number of at most {_short(self.most)}"
        elif self.most is None:
            words = "a number greater than 0" if self.least is None else "a number, 0 or greater"
        else:
            words = f"a number in {self.interval}"
        return f"{words}, where the asperity model holds" if self.model_ends else words

    def checked(self, name: str, value) -> float:
        """The value of argument `name` as a float; ValueError naming it if it breaks the rule."""
        unit = f" (in {self.unit})"
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise ValueError(f"{name}: {value!r} is not a number{unit}")
        try:
            value = float(value)
        except OverflowError:
            raise ValueError(f"{name}: a number beyond 1e308 is not finite{unit}") from None
        if not math.isfinite(value):
            raise ValueError(f"{name}: {value!r} is not finite{unit}")
        if self.holds(value):
            return value
        if self.model_ends and value > self.most:
            raise ValueError(
                f"{name}: {value!r} lies beyond the range of the asperity model (at most {self.most}), {ALL_MODELS}"
            )
        if self.most is not None:
            raise ValueError(f"{name}: {value!r} must lie in {self.interval}{'' if self.unit == '1' else unit}")
        raise ValueError(
            f"{name}: {value!r} must {'be greater than 0' if self.least is None else 'not be negative'}{unit}"
        )


def _short(bound: float) -> str:
    """A bound as people write it: `0`, `0.15`, `1e-4`, `1e9`."""
    text = f"{bound:.0e}" if 0 < bound < 1e-3 else f"{bound:g}"
    return text.replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


@dataclass(frozen=True)
class Integer:
    """An integer from `least` to `most`."""

    least: int
    most: int = 2**31 - 1

    def holds(self, value) -> bool:
        """Whether it is one within the bounds."""
        return not isinstance(value, bool) and isinstance(value, numbers.Integral) and self.least <= value <= self.most

    def checked(self, name: str, value) -> int:
        """The value of argument `name` as an int; ValueError naming it if it breaks the rule."""
        if isinstance(value, bool) or not isinstance(value, numbers.Integral):
            raise ValueError(f"{name}: {value!r} is not an integer")
        if not self.holds(value):
            bound = f"least {self.least}" if value < self.least else f"most {self.most}"
            # More digits Python may not write.
            shown = f"{value!r}" if abs(value) < 10**30 else "a number of more than 30 digits"
            raise ValueError(f"{name}: {shown} must be at {bound}")
        return int(value)


NUMBER = Real()
POSITIVE = Real(above=0)
# Ranges far wider than anything physical, in which no product of powers overflows or vanishes.
LENGTH = Real("m", least=1e-24, most=1e9)

# Surfaces.
HURST = Real(above=0, most=1)
SLOPE = Real(least=1e-9, most=1e6)
GRID = Integer(8, 32768)
SEED = Integer(0)

# Materials.
CONTACT_MODULUS = Real("Pa", least=1e-9, most=1e15)
SURFACE_ENERGY = Real("J/m^2", least=0, most=1e24)
# Surface energy over contact modulus, where there is adhesion.
ADHESION_LENGTH = Real("m", least=1e-40, most=1e9)

# Boundary elements.
TOLERANCE = Real(least=1e-12, most=1e-4)
REFINEMENT = Integer(1, 16)
