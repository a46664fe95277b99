"""Statements on the validity of the models: the verified range of each model, and the size of its errors.

Checks verify that equations were solved. Statements of validity describe how accurate the models are. ICHA prints these
short statements before and after a campaign runs, and at the top of the report of the campaign.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import NamedTuple

from icha.asperity.full_contact import HIGH_PULL_OFF_BELOW, MEANING, expected_behaviour
from icha.asperity.material import WU_HOLDS_FROM
from icha.asperity.tabor import SHORT_RANGE_FROM, describe_short_range
from icha.contact.models import MODELS
from icha.path.targets import MAX_AREA_FRACTION, largest_area_fraction
from icha.support.formatting import format_quantity, join_first
from icha.surfaces.resolution import LEAST_CELLS, RECOMMENDED_CELLS, Resolution
from icha.uncertainty.grid_error import describe_loops, is_resolved

# Relative errors of the asperity model in per cent, with adhesion (True) and without (False): lowest and highest mean
# over the seeds. Campaign `validation` computes these errors. A test compares them with the page docs/validation.md.
VALIDATION = {
    True: {"contact area": (-25.3, -8.1), "mean separation": (-36.1, -0.8)},
    False: {"contact area": (-21.5, -4.9), "mean separation": (-36.4, -0.8)},
}
_VALIDATED = "on seven self-affine surfaces, p* from 0.001 to 0.1 (page on validation)"

_RATIO = "full_contact_energy_ratio"
# Smallest distance between cells for which a recommendation makes sense, m.
_ATOM = 1e-10
# Keys of `Case.facts` that may be missing. The first four are in Pa: pressure for complete contact, strength of the
# interface, strength without flaws, and largest tension that the grid resolves. The other three are in m: size of the
# grid cells, rms height, and largest rms height of a sticky surface in the bearing area model.
COMPLETE_PRESSURE, STRENGTH, THEORETICAL = "complete_contact_pressure", "interface_strength", "theoretical_strength"
RESOLVED, SPACING = "resolved_tension", "spacing"
TABOR = "tabor_parameter"
RMS_HEIGHT, STICKY_HEIGHT = "rms_height", "sticky_rms_height"
# 1 for a surface with a shape, otherwise 0. Ratio of the works of adhesion of receding and advancing edges.
SHAPED, DIRECTION = "shaped", "direction"


# Ranges of quantities in study `short_range` of campaign `validation`, rounded outwards: name in messages, smallest and
# largest value. A test compares these ranges with the campaign.
VALIDATED = {
    # Surfaces in the validation have 1, because their amplitudes are fixed. Random amplitudes give values up to 1.2.
    "slope_anisotropy": ("anisotropy of slopes", 1.0, 1.2),
    "height_skewness": ("skewness of heights", -0.2, 0.2),
    "height_kurtosis": ("kurtosis of heights", 2.3, 3.5),
    # The validation begins at 3.3. Smaller values are included, because narrow spectra have fewer unions of spots.
    # Isotropic surfaces have 1.5 or more.
    "nayak_parameter": ("Nayak's parameter", 1.5, 47.0),
    # Surfaces in the validation have at most 0.005.
    "unsupported_summits": ("share of unsupported summits", 0.0, 0.01),
    # Surfaces in the validation have at least 8; estimates for measured surfaces are up to 14 % too small. The upper
    # limit is infinite, because a finer grid does not increase the error.
    "nodes_per_short_wave": ("cells per shortest wave", 6.9, math.inf),
    "full_contact_energy_ratio": ("U_full/dgamma", 76.0, math.inf),
    # 1 for a single square, 0 for a periodic surface.
    "free_edges": ("free edges (0 with `boundary: window`)", 0, 0),
}


def outside_validation(facts: Mapping[str, float]) -> list[str]:
    """Describe each quantity outside the range of the validation; `facts` are values by key of `VALIDATED`."""
    return [
        f"{words} {facts[name]:.4g}, validated: {least:g} {'and more' if most == math.inf else f'to {most:g}'}"
        for name, (words, least, most) in VALIDATED.items()
        if name in facts and not least <= facts[name] <= most
    ]


class Statement(NamedTuple):
    """One line on the validity of a campaign.

    Attributes
    ----------
    about : subject of the line.
    text : the statement.
    good : True if the campaign is within the verified range; False makes the line a warning.
    """

    about: str
    text: str
    good: bool = True


class Case(NamedTuple):
    """Quantities of a run on which the validity of the model depends.

    Attributes
    ----------
    model, surface, material : names.
    facts : values of quantities by key of `VALIDATED`; also quantities of full contact and of the grid, if known.
    resolution : number of grid cells in the shortest wave, or in the smallest contact radius of a smooth shape.
    """

    model: str
    surface: str
    material: str
    facts: Mapping[str, float]
    resolution: Resolution

    @property
    def ratio(self) -> float:
        """Elastic energy of full contact divided by the work of adhesion; infinite without adhesion."""
        return self.facts[_RATIO]


def statements(
    models: Mapping[str, Collection[str]],
    cases: Iterable[Case],
    outside: str | None = None,
    sticky: Collection[str] = (),
    loops: Mapping[tuple[str, str], float] = {},
) -> list[Statement]:
    """Return statements on the validity of the models of a campaign, one line for each subject.

    Parameters
    ----------
    models : names of the models of each study.
    outside : surfaces and materials whose jumps into contact are outside the verified range; None without adhesion.
    sticky : surfaces and materials whose attraction outweighs repulsion, from `describe_sticky`.
    loops : cells in the length of loops by boundary elements (`icha.uncertainty.grid_error.cells_of_loops`).
    """
    cases, studies = list(cases), {}
    for study, names in models.items():
        for model in names:
            studies.setdefault(model.replace("_", " "), []).append(study)
    used = "; ".join(f"{model} in {join_first(names)}" for model, names in studies.items())
    found = [Statement("models", used), *_full_contact(cases)]
    if outside is not None:
        verified = f"Wu's distance is verified for Tabor parameters of {WU_HOLDS_FROM:g} and more"
        found.append(Statement("jump-in", f"{verified}; {outside or 'all runs are in this range'}", not outside))
    if sticky:
        text = f"attraction outweighs repulsion: {join_first(sticky)}; errors can be many times those of the validation"
        found.append(Statement("sticky", text, False))
    found += [*_resolution(cases), *_attraction(cases)]
    if loops:
        found.append(Statement("loops", describe_loops(loops), is_resolved(loops)))
    of_asperities = [case for case in cases if MODELS[case.model].by_summits]
    if of_asperities:
        found.append(_accuracy(of_asperities, len(of_asperities) < len(cases)))
    return found


def _full_contact(cases):
    """Yield the statement on full contact for the run with the strongest adhesion, if any run has adhesion."""
    # The contact of an indenter stays smaller than the surface.
    adhesive = [case for case in cases if case.ratio < math.inf and not case.facts.get(SHAPED)]
    if not adhesive:
        return
    lowest = min(adhesive, key=lambda case: case.ratio)
    receding = lowest.ratio / lowest.facts.get(DIRECTION, 1.0)
    text = (
        f"{expected_behaviour(lowest.ratio, receding)}; U_full/dgamma is about {lowest.ratio:.3g} or more "
        f"({lowest.material} on {lowest.surface}); {MEANING}"
    )
    if COMPLETE_PRESSURE in lowest.facts:
        pressures = (
            lowest.facts[COMPLETE_PRESSURE],
            lowest.facts[COMPLETE_PRESSURE] - lowest.facts[STRENGTH],
            lowest.facts[STRENGTH],
        )
        complete, opening, strength = (format_quantity(float(f"{pressure:.2g}"), "Pa") for pressure in pressures)
        if lowest.facts[STRENGTH] < lowest.facts[THEORETICAL]:
            strength += f" with its flaw, {format_quantity(lowest.facts[THEORETICAL], 'Pa')} without the flaw"
        text += (
            f"; contact is complete at about {complete} without adhesion; full contact opens at about {opening} "
            f"(strength of the interface: {strength}){_unresolved_strength(lowest.facts)}"
        )
    if STICKY_HEIGHT in lowest.facts:
        heights = (format_quantity(lowest.facts[name], "m") for name in (STICKY_HEIGHT, RMS_HEIGHT))
        text += "; in the bearing area model, the surface sticks below the rms height {}; its rms height is {}".format(
            *heights
        )
    ratios = [case.ratio for case in adhesive if MODELS[case.model].by_summits]
    limit = largest_area_fraction(min(ratios, default=math.inf))
    if limit < MAX_AREA_FRACTION:
        text += f"; the asperity model is applicable up to the contact area A/A0 = {limit:.2g}"
    if any(case.facts.get(SHAPED) for case in cases):
        text += "; surfaces with a shape are left out"
    yield Statement("adhesion", text, receding >= HIGH_PULL_OFF_BELOW and limit >= MAX_AREA_FRACTION)


def _unresolved_strength(facts):
    """Describe the largest tension that the grid resolves; "" if the grid resolves the strength of the interface."""
    if not 0 < facts.get(RESOLVED, math.inf) < facts[STRENGTH]:
        return ""
    needed = facts[SPACING] * (facts[RESOLVED] / facts[STRENGTH]) ** 2
    cells = f"cells of {format_quantity(needed, 'm')} would resolve" if needed > _ATOM else "no practical grid resolves"
    resolved = format_quantity(facts[RESOLVED], "Pa")
    return f"; at the edge of contact the grid resolves tensions up to {resolved}; {cells} the strength"


def _resolution(cases):
    """Yield the statement on surfaces for which a contact model has few grid cells in the shortest length."""
    few: dict[str, Resolution] = {}
    for case in cases:
        enough = RECOMMENDED_CELLS if MODELS[case.model].by_cells else LEAST_CELLS
        if not case.resolution.reaches(enough):
            few[case.surface] = min(case.resolution, few.get(case.surface, case.resolution))
    if few:
        surfaces = join_first((f"{surface} has {resolution}" for surface, resolution in few.items()), "; ")
        text = (
            f"few grid cells: {surfaces}; the error of areas is {min(few.values()).error}; "
            f"{RECOMMENDED_CELLS} cells are recommended"
        )
        yield Statement("grid", text, False)


def _attraction(cases):
    """Yield the statements on boundary elements at a finite range, and in the limit of a short range if it is long."""
    lowest: dict[str, float] = {}
    finite: dict[str, None] = {}
    for case in (case for case in cases if MODELS[case.model].by_cells):
        value, name = case.facts.get(TABOR, math.inf), f"{case.material} on {case.surface}"
        if 0 < case.facts.get(STRENGTH, 0.0) <= case.facts.get(RESOLVED, 0.0):
            finite[name] = None
        elif value < SHORT_RANGE_FROM:
            lowest[name] = min(value, lowest.get(name, math.inf))
    if finite:
        others = "; other boundary elements are in the limit of a short range"
        yield Statement("finite range", f"the grid resolves the range of attraction of {join_first(finite)}{others}")
    if lowest:
        text = join_first((f"{name}: {describe_short_range(value)}" for name, value in lowest.items()), ". ")
        assumed = (
            "where the grid does not resolve the range of attraction, boundary elements assume Tabor parameters of "
        )
        text = f"{assumed}{SHORT_RANGE_FROM:g} and more; {text}"
        yield Statement("short range", text, False)


def _accuracy(cases, measured):
    """Return the statement on the error of the asperity model; the error is known only in the range of the validation.

    `cases` are runs of the asperity model. `measured` is True if the campaign also has runs with boundary elements.
    """
    unknown, adhesive = {}, set()
    for case in cases:
        of_surface = outside_validation({name: case.facts[name] for name in case.facts if name != _RATIO})
        if of_surface:
            unknown.setdefault(case.surface, of_surface)
        elif of_material := outside_validation({_RATIO: case.ratio}):
            unknown.setdefault(f"{case.material} on {case.surface}", of_material)
        else:
            adhesive.add(case.ratio < math.inf)
    known = f"{_error(adhesive)} {_VALIDATED}" if adhesive else ""
    if not unknown:
        return Statement("accuracy", known)
    reasons = join_first((f"{name}: {'; '.join(found)}" for name, found in unknown.items()), ". ")
    advice = "a study with `models: [asperities, boundary_elements]` measures the error"
    if measured:
        advice = "the runs with boundary elements show the error"
    text = f"the accuracy of {'the other runs' if adhesive else 'this campaign'} is unknown ({reasons}); {advice}"
    return Statement("accuracy", f"{known}; {text}" if known else text, False)


def describe_layers(shares: Mapping[str, float]) -> Iterator[Statement]:
    """Yield a statement if shapes are pressed on layers, where the laws of a half-space do not hold.

    shares : contact radius divided by the thickness of the layer, by names of material and surface.
    """
    if shares:
        radii = join_first(f"{share:.2g} of the thickness for {name}" for name, share in shares.items())
        text = (
            f"the contact radius is {radii}; the laws of Hertz and JKR are for half-spaces: on a layer they do not give"
            " force, radius and pull-off, and no ratio to JKR is computed"
        )
        yield Statement("layer", text, False)


def describe_sticky(stickiness: Mapping[tuple[str, str], float]) -> list[str]:
    """Describe each pair of surface and material with a stickiness (`icha.asperity.stickiness`) larger than 1."""
    return [
        f"{material} on {surface} (stickiness {value:.2g})"
        for (surface, material), value in stickiness.items()
        if value > 1
    ]


def _error(adhesive):
    """Describe the errors in the validation; `adhesive` contains True for runs with adhesion, False for others."""
    found = []
    for quantity in VALIDATION[True]:
        ranges = (VALIDATION[each][quantity] for each in sorted(adhesive, reverse=True))
        first, *others = dict.fromkeys(f"{-high:.0f} to {-low:.0f} %" for low, high in ranges)
        found.append(f"{quantity} {first} too small" + (f" with adhesion and {others[0]} without" if others else ""))
    return f"{', '.join(found)}, compared with boundary elements"
