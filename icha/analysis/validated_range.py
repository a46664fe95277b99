"""Surfaces and materials on which the error of the asperity model was measured, and what lies outside of them.

Ranges are those of the seven surfaces and three seeds of study `short_range` of campaign `validation`, rounded
outwards; a test compares them.
"""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple


class Range(NamedTuple):
    """Range of a quantity in the validation.

    Parameters
    ----------
    words : what the quantity is, as messages name it.
    least : smallest value.
    most : largest value.
    reason : what is said instead of a value outside; empty to give the value.
    """

    words: str
    least: float
    most: float
    reason: str = ""

    @property
    def shown(self) -> str:
        """The range as messages give it."""
        if self.most == math.inf:
            return f"{self.least:g} and more"
        return f"{self.least:g} to {self.most:g}"


# By the name of the quantity.
VALIDATED = {
    # Exactly 1 there, where amplitudes are fixed by the spectrum; random ones of the same spectra scatter up to this.
    "slope_anisotropy": Range("anisotropy of slopes", 1.0, 1.2),
    "height_skewness": Range("skewness of heights", -0.2, 0.2),
    "height_kurtosis": Range("kurtosis of heights", 2.3, 3.5),
    # Narrower spectra than those there, with 3.3, have fewer unions of spots; 1.5 is the least of isotropic surfaces.
    "nayak_parameter": Range("Nayak's parameter", 1.5, 47.0),
    # Of the validation's surfaces at most one in two hundred.
    "unsupported_summits": Range("share of unsupported summits", 0.0, 0.01),
    # Better resolved surfaces and less adhesion are no harder; so there is no upper end.
    "nodes_per_short_wave": Range("nodes per shortest wave", 5.8, math.inf),
    "full_contact_energy_ratio": Range("U_full/dgamma", 76.0, math.inf),
    # 1 for a single square, 0 for a periodic surface.
    "free_edges": Range("free edges", 0, 0, "free edges, which boundary elements cannot have: give `boundary: window`"),
}


def outside_validation(facts: Mapping[str, float]) -> list[str]:
    """Name the quantities of a contact that lie outside the validation, with their values and ranges.

    Parameters
    ----------
    facts : values by the names of `VALIDATED`; any may be left out.
    """
    return [
        known.reason or f"{known.words} {facts[name]:.2g}, validated: {known.shown}"
        for name, known in VALIDATED.items()
        if name in facts and not known.least <= facts[name] <= known.most
    ]


def surface_in_words(runs: Iterable[Mapping[str, float]]) -> str:
    """Describe a surface by the quantities that are compared with the validation, over its runs."""
    runs = list(runs)
    found = []
    for name, known in VALIDATED.items():
        if name in ("full_contact_energy_ratio", "free_edges"):
            continue
        values = [facts[name] for facts in runs]
        ends = dict.fromkeys(f"{value:.2g}" for value in (min(values), max(values)))
        found.append(f"{known.words} {' to '.join(ends)}")
    return ", ".join(found)
