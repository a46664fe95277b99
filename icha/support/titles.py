"""Units in the titles of the columns of a table, such as `pressure (MPa)` and `q (rad/um)`."""

import math
import re
import unicodedata
from typing import NamedTuple

from icha.support.units import conversion_factor, find_factor

_BRACKETS = re.compile(r"\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\]")
_ANGLE = re.compile(r"rad(?:ians?)?\b|(?:cycles?|lines?)\b")
_LENGTH_POWER = re.compile(r"([^\W\d_]+)\s*(?:\^|\*\*)?\s*([-+]?\d+)?")
# Signs before a unit that has no brackets, as in `pressure / MPa` and `pressure_MPa`.
_BEFORE_UNIT = re.compile(r"^|\s*/\s*|[\s_,:;]+|(?=[%‰])")
# A factor before a unit, as in `10^3 Pa`.
_MULTIPLE = re.compile(r"(?:10\^|10\*\*|1e|^|[x×*]\s*)[-+]?\d+\s*[x×*]?\s*$")
# Spellings in titles that are not units of configurations, in small letters.
_SPELLINGS = {"pa": "Pa", "kpa": "kPa", "mpa": "MPa", "gpa": "GPa", "pct": "percent", "per cent": "percent"}
_SPELLINGS |= {"-": "1", "fraction": "1", "ratio": "1"}
_SPELLINGS |= {"‰": "permille", "promille": "permille", "per mille": "permille"}
# Units of length that are no names of quantities.
_LENGTHS = frozenset(("nm", "um", "µm", "μm", "mm", "cm"))
# Signs of logarithms, such as `log10 p`, `ln(p)` and `lgA`.
_LOGARITHM = re.compile(r"(?<![a-z])(?:log(?:arithm\w*)?|ln|lg)(?:_?\d+|_?e)?[ap]?(?![a-z])", re.IGNORECASE)
# Factors of all numbers, as in `pressure x 1e3`, `pressure * 1000`, `1000 x pressure`, `10^3 p` and `p/1000`.
_FACTORS = (
    r"(?:(?<![^\W_])[xX]|×|·|⋅|(?<!\*)\*(?!\*))\s*[-+]?\d",
    r"(?<![\w^+-])\d+(?:\s*[×·⋅]|\s*\*(?!\*)|\s+[xX]\s)",
    r"(?<!\w)10\s*(?:\^|\*\*|(?=[⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻]))",
    r"(?<![\w.])\d[\d.]*[eE][-+]?\d",
    r"(?<=[^\d\s/])\s*/\s*10+(?!\w)",
)
_FACTOR = re.compile("|".join(_FACTORS))
# Names of quotients, such as A/A0 and A_real/A_nom. Words such as "area fraction" also stand above numbers in percent.
_FRACTION = re.compile(r"\b[Aa]\w*\s*/\s*[Aa]")
# Loads divided by a modulus, such as F/(E* A0) and p/E*, and the slopes by which reduced pressures are also divided.
_OVER_MODULUS = re.compile(r"/\s*\(?\s*(?:A\w*[\s*·]+)?E(?=[^A-Za-z]|$|A|r\b|eff\b|star\b)|(?i:relative[\s_]+load)")
# Words in headings, by quantity. Other words, numbers and signs may mean another quantity, an error or a factor.
_WORDS = {
    "force": "force load f fn cell sensor",
    "indentation": "indentation depth indent penetration displacement delta d h",
    "contact_radius": "contact radius a r rc",
    "load": "pressure load stress p f reduced relative nominal apparent squeezing",
    "area": "area contact real true relative fraction fractional ratio a",
    "rms_height": "rms height roughness hrms sq rq",
    "advancing_work": "work of adhesion w gamma dgamma surface energy advancing apparent effective jkr fit",
    "receding_work": "work of adhesion w gamma dgamma surface energy receding apparent effective jkr fit",
}
_HARMLESS = frozenset(
    "in the normal applied measured experimental mean average loading unloading approach retraction".split()
)
# Formulas of ratios, such as A/A0 and p/(E* h'rms).
_RATIOS = re.compile(r"\b[Aa]\w*\s*/\s*[Aa]\w*|\b[pFσ]\w*\s*/\s*\(?\s*(?:A\w*[\s*·]+)?E[^()]*\)?|\bp\*|^p′")
_SLOPE = re.compile(r"h|slope|rms|grad|∇|\bg|m_?2", re.IGNORECASE)


def bracketed_texts(title: str) -> list[str]:
    """Return the texts in the brackets of a title."""
    return [first or second for first, second in _BRACKETS.findall(title)]


def power_of_length(text: str) -> tuple[float, int] | None:
    """Return the factor and exponent of a power of a unit of length, such as rad/um or nm^2 um^2; None for others."""
    plain = _ANGLE.sub("", unicodedata.normalize("NFKC", text)).translate({0x2212: "-", 0xB7: " ", 0x22C5: " "})
    factor, total = 1.0, 0
    for k, side in enumerate(plain.split("/")):
        if k and re.match(r"\s*\d", side):  # a factor, as in um/10
            return None
        for name, exponent in _LENGTH_POWER.findall(side):
            power = int(exponent or 1) * (-1 if k else 1)
            if (metres := find_factor(name, "m")) is None:
                return None
            factor *= metres**power
            total += power
    return (factor, total) if total else None


class StatedUnit(NamedTuple):
    """Unit that a title states.

    Attributes
    ----------
    text : unit as in the title.
    si_unit : Pa, 1, N, J/m^2 or m; m^2 and so on for other powers of length.
    factor : factor from the unit to `si_unit`.
    multiple : number in front of the unit, as in `10^3 Pa`, or an empty text.
    """

    text: str
    si_unit: str
    factor: float
    multiple: str


def stated_unit(title: str) -> StatedUnit | None:
    """Return the unit that a title states; None if there is none."""
    for text, before, certain in _possible_units(title):
        # Outside brackets, words such as `count` are names, and `p_m` is not in metres; `radius um` is in micrometres.
        found = _meaning(text)
        if found and (certain or not (found == ("1", 1.0) or (found[0] == "m" and text not in _LENGTHS))):
            multiple = _MULTIPLE.search(before)
            return StatedUnit(text, *found, multiple[0] if multiple else "")
    return None


def contradicting_unit(title: str, unit: str, si_unit: str) -> str | None:
    """Return unit and factor of a title if they are not `unit`, whose SI unit is Pa, 1, N or m; else None."""
    if (stated := stated_unit(title)) is None:
        return None
    agrees = stated.si_unit == si_unit and math.isclose(stated.factor, conversion_factor(unit, si_unit))
    return None if agrees and not stated.multiple else f"{stated.multiple.strip()} {stated.text}".lstrip()


def problem_with_numbers(title: str, unit: str, si_unit: str) -> str | None:
    """Return why the numbers below a title are probably not values in `unit`, and what to do; None if they may be.

    The title has no unit that contradicts `unit`, the unit of the configuration; `si_unit` is Pa, 1, N or m.
    """
    if found := _LOGARITHM.search(unicodedata.normalize("NFKC", title)):
        return f"contains {found[0]!r}, so the numbers look like logarithms; expected the values themselves"
    if _FACTOR.search(title):
        return "contains a factor; expected numbers without a factor"
    title = unicodedata.normalize("NFKC", title)
    if si_unit != "1":
        return None
    if (found := _OVER_MODULUS.search(title)) and not _SLOPE.search(title, found.start()):
        return "is a load over E* without the rms slope; expected reduced pressures p/(E* h'rms), or pressures"
    factor = float(conversion_factor(unit, "1"))
    stated = any(_meaning(text) == ("1", factor) for text, *_ in _possible_units(title))
    if factor != 1 and _FRACTION.search(title) and not stated:
        return f"is the name of a fraction; expected the unit '1', or a heading with the unit, such as 'area ({unit})'"
    return None


def problem_with_words(title: str, quantity: str) -> str | None:
    """Return why a title may not be that of the plain values of a quantity, and what to do; None if it is.

    Apart from the unit, such a title is one letter, or it has only words of the quantity (`_WORDS`).
    """
    name, rest = quantity.replace("_", " "), unicodedata.normalize("NFKC", title)
    if stated := stated_unit(title):
        rest = re.sub(rf"(?:[\[(/]\s*|(?<![^\W_])){re.escape(stated.text)}(?![^\W_])", " ", rest, count=1)
    if quantity in ("load", "area"):
        rest = _RATIOS.sub(" ", rest)
    words = re.findall(r"[^\W_]+|(?<!\w)-|[^\w\s()\[\],:;.-]", rest)
    if len(words) == 1 and len(words[0]) == 1 and words[0].isalpha():
        words = ["diameter"] if quantity == "contact_radius" and words[0] in "dD" else []
    known = _HARMLESS.union(_WORDS[quantity].split())
    if not (other := [word for word in words if word.lower() not in known]):
        return None
    return (
        f"contains {other[0]!r}, so the numbers may not be the {name}; expected words of the {name} and its unit. "
        f"Convert the numbers if needed, and name the column {name!r}"
    )


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
    """Return the SI unit (Pa, 1, N, J/m^2, m or a power of m) and the factor of a unit; None for other texts."""
    plain = re.sub(r"(?<=[a-z])(?=\d)", "^", text)
    for name in (plain, _SPELLINGS.get(plain.lower())):
        for si_unit in ("Pa", "1", "N", "J/m^2") if name else ():
            if (factor := find_factor(name, si_unit)) is not None:
                return si_unit, factor
    power = power_of_length(text)
    return power and ("m" if power[1] == 1 else f"m^{power[1]}", power[0])
