"""The design of a campaign: which surface is pressed against which material in which study.

A study's lists are multiplied with each other, but for those that go along together (`zip`), or an explicit list
(`cases`) stands in their place. A surface or a material of which a parameter is varied becomes an entry of its own,
named after it: `rough-hurst0.6`.
"""

import hashlib
import itertools
import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any

from pydantic import ValidationError

from icha.configuration.campaign import BESIDE_STUDIES, Campaign, Contact
from icha.configuration.errors import MOST_TOLD
from icha.configuration.studies import MEASURED, SCALARS, Study
from icha.configuration.surfaces import SURFACE_KINDS, MaterialSection
from icha.datasets.labels import number_label
from icha.support.values import LONGEST_LABEL, NOTHING, Problem, Unit, listed

MAX_RUNS = 100_000
# Stops of the paths of all runs together.
_MAX_STOPS = 5_000_000
# Lists of a study, and what one of their entries is called in a case.
_LISTS = {"surfaces": "surface", "seeds": "seed", "rms_slopes": "rms_slope", "materials": "material"}
_SYMBOLS = {"m": "m", "Pa": "Pa", "J/m^2": "J"}
_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}

# Where a value of a point of the design stands in the configuration, and the value.
_Placed = tuple[tuple, Any]


def designed(campaign: Campaign, content: Mapping) -> tuple[Campaign, list[Problem]]:
    """The campaign with the runs of every study written out, and what is wrong with its studies' lists.

    Parameters
    ----------
    campaign : as written.
    content : the text that it was read from, as nested mappings: varied parameters are read like those in it.

    Returns
    -------
    The campaign and an empty list; or the campaign as it was and all problems. Slopes that are `measured` remain to be
    replaced (`Campaign.with_topographies`).
    """
    found = (
        problem for label, study in campaign.studies.items() for problem in _study_problems(campaign, label, study)
    )
    found = list(itertools.islice(found, MOST_TOLD + 1)) or list(_too_many(campaign))
    if found:
        return campaign, found
    variants = _Variants(campaign, content)
    contacts = {
        label: [variants.contact(point) for point in _points(label, study)] for label, study in campaign.studies.items()
    }
    if variants.problems:
        return campaign, list(variants.problems.values())
    grown = campaign.model_copy(
        update={
            "surfaces": dict(campaign.surfaces) | variants.derived["surfaces"],
            "materials": dict(campaign.materials) | variants.derived["materials"],
        }
    )
    grown = grown.with_contacts(contacts)
    grown._origins = variants.origin
    grown = _with_variants_for_their_origin(grown, variants.origin)
    found = list(_too_many_beside(grown))
    return (campaign, found) if found else (grown, [])


def _lists(label: str, study: Study) -> dict[str, list[_Placed]]:
    """What is multiplied in a study: lists and varied parameters, surfaces first."""
    at = ("studies", label)
    lists = {
        one: [((*at, many, index), value) for index, value in enumerate(getattr(study, many))]
        for many, one in _LISTS.items()
    }
    varied = study.vary.model_dump(exclude_none=True) if study.vary else {}
    for name, values in varied.items():
        lists[name] = [((*at, "vary", name, index), value) for index, value in enumerate(values)]
    of_material = MaterialSection.model_fields
    of_surface = (name for name in SCALARS if name not in of_material)
    names = ["surface", *of_surface, "seed", "rms_slope", "material", *of_material]
    return {name: lists[name] for name in names if name in lists}


def _points(label: str, study: Study) -> Iterator[dict[str, _Placed]]:
    """Everything that is named for one run, run by run."""
    lists = _lists(label, study)
    for index, given in enumerate(_cases(study)):
        fixed = {name: (("studies", label, "cases", index, name), value) for name, value in given.items()}
        axes = [
            [dict(zip(group, values, strict=True)) for values in zip(*(lists[name] for name in group), strict=True)]
            for group in _axes(study, lists, fixed)
        ]
        for parts in itertools.product(*axes):
            yield fixed | {name: placed for part in parts for name, placed in part.items()}


def _cases(study: Study) -> list[dict[str, Any]]:
    """Values that each case of a study fixes; one that fixes none where the study has no cases."""
    return [{}] if study.cases is None else [case.model_dump(exclude_none=True) for case in study.cases]


def _axes(study: Study, lists: Mapping, fixed: Mapping) -> Iterator[list[str]]:
    """Names of the lists that are multiplied with each other, those that go along together in one group."""
    groups = [[_LISTS.get(name, name) for name in group] for group in study.zip]
    done = set(fixed)
    for name in lists:
        if name not in done:
            group = next((group for group in groups if name in group), [name])
            group = [each for each in group if each not in fixed]
            done |= set(group)
            yield group


def _too_many(campaign: Campaign) -> Iterator[Problem]:
    """More runs, or stops of their paths, than can be planned; they are counted before any is written out."""
    runs = {label: _run_count(label, study) for label, study in campaign.studies.items()}
    stops = {}
    for label, study in campaign.studies.items():
        states = {*study.targets.states, *(campaign.snapshots_of(label) or ())}
        stops[label] = runs[label] * (len(states) + len(study.turning_points))
    yield from _excess("studies", runs, "runs", MAX_RUNS)
    yield from _excess("studies", stops, "stops of all its runs", _MAX_STOPS)


def _too_many_beside(campaign: Campaign) -> Iterator[Problem]:
    """More solutions beside the runs, which are written out, than can be planned."""
    for section in BESIDE_STUDIES:
        counts = {
            label: len(campaign.solved(entry)) * len(getattr(entry, "reduced_pressures", [0]))
            for label, entry in getattr(campaign, section).items()
            if entry.study in campaign.studies
        }
        yield from _excess(section, counts, "solutions", MAX_RUNS)


def _excess(section: str, counts: Mapping[str, int], what: str, most: int) -> Iterator[Problem]:
    """That entries of a section ask for more than `most`, each by itself or all of them together."""
    large = {label: count for label, count in counts.items() if count > most}
    for label, count in large.items():
        yield (section, label), NOTHING, f"asks for {count} {what}; allowed: {most} at most"
    if not large and sum(counts.values()) > most:
        yield (section,), NOTHING, f"ask for {sum(counts.values())} {what} together; allowed: {most} at most"


def _run_count(label: str, study: Study) -> int:
    """Number of runs of a study by all its models; those that turn out to be the same are counted each."""
    lists = _lists(label, study)
    counts = (math.prod(len(lists[group[0]]) for group in _axes(study, lists, given)) for given in _cases(study))
    return len(study.models) * sum(counts)


def _study_problems(campaign: Campaign, label: str, study: Study) -> Iterator[Problem]:
    at = ("studies", label)
    lists, cases = _lists(label, study), study.cases or []

    def values(one):
        """Places and values of a list, and of what cases have in the place of its entries."""
        placed = (((*at, "cases", index, one), getattr(case, one)) for index, case in enumerate(cases))
        return [*lists[one], *((place, value) for place, value in placed if value is not None)]

    for many, one in _LISTS.items():
        if not lists[one] and (not cases or any(getattr(case, one) is None for case in cases)):
            yield (*at, many), NOTHING, f"the key is missing; needed: {Study.model_fields[many].description}"
    for one, names in (("surface", campaign.surfaces), ("material", campaign.materials)):
        for place, name in values(one):
            if name not in names:
                yield place, name, f"is not defined; allowed: {listed(names)}"
    yield from _zip_problems(at, study, lists)
    for place, slope in values("rms_slope"):
        if slope != MEASURED:
            continue
        own = cases[place[3]].surface if place[2] == "cases" else None
        for name in [own] if own else study.surfaces:
            if name in campaign.surfaces and campaign.surfaces[name].random:
                reason = f"surface {name!r} is made at random and has no slope of its own; allowed: numbers"
                yield place, slope, reason


def _zip_problems(at, study, lists) -> Iterator[Problem]:
    seen = set()
    plural = {one: many for many, one in _LISTS.items()}
    allowed = ", ".join(plural.get(each, each) for each in lists)
    for index, group in enumerate(study.zip):
        lengths = {}
        for position, name in enumerate(group):
            place, one = (*at, "zip", index, position), _LISTS.get(name, name)
            if name in plural or one not in lists:
                yield place, name, f"is no list of this study; allowed: {allowed}"
                continue
            if one in seen:
                yield place, name, "is in two groups; allowed: every list in one group only"
            seen.add(one)
            lengths[name] = len(lists[one])
        if len(set(lengths.values())) > 1:
            said = ", ".join(f"{name} has {length}" for name, length in lengths.items())
            yield (*at, "zip", index), group, f"{said} entries; allowed: lists of the same length"


class _Variants:
    """Surfaces and materials of which a parameter is varied: made once each, whatever asks for them."""

    def __init__(self, campaign: Campaign, content: Mapping):
        self._campaign, self._content = campaign, content
        self._names: dict[tuple, str] = {}
        self.derived: dict[str, dict[str, Any]] = {"surfaces": {}, "materials": {}}
        self.origin: dict[tuple[str, str], str] = {}
        # By what was tried, so that a value that is wrong is named once.
        self.problems: dict[tuple, Problem] = {}

    def contact(self, point: Mapping[str, _Placed]) -> Contact:
        """The contact of a point of the design, its surface and material made if need be."""
        surface, material = point["surface"][1], point["material"][1]
        kind = type(self._campaign.surfaces[surface])
        varied = {name: point[name] for name in point if name in SCALARS}
        of_surface = {name: varied[name] for name in kind.model_fields if name in varied}
        of_material = {name: varied[name] for name in MaterialSection.model_fields if name in varied}
        for name, (location, value) in varied.items():
            if name not in of_surface and name not in of_material:
                kinds = ", ".join(k for k, section in SURFACE_KINDS.items() if name in section.model_fields)
                reason = f"surface {surface!r} is of another kind; allowed: kind {kinds}, or separate studies"
                self.problems[location[:4]] = (location[:4], value, reason)
        seed = point["seed"][1] if self._campaign.surfaces[surface].random else 0
        return Contact(
            self._variant("surfaces", surface, of_surface),
            seed,
            point["rms_slope"][1],
            self._variant("materials", material, of_material),
        )

    def _variant(self, section: str, base: str, changes: Mapping[str, _Placed]) -> str:
        if not changes:
            return base
        key = (section, base, *((name, repr(value)) for name, (_, value) in changes.items()))
        if key not in self._names:
            self._names[key] = self._made(section, base, changes)
        return self._names[key]

    def _made(self, section: str, base: str, changes: Mapping[str, _Placed]) -> str:
        entries = getattr(self._campaign, section)
        values = {name: value for name, (_, value) in changes.items()}
        try:
            made = type(entries[base]).model_validate(dict(self._content[section][base]) | values)
        except ValidationError as error:
            for details in error.errors():
                self._add_problem(base, changes, details)
            return base
        if hasattr(made, "path"):
            made = made.model_copy(update={"path": entries[base].path})
        name = "-".join([base, *(f"{key}{value_label(made, key)}" for key in changes)])
        location, value = next(iter(changes.values()))
        if name in entries:
            reason = f"gives {base!r} a variant named {name!r}, but this name is taken; allowed: rename that entry"
            self.problems[(section, name)] = (location, value, reason)
        if len(name) > LONGEST_LABEL:
            reason = f"gives {base!r} a variant with a name of {len(name)} letters, which files cannot have"
            self.problems[(section, name)] = (location, value, f"{reason}; allowed: {LONGEST_LABEL} at most")
        self.derived[section][name] = made
        self.origin[section, name] = base
        return name

    def _add_problem(self, base, changes, details):
        key = str(details["loc"][0]) if details["loc"] else ""
        context = details.get("ctx", {})
        reason = str(context.get("error") or f"{details['msg']}; allowed: {context.get('expected', 'see its key')}")
        location, value = changes.get(key) or next(iter(changes.values()))
        if key not in changes:  # a parameter of the surface that does not go with the one that is varied
            reason = f"{key} of {base!r}: {details['input']!r} {reason}"
        self.problems.setdefault(location, (location, value, reason))


def value_label(section, name: str) -> str:
    """How the value of a parameter is written in names of files: `hurst0.6`, `interaction_range40nm`."""
    value = getattr(section, name)
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, float):
        text = str(value)
        # Text of all kinds, the name of a channel for one, is no name of a file.
        return text if re.fullmatch(r"[A-Za-z0-9_.+-]{1,40}", text) else hashlib.sha256(text.encode()).hexdigest()[:8]
    unit = next((each.si for each in type(section).model_fields[name].metadata if isinstance(each, Unit)), None)
    if unit is None:
        return number_label(value)
    exact = Decimal(repr(value))
    power = 3 * (exact.adjusted() // 3) if exact else 0
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    digits = format(exact.scaleb(-power).normalize(), "f")
    return f"{digits}{_PREFIXES[power]}{_SYMBOLS[unit]}"


def _with_variants_for_their_origin(campaign: Campaign, origin: Mapping[tuple[str, str], str]) -> Campaign:
    """The campaign in which whatever names a surface or material that is varied means its variants."""

    def variants(section, study, name):
        there = getattr(campaign.studies[study], section) if study in campaign.studies else []
        found = [each for each in there if origin.get((section, each)) == name] if name not in there else []
        return found or [name]

    def entry_with_variants(entry):
        named = {section: getattr(entry, section) for section in ("surfaces", "materials")}
        update = {
            section: [each for name in names for each in variants(section, entry.study, name)]
            for section, names in named.items()
            if names is not None
        }
        return entry.model_copy(update=update)

    def figure_with_variant(figure):
        named = {key: getattr(figure, key, None) for key in ("surface", "material")}
        update = {key: variants(f"{key}s", figure.study, name)[0] for key, name in named.items() if name is not None}
        return figure.model_copy(update=update)

    update: dict[str, Any] = {
        section: {label: entry_with_variants(entry) for label, entry in getattr(campaign, section).items()}
        for section in BESIDE_STUDIES
    }
    figures = {name: figure_with_variant(figure) for name, figure in campaign.figures.drawn().items()}
    return campaign.model_copy(update=update | {"figures": campaign.figures.model_copy(update=figures)})
