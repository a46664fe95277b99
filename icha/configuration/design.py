"""Expand each study of a campaign into runs: combinations of surfaces, seeds, slopes and materials.

A study runs all combinations of the entries of its lists. A value in `cases` replaces the list of the same parameter.
Each combination of varied parameters defines a new surface or material, called a variant, with a name such as
`rough-hurst0.6`.
"""

import hashlib
import itertools
import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any

from pydantic import ValidationError

from icha.configuration.campaign import Campaign
from icha.configuration.errors import MOST_PROBLEMS, problem_of
from icha.configuration.samples import RULES
from icha.configuration.studies import MEASURED, RmsHeight, Study, slope_of_height
from icha.configuration.surfaces import PARAMETERS, SURFACE_KINDS, MaterialSection
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.labels import RunLabels, coarse_study, inputs_study, is_derived_study, number_label
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS
from icha.support.units import PREFIXES
from icha.support.values import LONGEST_LABEL, NOTHING, Folders, Problem, list_names

MAX_RUNS = 100_000
# Largest number of targets of all runs together.
_MAX_TARGETS = 5_000_000
# Keys of the lists of a study, and the corresponding keys of a case.
_LISTS = {"surfaces": "surface", "seeds": "seed", "rms_slopes": "rms_slope", "materials": "material"}
# Order of the lists of a study. The last list changes fastest from run to run.
_OF_MATERIAL = MaterialSection.model_fields
_ORDER = ("surface", *(name for name in PARAMETERS if name not in _OF_MATERIAL), "seed", "rms_slope", "material")
_ORDER += tuple(_OF_MATERIAL)

# Name under which a point of a sample has the name of its case. The case is part of the names of its variants, because
# names with the values of all parameters would be long.
_CASE = "case"
# Location of a value in the configuration, and the value.
_Located = tuple[tuple, Any]


def expand_design(campaign: Campaign, content: Mapping, folders: Folders) -> tuple[Campaign, list[Problem]]:
    """Return the campaign with all runs of every study, and the problems that prevented the expansion.

    Variants of surfaces and materials are made from `content`, the configuration as nested mappings, and validated with
    the context `folders`. `Campaign.with_topographies` later replaces `measured` slopes by numbers.
    """
    problems = itertools.chain.from_iterable(
        _study_problems(campaign, label, study) for label, study in campaign.studies.items()
    )
    problems = list(itertools.islice(problems, MOST_PROBLEMS + 1)) or list(_too_many_runs(campaign))
    if problems:
        return campaign, problems
    variants = _Variants(campaign, content, folders)
    runs, studies = {}, {}
    for label, study in campaign.studies.items():
        levels = study.seeds_of_levels
        if study.sample is not None and levels is not None:
            # The sampled parameters have one seed, and the fastest of the models of the levels.
            models = [DEFAULT_MODEL if levels.asperities else REFERENCE_MODEL]
            one = {"levels": None, "accuracy": None, "seeds": [min(levels.seeds)], "models": models}
            sampled, name = study.model_copy(update=one), inputs_study(label)
            runs[name] = [variants.run(name, sampled.models[0], point) for point in _points(label, sampled)]
            studies[name] = sampled
            study = study.model_copy(update={"sample": None})
        of_model = [variants.run(label, study.models[0], point) for point in _points(label, study)]
        runs[label] = [run._replace(model=model) for model in study.models for run in of_model]
        studies[label] = study
        if study.error_check and levels is None:
            first = {run._replace(seed=0): run for run in reversed(of_model)}
            runs[label] += [run._replace(model=REFERENCE_MODEL) for run in of_model if run in first.values()]
        if levels is not None:
            runs |= _runs_of_levels(label, levels, of_model, variants)
            if levels.coarse:
                studies[coarse_study(label)] = study.model_copy(update={"levels": None, "accuracy": None})
    if variants.problems:
        return campaign, list(variants.problems.values())
    sections = {name: getattr(campaign, name) | derived for name, derived in variants.derived.items()}
    expanded = campaign.model_copy(update=sections | {"studies": studies}).with_runs(runs)
    expanded._origins = variants.origin
    return expanded, []


def _runs_of_levels(label, levels, of_model, variants):
    """Return the runs of the studies that compute the levels of a study, by name; `of_model` has runs of one model."""
    level_of_model = {DEFAULT_MODEL: set(levels.asperities or ()), REFERENCE_MODEL: set(levels.fine)}
    seeds_of_model = level_of_model.items()
    runs = {label: [run._replace(model=m) for m, seeds in seeds_of_model for run in of_model if run.seed in seeds]}
    if levels.coarse:
        of_level = (run._replace(model=REFERENCE_MODEL) for run in of_model if run.seed in set(levels.coarse))
        runs[coarse_study(label)] = [variants.on_half_grid(run) for run in of_level]
    return runs


def _lists(label: str, study: Study) -> dict[str, list[_Located]]:
    """Return the lists and varied parameters of a study in the order `_ORDER`, in which surfaces come first."""

    def located(values, *keys):
        return [(("studies", label, *keys, index), value) for index, value in enumerate(values)]

    varied = study.vary.model_dump(exclude_none=True) if study.vary else {}
    lists = {one: located(getattr(study, many), many) for many, one in _LISTS.items()}
    if (levels := study.seeds_of_levels) is not None:
        lists["seed"] = located(levels.seeds, _key_of_levels(study))
    if study.rms_heights is not None:
        heights = [RmsHeight(value) for value in study.rms_heights]
        lists["rms_slope"] = located(heights, "rms_heights")
    # Smooth surfaces have no slopes. One entry instead of none, so that there is one run for each seed and material.
    lists["rms_slope"] = lists["rms_slope"] or [(("studies", label, "rms_slopes"), None)]
    lists |= {name: located(values, "vary", name) for name, values in varied.items()}
    return {name: lists[name] for name in _ORDER if name in lists}


def _points(label: str, study: Study) -> Iterator[dict[str, _Located]]:
    """Yield the parameters of each run of a study, each value with its location in the configuration."""
    lists, sampled = _lists(label, study), study.sample is not None
    for index, given in enumerate(_cases(study)):
        place = ("sample", "parameters") if sampled else ("cases", index)
        fixed = {name: (("studies", label, *place, name), value) for name, value in given.items()}
        if sampled:
            fixed[_CASE] = ("studies", label, "sample"), f"{label}-case{index}"
        free = [name for name in lists if name not in fixed]
        for chosen in itertools.product(*(lists[name] for name in free)):
            yield fixed | dict(zip(free, chosen, strict=True))


def _cases(study: Study) -> list[dict[str, Any]]:
    """Return the values of each case of a study; a study without `cases` and `sample` has one case without values."""
    if study.sample is not None:
        return study.sample.cases
    return [{}] if study.cases is None else [case.model_dump(exclude_none=True) for case in study.cases]


def _too_many_runs(campaign: Campaign) -> Iterator[Problem]:
    """Yield a problem if a campaign that is not yet expanded has too many runs or targets."""
    runs = targets = 0
    for label, study in campaign.studies.items():
        # A run that occurs twice counts twice.
        lists = _lists(label, study)
        counts = (math.prod(len(lists[name]) for name in lists if name not in given) for given in _cases(study))
        count, states = len(study.models) * sum(counts), {*study.targets.states, *(study.saved_states or ())}
        runs, targets = runs + count, targets + count * (len(states) + len(study.turning_points))
    for count, what, most in ((runs, "runs", MAX_RUNS), (targets, "targets of all runs", _MAX_TARGETS)):
        if count > most:
            yield ("studies",), NOTHING, f"defines {count} {what}; expected at most {most}"


def _study_problems(campaign: Campaign, label: str, study: Study) -> Iterator[Problem]:
    prefix = ("studies", label)
    lists, cases = _lists(label, study), study.cases or []

    def values(one):
        """Return all values of the parameter `one` with their locations: values in its list, and values in `cases`."""
        located = (((*prefix, "cases", index, one), getattr(case, one)) for index, case in enumerate(cases))
        return [*lists[one], *((location, value) for location, value in located if value is not None)]

    surfaces = [campaign.surfaces.get(name) for _, name in values("surface")]
    sampled, smooth = _samples_slopes(study), all(surface and surface.smooth for surface in surfaces)
    for many, one in _LISTS.items():
        needed = not cases or any(getattr(case, one) is None for case in cases)
        if one == "rms_slope" and (sampled or smooth or study.rms_heights is not None):
            needed = False
        if needed and not getattr(study, many):
            description = " ".join(str(Study.model_fields[many].description).split())
            yield (*prefix, many), NOTHING, f"the key is missing; expected: {description}"
    if study.rms_heights is not None and study.rms_slopes and not sampled:
        yield (*prefix, "rms_slopes"), study.rms_slopes, "is given beside `rms_heights`; expected one of both"
    for one, names in (("surface", campaign.surfaces), ("material", campaign.materials)):
        for location, name in values(one):
            if name not in names:
                yield location, name, f"is not defined; expected one of {list_names(names)}"
    if study.sample is not None:
        yield from _sample_problems(prefix, study)
    if is_derived_study(label, campaign.studies):
        reason = "is the name of runs that ICHA adds to another study; expected a name without -coarse or -inputs"
        yield prefix, NOTHING, reason
    if study.error_check and list(study.models) != [DEFAULT_MODEL]:
        reason = "needs `models: [asperities]`, because other studies measure the error anyway. Remove the key"
        yield (*prefix, "error_check"), True, reason
    if study.seeds_of_levels is not None:
        yield from _level_problems(campaign, label, study, [name for _, name in values("surface")])
    for location, slope in values("rms_slope"):
        if slope != MEASURED:
            continue
        surface = cases[location[3]].surface if location[2] == "cases" else None
        for name in [surface] if surface else study.surfaces:
            if name in campaign.surfaces and campaign.surfaces[name].random and not campaign.surfaces[name].from_file:
                yield location, slope, f"needs a measured surface, but {name!r} is random; expected numbers"


def _samples_slopes(study):
    """Return whether all rms slopes of a study are sampled; the levels of accuracy need an rms slope of their own."""
    sampled = study.sample is not None and "rms_slope" in study.sample.distributions
    return sampled and study.seeds_of_levels is None


def _sample_problems(prefix, study):
    """Yield the problems of the key `sample` of a study."""
    for key in ("vary", "cases"):
        if getattr(study, key):
            reason = "is given beside `sample`; expected one of both. Remove the key, or use separate studies"
            yield (*prefix, key), NOTHING, reason
    heights = study.rms_slopes + (study.rms_heights or [])
    if _samples_slopes(study) and heights:
        key = "rms_slopes" if study.rms_slopes else "rms_heights"
        yield (*prefix, key), heights, "is given beside `rms_slope` in `sample`; expected one of both"
    counts = {"surfaces": study.surfaces, "materials": study.materials}
    counts["rms_heights" if study.rms_heights else "rms_slopes"] = heights
    for key, values in counts.items():
        if len(values) > 1:
            reason = "has several entries, but every case of `sample` has one; expected one entry, or separate studies"
            yield (*prefix, key), values, reason
    for location, value, reason in study.sample.problems():
        yield (*prefix, "sample", *location), value, reason


def _level_problems(campaign, label, study, surfaces):
    """Yield the problems of the key `levels` of a study."""
    given = _key_of_levels(study)
    location = ("studies", label, given)
    for key in ("seeds", "models"):
        if key in study.model_fields_set:
            reason = f"is given beside `{given}`, which determines it. Remove the key"
            yield (*location[:2], key), getattr(study, key), reason
    for name in dict.fromkeys(surfaces):
        if name not in campaign.surfaces:
            continue
        if not campaign.surfaces[name].random:
            reason = f"the key needs random surfaces, but {name!r} has no seeds; expected only random surfaces"
            yield location, NOTHING, reason
    quantity = study.accuracy and study.accuracy.quantity
    if quantity in ESTIMATED_OF_LOOPS and not study.unload:
        yield (*location, "quantity"), quantity, "is a quantity of a loop; expected `unload: true` in this study"
    elif study.targets.last[0] in ESTIMATED_AT_TARGETS.get(quantity, ()):
        reason = "is prescribed by the targets of the study; expected another quantity"
        yield (*location, "quantity"), quantity, reason


def _key_of_levels(study):
    """Return the name of the key of a study that determines its levels."""
    return "accuracy" if study.levels is None else "levels"


class _Variants:
    """Variants: surfaces and materials with varied parameters, one for each combination of values."""

    def __init__(self, campaign: Campaign, content: Mapping, folders: Folders):
        self._campaign, self._content, self._folders = campaign, content, folders
        self._names: dict[tuple, str] = {}
        self.derived: dict[str, dict[str, Any]] = {"surfaces": {}, "materials": {}}
        self.origin: dict[tuple[str, str], str] = {}
        # Changes that made a variant, by the name of the variant.
        self._changes: dict[str, dict[str, _Located]] = {}
        # Problems by location, so that each wrong value is reported once.
        self.problems: dict[tuple, Problem] = {}

    def run(self, study: str, model: str, point: Mapping[str, _Located]) -> RunLabels:
        """Return the labels of a run; create the variants of surface and material that the run needs."""
        surface, material = point["surface"][1], point["material"][1]
        fields = type(self._campaign.surfaces[surface]).model_fields
        varied = {name: point[name] for name in point if name in PARAMETERS}
        of_surface = {name: varied[name] for name in fields if name in varied}
        of_material = {name: varied[name] for name in _OF_MATERIAL if name in varied}
        for name, (location, value) in varied.items():
            if name in of_surface or name in of_material:
                continue
            kinds = ", ".join(k for k, section in SURFACE_KINDS.items() if name in section.model_fields)
            reason = f"is not a key of surface {surface!r}; expected only surfaces of kind {kinds}, or separate studies"
            self.problems[location[:4]] = (location[:4], value, reason)
        case = point[_CASE][1] if _CASE in point else None
        section, slope = self._campaign.surfaces[surface], point["rms_slope"][1]
        variant = self._variant("surfaces", surface, of_surface, case)
        if section.smooth:
            slope = 0.0
        elif not section.from_file and isinstance(slope, RmsHeight):
            random = self.derived["surfaces"].get(variant, section)
            slope = slope_of_height(slope, random.rms_height_at_unit_slope)
        seed = point["seed"][1] if section.random else 0
        return RunLabels(study, model, variant, seed, slope, self._variant("materials", material, of_material, case))

    def on_half_grid(self, run: RunLabels) -> RunLabels:
        """Return the run of the coarse study on the same surface with half the number of nodes along each side."""
        every = self._campaign.surfaces | self.derived["surfaces"]
        base, grid = run.surface, every[run.surface].grid
        half = (("studies", run.study, _key_of_levels(self._campaign.studies[run.study])), grid // 2)
        origin = self.origin.get(("surfaces", base), base)
        changes = {name: value for name, value in self._changes.get(base, {}).items() if name != "grid"}
        surface = self._variant("surfaces", origin, changes | {"grid": half})
        return run._replace(study=coarse_study(run.study), surface=surface)

    def _variant(self, section: str, base: str, changes: Mapping[str, _Located], case: str | None = None) -> str:
        """Return the name of a variant: a surface or material with changed values. Create the variant if it is new."""
        key = (section, base, case, *((name, repr(value)) for name, (_, value) in changes.items()))
        if changes and key not in self._names:
            self._names[key] = self._make(section, base, changes, case)
        return self._names[key] if changes else base

    def _make(self, section: str, base: str, changes: Mapping[str, _Located], case: str | None) -> str:
        entries = getattr(self._campaign, section)
        values = {name: value for name, (_, value) in changes.items()}
        try:
            changed = dict(self._content[section][base]) | values
            variant = type(entries[base]).model_validate(changed, context=self._folders)
        except ValidationError as error:
            for keys, wrong, reason in map(problem_of, error.errors()):
                key = str(keys[0]) if keys else ""
                location, value = changes.get(key) or next(iter(changes.values()))
                if key not in changes:  # the varied parameter is inconsistent with another parameter of the surface
                    reason = f"{key} of {base!r}: {wrong!r} {reason}" if key else f"{base!r}: {reason}"
                self.problems.setdefault(location, (location, value, reason))
            return base
        if "poisson_ratio" in changes and not variant.reads_poisson_ratio:
            reason = f"has no effect, because {base!r} is a half-space with a given contact modulus; expected "
            reason += "`youngs_modulus` instead of `contact_modulus`, or a layer with `thickness`. Or remove the key"
            location, value = changes["poisson_ratio"]
            self.problems.setdefault(location, (location, value, reason))
        name = "-".join([base, *([case] if case else (f"{key}{value_label(variant, key)}" for key in changes))])
        if name in entries or len(name) > LONGEST_LABEL:
            reason = f"makes a variant of {base!r} with the name {name!r}; expected a name that no other entry has, and"
            reason += f" at most {LONGEST_LABEL} characters. Rename an entry"
            self.problems[section, name] = (*next(iter(changes.values())), reason)
        self.derived[section][name] = variant
        self._changes[name] = dict(changes)
        self.origin[section, name] = base
        return name


def value_label(section, name: str) -> str:
    """Format the value of a parameter for names, such as 0.6 in `hurst0.6` and 40nm in `interaction_range40nm`."""
    value = getattr(section, name)
    if not isinstance(value, float):
        text = str(value)
        # If a text cannot be part of a file name, such as the name of a channel, its checksum is used instead.
        return text if re.fullmatch(r"[A-Za-z0-9_.+-]{1,40}", text) else hashlib.sha256(text.encode()).hexdigest()[:8]
    unit = RULES[name].unit if name in RULES else "1"
    if unit == "1":
        return number_label(value)
    exact = Decimal(repr(value))
    power = 3 * (exact.adjusted() // 3) if exact else 0
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    digits = format(exact.scaleb(-power).normalize(), "f")
    return f"{digits}{PREFIXES[power].replace('µ', 'u')}{unit.split('/')[0]}"


def varied_values(campaign: Campaign) -> dict[str, dict[str, tuple[str, str, dict]]]:
    """Return, for each study, the varied parameters by name: label (surface or material), unit, and value by label."""
    found: dict[str, dict[str, tuple[str, str, dict]]] = {}
    for label, study in campaign.studies.items():
        given = [study.vary, *(study.cases or ()), study.sample and study.sample.parameters]
        names = dict.fromkeys(
            name for each in given if each for name in PARAMETERS if getattr(each, name, None) is not None
        )
        for name in names:
            of_material = name in _OF_MATERIAL
            entries = campaign.materials if of_material else campaign.surfaces
            shown = study.materials if of_material else study.surfaces
            values = {each: getattr(entries[each], name, None) for each in shown}
            found.setdefault(label, {})[name] = "material" if of_material else "surface", _unit_in_cf(name), values
    return found


def sampled_parameters(campaign: Campaign) -> dict[str, tuple[list[tuple], dict[str, tuple]]]:
    """Return surface, rms slope and material of each case of the studies with `sample`, and the sampled parameters.

    For each parameter: unit, kind and numbers of its distribution, and its value in each case.
    """
    found = {}
    for label, study in campaign.studies.items():
        if study.sample is None:
            continue
        cases = [(each.surface, each.rms_slope, each.material) for each in campaign.contacts(label)]
        values = study.sample.values
        found[label] = (
            list(dict.fromkeys(cases)),
            {
                name: (_unit_in_cf(name), *distribution, [case[name] for case in values])
                for name, distribution in study.sample.distributions.items()
            },
        )
    return found


def _unit_in_cf(name):
    """Return the SI unit of a parameter in the notation of CF."""
    return RULES[name].unit.replace("/m^2", " m^-2") if name in RULES else "1"
