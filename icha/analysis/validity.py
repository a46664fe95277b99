"""Whether the model holds for a campaign: where its parts were verified, and how far it is from the truth.

Checks say that equations were solved; this says what the solutions are worth. The lines are short, to be read before a
campaign is run, after it, and on top of its report.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.asperity.full_contact import FULL_CONTACT_BELOW, HIGH_PULL_OFF_BELOW, MEANING
from icha.asperity.material import WU_HOLDS_FROM
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.attributes import reasons_not_applicable
from icha.datasets.labels import LABELS
from icha.datasets.variables.campaign import COMPUTED_RUNS
from icha.support.formatting import format_count
from icha.surfaces.moments import RESOLVED_CELLS, cells_per_short_wave, error_of_cells

if TYPE_CHECKING:
    import xarray as xr

# Errors of the model in per cent, least and most of the means over the seeds, with adhesion and without: the summary of
# docs/validation.md, which is computed by campaign `validation`; a test compares them.
VALIDATION = {
    True: {"contact area": (-25.3, -8.1), "mean separation": (-36.1, -0.8)},
    False: {"contact area": (-21.4, -4.9), "mean separation": (-36.4, -0.8)},
}
_VALIDATED = "on seven self-affine surfaces, p* from 0.001 to 0.1 (page on validation)"

_RATIO = "full_contact_energy_ratio"

# Of single spots so many may lie outside the range of Wu's formula before it is said where: of every surface some do.
_FEW = 0.05
# So many cases are named.
_MOST_NAMES = 4


# --- surfaces and materials of the validation: study `short_range` of campaign `validation`, rounded outwards; a test
# compares them ---


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


# --- what is said of a campaign ---


class Statement(NamedTuple):
    """A line: what it is about, what it says, and whether all is as it was verified."""

    about: str
    text: str
    good: bool = True


class Case(NamedTuple):
    """A run, as far as it matters how well its model is known to hold.

    Parameters
    ----------
    model : name of the model.
    surface : name of the surface.
    material : name of the material.
    facts : values by the names of `VALIDATED`, the ratio of energies among them.
    """

    model: str
    surface: str
    material: str
    facts: Mapping[str, float]

    @property
    def ratio(self) -> float:
        """Elastic energy of full contact over the work of adhesion; infinite without adhesion."""
        return self.facts[_RATIO]


def statements(
    models: Mapping[str, Collection[str]],
    cases: Iterable[Case],
    outside: str | None = None,
    sticky: Collection[str] = (),
) -> list[Statement]:
    """What is to be known of the models of a campaign, one line of each kind.

    Parameters
    ----------
    models : those of every study.
    cases : the runs.
    outside : where jumps into contact lie outside what was verified, `named`; None if nothing jumps.
    sticky : materials on surfaces that stick to each other without load, as `in_words_if_sticky` names them.
    """
    cases = list(cases)
    found = [Statement("models", _used(models)), *_full_contact(cases)]
    if outside is not None:
        verified = f"Wu's distance is verified for Tabor parameters of {WU_HOLDS_FROM:g} and more"
        found.append(Statement("jump-in", f"{verified}; {outside or 'all cases inside'}", not outside))
    if sticky:
        text = f"attraction outweighs repulsion: {named(sticky)}; errors can be many times those of the validation"
        found.append(Statement("sticky", text, False))
    found += _resolution(cases)
    of_asperities = [case for case in cases if MODELS[case.model].by_summits]
    if of_asperities:
        found += [_surfaces(of_asperities), _accuracy(of_asperities)]
    return found


def _full_contact(cases):
    """The statement on the energy of full contact, where there is adhesion."""
    adhesive = [case for case in cases if case.ratio < math.inf]
    if not adhesive:
        return
    lowest = min(adhesive, key=lambda case: case.ratio)
    text = f"U_full/dgamma is about {lowest.ratio:.3g} or more ({lowest.material} on {lowest.surface}); {MEANING}"
    if any(MODELS[case.model].by_summits and case.ratio < FULL_CONTACT_BELOW for case in cases):
        text += f"; the asperity model is not applicable below {FULL_CONTACT_BELOW:g}"
    yield Statement("adhesion", text, lowest.ratio >= HIGH_PULL_OFF_BELOW)


def _resolution(cases):
    """The statement on boundary elements with few grid cells for the shortest waves."""
    few = {
        case.surface: cells
        for case in cases
        if MODELS[case.model].by_cells and error_of_cells(cells := case.facts.get("nodes_per_short_wave", math.inf))
    }
    if few:
        places = named(f"{cells:.2g} on {surface}" for surface, cells in few.items())
        text = (
            f"boundary elements have few grid cells for the shortest waves ({places}), with which areas are off by "
            f"{error_of_cells(min(few.values()))}; {RESOLVED_CELLS} recommended"
        )
        yield Statement("grid", text, False)


def _surfaces(cases):
    """The statement on what the surfaces are."""
    of_surface: dict[str, list] = {}
    for case in cases:
        of_surface.setdefault(case.surface, []).append(case.facts)
    described = (f"{name}: {surface_in_words(facts)}" for name, facts in of_surface.items())
    return Statement("surfaces", named(described, ". "))


def _accuracy(cases):
    """The statement on the error of asperities: known where surface and material are within the validation."""
    unknown, adhesive = {}, set()
    for case in cases:
        of_surface = outside_validation({name: case.facts[name] for name in case.facts if name != _RATIO})
        if of_surface:
            unknown.setdefault(case.surface, of_surface)
        elif of_material := outside_validation({_RATIO: case.ratio}):
            unknown.setdefault(f"{case.material} on {case.surface}", of_material)
        else:
            adhesive.add(case.ratio < math.inf)
    quoted = f"{_error(adhesive)} {_VALIDATED}" if adhesive else ""
    if not unknown:
        return Statement("accuracy", quoted)
    places = [f"{place}: {'; '.join(reasons)}" for place, reasons in unknown.items()]
    text = (
        f"nothing is known of the accuracy {'of the others' if adhesive else 'here'} ({named(places, '. ')}); "
        "`models: [asperities, boundary_elements]` would tell"
    )
    return Statement("accuracy", f"{quoted}; {text}" if quoted else text, False)


def named(cases: Iterable[str], between: str = ", ") -> str:
    """The first of some cases, and how many there are besides."""
    cases = list(cases)
    more = len(cases) - _MOST_NAMES
    return between.join(cases[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def of_dataset(campaign: xr.DataTree) -> list[Statement]:
    """The statements on what was computed; other than complete runs count as far as they went.

    Parameters
    ----------
    campaign : the campaign dataset; of one that is left in its file only a few variables are read.
    """
    models, cases, shares, sticky = {}, [], {}, {}
    for name, node in campaign.children.items():
        study = node.to_dataset()
        models[name] = [str(model) for model in study["model"].values]
        cases += _cases(study)
        if DEFAULT_MODEL not in models[name]:
            continue
        for surface, material, share in _outside(study):
            if share is not None:
                shares[surface, material] = max(share, shares.get((surface, material), 0.0))
                found = study["stickiness"].sel(surface=surface, material=material)
                sticky[surface, material] = max(float(found.max()), sticky.get((surface, material), 0.0))
    outside = _shares_in_words(shares) if shares else None
    return [*statements(models, cases, outside, in_words_if_sticky(sticky)), *_not_applicable(campaign)]


def _not_applicable(campaign):
    """The statement on the runs to which their model is not applicable."""
    reasons = sum(map(reasons_not_applicable, campaign.children.values()), Counter())
    if reasons:
        text = f"{format_count(reasons.total(), 'run')} to which the model is not applicable: {named(reasons, '. ')}"
        yield Statement("applicability", text, False)


def _cases(study):
    """The runs of a study that were computed."""
    measured = [name for name in VALIDATED if name in study]
    status = study["status"].transpose(*LABELS)
    values = {
        name: study[name].broadcast_like(status).transpose(*LABELS).values
        for name in (*measured, "grid", "asperity_count", "boundary")
    }
    unsupported = np.zeros(status.shape)
    if "unsupported_summit_count" in study:  # which campaigns of earlier versions lack
        unsupported = study["unsupported_summit_count"].broadcast_like(status).transpose(*LABELS).values
    labels = [study[label].values for label in LABELS]
    for at in map(tuple, np.argwhere(np.isin(status.values, COMPUTED_RUNS))):
        model, surface, _, _, material = (str(own[index]) for own, index in zip(labels, at, strict=True))
        facts = {name: float(values[name][at]) for name in measured}
        summits = values["asperity_count"][at] + unsupported[at]
        facts["nodes_per_short_wave"] = cells_per_short_wave(values["grid"][at], summits)
        facts["unsupported_summits"] = float(unsupported[at] / max(summits, 1))
        facts["free_edges"] = float(values["boundary"][at] != "periodic")
        yield Case(model, surface, material, facts)


def in_words_if_sticky(found: Mapping[tuple[str, str], float]) -> list[str]:
    """Those materials on surfaces whose stickiness (`icha.asperity.stickiness`) is above 1, by surface and material."""
    return [
        f"{material} on {surface} (stickiness {value:.2g})" for (surface, material), value in found.items() if value > 1
    ]


def _shares_in_words(shares):
    there = sorted(((share, *at) for at, share in shares.items() if share > _FEW), key=lambda each: -each[0])
    cases = [f"{material} on {surface} ({100 * share:.0f} % of single spots)" for share, surface, material in there]
    return f"outside: {named(cases)}" if cases else ""


def _outside(study):
    """Surface and material of contacts, and the largest share of single spots outside the range, over seeds and slopes.

    It is that at the end of the first loading; None without adhesion, where nothing jumps.
    """
    runs = study[["status", "leg", "outside_wu_fraction", "surface_energy"]].sel(model=DEFAULT_MODEL)
    status = runs["status"].transpose(*LABELS[1:]).values
    share, leg = (runs[name].transpose(*LABELS[1:], "step").values for name in ("outside_wu_fraction", "leg"))
    energy = runs["surface_energy"].values
    for s, surface in enumerate(runs["surface"].values):
        for m, material in enumerate(runs["material"].values):
            there = np.isin(status[s, ..., m], COMPUTED_RUNS)
            loadings = zip(share[s, ..., m, :][there], leg[s, ..., m, :][there] == 0, strict=True)
            ends = [own[loading][-1] for own, loading in loadings if loading.any()]
            if ends:
                yield str(surface), str(material), float(max(ends)) if energy[m] > 0 else None


def _used(models):
    """Which models compute which studies."""
    studies: dict[str, list[str]] = {}
    for study, own in models.items():
        for model in own:
            studies.setdefault(model, []).append(study)
    return "; ".join(f"{model.replace('_', ' ')} in {named(own)}" for model, own in studies.items())


def _error(adhesive):
    """How far asperities were found to be from boundary elements, with adhesion, without, or both."""
    quantities = ", ".join(f"{name} {_too_small(name, adhesive)}" for name in VALIDATION[True])
    return f"{quantities}, beside boundary elements"


def _too_small(quantity, adhesive):
    """The range of an error, of both kinds of contact if they differ."""
    # With adhesion first.
    first, *others = (_range(*VALIDATION[kind][quantity]) for kind in sorted(adhesive, reverse=True))
    if not others or others == [first]:
        return f"{first} too small"
    return f"{first} too small with adhesion and {others[0]} without"


def _range(low, high):
    return f"{-high:.0f} to {-low:.0f} %"
