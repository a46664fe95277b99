"""Units in the titles of the columns of a table, such as `pressure (MPa)` and `q (rad/um)`."""

import math
import re
import unicodedata

from icha.support.values import conversion_factor

_BRACKETS = re.compile(r"\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\]")
_ANGLE = re.compile(r"rad(?:ians?)?\b|(?:cycles?|lines?)\b")
_LENGTH_POWER = re.compile(r"([^\W\d_]+)\s*(?:\^|\*\*)?\s*([-+]?\d+)?")
# Signs before a unit that has no brackets, as in `pressure / MPa` and `pressure_MPa`.
_BEFORE_UNIT = re.compile(r"^|\s*/\s*|[\s_,:;]+|(?=%)")
# A factor before a unit, as in `10^3 Pa`.
_MULTIPLE = re.compile(r"(?:10\^|10\*\*|1e|^|[x×*]\s*)[-+]?\d+\s*[x×*]?\s*$")
# Spellings in titles that are not units of configurations, in small letters.
_SPELLINGS = {"pa": "Pa", "kpa": "kPa", "mpa": "MPa", "gpa": "GPa", "pct": "percent", "per cent": "percent"}
_SPELLINGS |= {"-": "1", "fraction": "1", "ratio": "1"}


def bracketed_texts(title: str) -> list[str]:
    """Return the texts in the brackets of a title."""
    return [first or second for first, second in _BRACKETS.findall(title)]


def power_of_length(text: str) -> tuple[float, int] | None:
    """Return the factor and exponent of a power of a unit of length, such as rad/um or nm^2 um^2; None for others."""
    plain = _ANGLE.sub("", unicodedata.normalize("NFKC", text)).translate({0x2212: "-", 0xB7: " ", 0x22C5: " "})
    factor, total = 1.0, 0
    for k, side in enumerate(plain.split("/")):
        for name, exponent in _LENGTH_POWER.findall(side):
            power = int(exponent or 1) * (-1 if k else 1)
            try:
                factor *= float(conversion_factor(name, "m")) ** power
            except ValueError:
                return None
            total += power
    return (factor, total) if total else None


def contradicting_unit(title: str, unit: str, si_unit: str) -> str | None:
    """Return the unit that a title states if it is not `unit`, a unit of pressure (Pa) or ratio (1); else None."""
    for text, before, certain in _possible_units(title):
        # Outside brackets, words such as `count` are names, and `p_m` is not in metres.
        found = _meaning(text)
        if found is None or (not certain and found in [("1", 1.0), ("m", 1)]):
            continue
        agrees = found[0] == si_unit and math.isclose(found[1], conversion_factor(unit, si_unit))
        return None if agrees and not _MULTIPLE.search(before) else text
    return None


def _possible_units(title):
    """Yield each text of a title that may be a unit, the text before it, and whether its place is that of a unit."""
    title = unicodedata.normalize("NFKC", title)
    brackets = bracketed_texts(title)
    for text in (*brackets, _BRACKETS.sub(" ", title)):
        for sign in _BEFORE_UNIT.finditer(text):
            rest, certain = text[sign.end() :].strip(), "/" in sign[0] or (text in brackets and not sign.end())
            yield rest, text[: sign.start()], certain
            yield re.split(r"[\s_,:;]", rest)[0], text[: sign.start()], certain


def _meaning(text):
    """Return the SI unit (Pa, 1 or N) and the factor of a unit; m and the exponent for powers of length; else None."""
    plain = re.sub(r"(?<=[a-z])(?=\d)", "^", text)
    for name in (plain, _SPELLINGS.get(plain.lower())):
        for si_unit in ("Pa", "1", "N") if name else ():
            try:
                return si_unit, float(conversion_factor(name, si_unit))
            except ValueError:
                continue
    power = power_of_length(text)
    return power and ("m", power[1])
