"""Units in configurations and in files of users: one table of symbols, SI prefixes and long names."""

import math
import re
import unicodedata
from decimal import Decimal
from functools import cache, lru_cache

# Symbols of the SI prefixes with which ICHA writes quantities, by power of ten.
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
# Names of quantities, by SI unit.
PHYSICAL_NAMES = {
    "m": "length",
    "Pa": "pressure",
    "J/m^2": "energy per area",
    "N": "force",
    "rad": "angle",
    "s": "time",
    "1": "ratio",
}
# Prefixes that ICHA reads: power of ten and long name, by symbol. `μ` is the Greek letter, as NFKC normalises it.
_READ = {"p": (-12, "pico"), "n": (-9, "nano"), "u": (-6, "micro"), "μ": (-6, "micro"), "m": (-3, "milli")}
_READ |= {"c": (-2, "centi"), "d": (-1, "deci")}
_READ |= {"k": (3, "kilo"), "M": (6, "mega"), "G": (9, "giga"), "T": (12, "tera")}
_LENGTH, _MASS, _TIME, _NUMBER = (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)
_FORCE, _PRESSURE, _ENERGY = (1, 1, -2), (-1, 1, -2), (2, 1, -2)
# By symbol: factor to m, kg and s; powers of m, kg and s; prefixes that are valid; long names. Prefixes that authors
# hardly mean are left out: 10 Mm is a slip, and px, pt, au and hand have other meanings in files of heights.
_UNITS = {
    "m": ("1", _LENGTH, "pnuμmcdk", "meter metre"),
    "Å": ("1e-10", _LENGTH, "", "angstrom ångström"),
    "in": ("0.0254", _LENGTH, "", "inch inches"),
    "mil": ("2.54e-5", _LENGTH, "", "mil"),
    "thou": ("2.54e-5", _LENGTH, "", ""),
    "micron": ("1e-6", _LENGTH, "", "micron"),
    "g": ("1e-3", _MASS, "uμmk", "gram"),
    "s": ("1", _TIME, "nuμm", "second"),
    "min": ("60", _TIME, "", "minute"),
    "h": ("3600", _TIME, "", "hour"),
    "d": ("86400", _TIME, "", "day"),
    "N": ("1", _FORCE, "pnuμmkM", "newton"),
    "gf": ("9.80665e-3", _FORCE, "mk", ""),
    "lbf": ("4.4482216152605", _FORCE, "", ""),
    "dyn": ("1e-5", _FORCE, "m", "dyne"),
    "Pa": ("1", _PRESSURE, "uμmkMGT", "pascal"),
    "bar": ("1e5", _PRESSURE, "m", "bar"),
    "atm": ("101325", _PRESSURE, "", ""),
    "psi": ("6894.757293168361", _PRESSURE, "", ""),
    "J": ("1", _ENERGY, "pnuμmk", "joule"),
    "erg": ("1e-7", _ENERGY, "", "erg"),
    "rad": ("1", _NUMBER, "m", "radian"),
    "deg": ("0.01745329251994329576923690768", _NUMBER, "", "degree"),
    "°": ("0.01745329251994329576923690768", _NUMBER, "", ""),
    "%": ("0.01", _NUMBER, "", ""),
    "percent": ("0.01", _NUMBER, "", ""),
    "permille": ("0.001", _NUMBER, "", ""),
    "ppm": ("1e-6", _NUMBER, "", ""),
}
# A unit with its power, such as m^-2, and the sign in front of it. `J/m2` is no unit, because of the missing ^.
_POWER = re.compile(r"\s*([*/·⋅]|\s)\s*([^\W\d_]+|[%°])(?:(?:\^|\*\*)([+-]?\d{1,2}))?")
_SUPERSCRIPTS = re.compile("[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
# Largest number of characters of a unit.
_LONGEST = 100


@cache
def _known() -> tuple[dict, dict]:
    """Return factor and powers of all units with their prefixes: by symbol, and by long name in small letters."""
    symbols, names = {}, {}
    for symbol, (text, powers, prefixes, long) in _UNITS.items():
        for prefix in ("", *prefixes):
            exponent, long_prefix = _READ.get(prefix, (0, ""))
            symbols[prefix + symbol] = found = Decimal(text).scaleb(exponent), powers
            names |= {f"{long_prefix}{name}{end}": found for name in long.split() for end in ("", "s")}
    return symbols, names


@lru_cache(maxsize=1024)
def conversion_factor(unit: str, si_unit: str) -> Decimal:
    """Return the exact factor from `unit` to `si_unit`; raise ValueError if the units are not convertible."""
    if len(unit) > _LONGEST:
        raise ValueError(f"a text of {len(unit)} characters is not a unit")
    if unit == si_unit == "1":
        return Decimal(1)
    found, wanted = _resolve(unit), (Decimal(1), _NUMBER) if si_unit == "1" else _resolve(si_unit)
    if found is None or found[1] != wanted[1] or not 0 < found[0] < math.inf:
        raise ValueError(f"{unit!r} is not a unit of {PHYSICAL_NAMES[si_unit]}")
    return found[0]


def find_factor(unit: str, si_unit: str) -> float | None:
    """Return the factor from `unit` to `si_unit`; None if the units are not convertible."""
    try:
        return float(conversion_factor(unit, si_unit))
    except ValueError:
        return None


def _resolve(unit: str) -> tuple[Decimal, tuple[int, ...]] | None:
    """Return the factor of a product of units to m, kg and s, and the powers of m, kg and s; None for other texts."""
    plain = _SUPERSCRIPTS.sub(lambda match: "^" + unicodedata.normalize("NFKC", match[0]), unit.strip())
    text = "*" + unicodedata.normalize("NFKC", plain).replace("\u2212", "-")
    symbols, names = _known()
    factor, powers, place = Decimal(1), (0, 0, 0), 0
    while place < len(text):
        match = _POWER.match(text, place)
        found = match and (symbols.get(match[2]) or names.get(match[2].lower()))
        if not found:
            return None
        power = int(match[3] or 1) * (-1 if match[1] == "/" else 1)
        factor *= found[0] ** power
        powers = tuple(have + power * more for have, more in zip(powers, found[1], strict=True))
        place = match.end()
    return factor, powers
