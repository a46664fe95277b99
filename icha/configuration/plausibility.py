"""Find unusual values in a configuration; the usual cause is a wrong unit.

ICHA refuses an unusual value, unless the campaign's list `confirmed` contains the key of the value. An unusual value
that is confirmed causes a warning.
"""

import itertools
import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

from icha.asperity.full_contact import FULL_CONTACT_BELOW, full_contact_energy_ratio
from icha.asperity.tabor import LEAST_TABOR, describe_short_range
from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SelfAffineSurface
from icha.contact.attraction import FINITE_RANGE, attraction_on, resolving_spacing
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.labels import RunLabels, coarse_study
from icha.half_space.layer import softness_of
from icha.path.targets import FORCE, NOMINAL_PRESSURE, QUANTITIES, UNITS
from icha.support import formatting
from icha.support.usual import RMS_SLOPE, SIDE, USUAL, Usual
from icha.support.values import Problem, to_number, to_si
from icha.surfaces.measured.settings import MIRROR
from icha.surfaces.moments import FullContact, self_affine_full_contact, self_affine_moments
from icha.surfaces.resolution import LEAST_CELLS, RECOMMENDED_CELLS, Resolution

CONFIRMED = "confirmed"
# Smallest usual reduced pressure of a target with a unit. Such a load presses about 1e-9 of the area into contact, the
# smallest area fraction of a target. A wrong prefix, mPa for MPa, gives smaller values.
_LEAST_REDUCED_PRESSURE = 1e-9
# Sections whose keys are checked.
_SECTIONS = ("defaults", "surfaces", "materials", "studies")


class Unusual(NamedTuple):
    """A value outside the usual range of its key.

    Attributes
    ----------
    location : keys that lead to the value in the configuration.
    usual : usual range, or a text that states what is expected.
    source : origin of a value that is not in the configuration, as text with a blank in front; otherwise empty.
    """

    location: tuple
    value: Any
    usual: Usual | str
    source: str = ""

    @property
    def key(self) -> str:
        """Key that stands for the value in the list `confirmed`; for an entry of a list, the key of this list."""
        return ".".join(entry for entry in self.location if isinstance(entry, str))


def unusual_values(written: Mapping) -> list[Unusual]:
    """Return all unusual values in the content of a configuration file."""
    return [found for section in _SECTIONS for found in _unusual((section,), written.get(section))]


def _unusual(location: tuple, value: Any) -> Iterator[Unusual]:
    if isinstance(value, Mapping | list):
        entries = value.items() if isinstance(value, Mapping) else enumerate(value)
        for key, each in entries:
            yield from _unusual((*location, key), each)
        return
    name = next(key for key in reversed(location) if isinstance(key, str))
    if name in USUAL and not USUAL[name].contains(_number(value, USUAL[name].unit)):
        yield Unusual(location, value, USUAL[name])


def _number(value, unit):
    """Return a value of the configuration in its SI unit; 0 for invalid values, which other checks report."""
    try:
        return to_number(value) if unit == "1" else to_si(value, unit)
    except ValueError:
        return 0.0


def unusual_topography(
    location: tuple, section: Any, period: float, rms_slope: float | None, repeated: str
) -> Iterator[Unusual]:
    """For a topography from a file, yield the size, the rms slope and a repeated height if they are unusual.

    Period, slope and repeated height are those of `Topography`; `section` is the section of the surface.
    """
    if repeated:
        expected = "different heights, and nan in the file where a point is missing"
        yield Unusual((*location, "missing"), repeated, expected, ", because such a number often marks missing points")
    if getattr(section, "size", section) is None and not SIDE.contains(period):
        yield Unusual((*location, "size"), formatting.length(period), SIDE, " in the file")
    if rms_slope is not None and not RMS_SLOPE.contains(rms_slope):
        source = " (the slope depends on units, size and numbers for missing points)"
        if outliers := _kept_outliers(section):
            source = f" (with {outliers}; try `outliers: remove` first)"
        key = "height_unit" if hasattr(section, "height_unit") else "length_unit"
        yield Unusual((*location, key), f"rms slope {rms_slope:.3g}", RMS_SLOPE, source)


def unusual_in_campaign(campaign: Campaign) -> Iterator[Unusual]:
    """Yield the unusual values of a campaign that its text does not show, and that no other unusual value causes.

    Of each study, the first value of each kind counts.
    """
    for name, each in campaign.topographies.items():
        location = "surfaces", campaign.origin("surfaces", name)
        section = campaign.surfaces[name]
        yield from unusual_topography(location, section, each.period, each.rms_slope, each.repeated_height)
    for name, material in campaign.materials.items():
        if material.adhesion_map and not USUAL["surface_energy"].contains(material.surface_energy):
            location = "materials", campaign.origin("materials", name), "surface_energy"
            value = formatting.format_quantity(material.surface_energy, "J/m^2")
            yield Unusual(location, value, USUAL["surface_energy"], ", the mean of the map")
    yield from _first_of_each_study(campaign, _unusual_heights, _negligible_loads, _mirrored_forces)
    yield from _coarse_grids(campaign)


def caused_in_campaign(campaign: Campaign) -> Iterator[Unusual]:
    """Yield the unusual values of a campaign that other unusual values may cause, other than its sticky runs."""
    yield from _first_of_each_study(campaign, _coarse_contacts)
    yield from _long_ranges(campaign)


def _first_of_each_study(campaign, *checks):
    """Yield the first value that each check finds in each study of the user."""
    for check, name in itertools.product(checks, campaign.own_studies):
        yield from itertools.islice(check(campaign, name), 1)


def plausibility_problems(
    unusual: Collection[Unusual], confirmed: Any, addition: str = f"`{CONFIRMED}: [{{}}]` at the top level"
) -> Iterator[Problem]:
    """Yield a problem for each unusual value whose key is not confirmed; `addition` explains how to confirm keys."""
    for each in unusual:
        if not (isinstance(confirmed, list) and each.key in confirmed):
            reason = f"is unusual{each.source}; expected {each.usual}. Correct the value, or add "
            yield each.location, each.value, f"{reason}{addition.format(each.key)} if you intend this value"


def _unusual_heights(campaign: Campaign, name: str) -> Iterator[Unusual]:
    """Yield the rms heights of a study that give an unusual rms slope."""
    for contact in campaign.contacts(name):
        heights, section = campaign.studies[name].rms_heights, campaign.surfaces[contact.surface]
        if heights and not section.smooth and not RMS_SLOPE.contains(contact.rms_slope):
            source = f" on {contact.surface}, where the rms slope is {contact.rms_slope:.3g}"
            location = "studies", name, "rms_heights"
            yield Unusual(location, ", ".join(map(formatting.length, heights)), RMS_SLOPE, source)


def _negligible_loads(campaign: Campaign, name: str) -> Iterator[Unusual]:
    """Yield the pressures and forces of a study whose reduced pressure is less than 1e-9 for every contact."""
    pressure, force, _ = campaign.units_of(name)
    units = {NOMINAL_PRESSURE: pressure, FORCE: force}
    for location, kind, value in campaign.studies[name].states():
        unit = units.get(kind, math.inf)
        if unit < math.inf and 0 < abs(value) < _LEAST_REDUCED_PRESSURE * unit:
            least = formatting.format_quantity(_LEAST_REDUCED_PRESSURE * unit, UNITS[kind])
            expected = f"0, or at least {least} (a reduced pressure of {_LEAST_REDUCED_PRESSURE:g})"
            shown = formatting.format_quantity(value, UNITS[kind])
            yield Unusual(("studies", name, *location), shown, expected, f" (a reduced pressure of {value / unit:.3g})")


def _mirrored_forces(campaign: Campaign, name: str) -> Iterator[Unusual]:
    """Yield the forces of a study on a mirrored scan; they act on the four copies of the scan in the cell."""
    mirrored = (each.surface for each in campaign.contacts(name) if campaign.surfaces[each.surface].boundary == MIRROR)
    forces = ((location, value) for location, kind, value in campaign.studies[name].states() if kind == FORCE)
    for surface, (location, force) in itertools.product(mirrored, forces):
        pressure = formatting.format_quantity(4 * force / campaign.period(surface) ** 2, "Pa")
        source = f" on {surface}, because a mirrored cell contains four copies of the scan, which share the force"
        expected = f"a pressure, such as {pressure} for this force on one scan"
        yield Unusual(("studies", name, *location), formatting.format_quantity(force, "N"), expected, source)


def _coarse_grids(campaign: Campaign) -> Iterator[Unusual]:
    """Yield the grid of each surface whose shortest wave has too few cells, the coarsest grid of its variants."""
    found: dict[str, tuple[float, Unusual]] = {}
    levels = [coarse for label in campaign.studies if (coarse := coarse_study(label)) in campaign.studies]
    halves = {contact.surface for label in levels for contact in campaign.contacts(label)}
    for name in campaign.used_surfaces:
        resolution = campaign.resolution(name)
        origin, section, grid = campaign.origin("surfaces", name), campaign.surfaces[name], campaign.grid(name)
        if resolution.reaches(LEAST_CELLS) or found.get(origin, (math.inf,))[0] <= resolution.cells:
            continue
        key = "grid" if hasattr(section, "grid") else "path"
        expected = resolution.grids(2 * grid if name in halves else grid)
        expected = expected if key == "grid" else f"a file with {expected}"
        if hasattr(section, "cutoff"):
            filtered = formatting.length(float(f"{RECOMMENDED_CELLS * campaign.period(name) / grid:.2g}"))
            expected += f", or `cutoff: {filtered}`" if section.cutoff is None else ", or a longer `cutoff`"
        if outliers := _kept_outliers(section):
            expected = f"`outliers: remove` first, because the scan has {outliers}"
        reason = " on half the grid" if name in halves else f" of variant {name}" if origin != name else ""
        source = f" ({resolution}{reason})"
        value = getattr(campaign.surfaces[origin], key) or grid
        found[origin] = resolution.cells, Unusual(("surfaces", origin, key), value, expected, source)
    yield from (unusual for _, unusual in found.values())


def _kept_outliers(section):
    """Describe the outliers that a surface keeps; an empty text without outliers."""
    if getattr(section, "outliers", "remove") == "remove":
        return ""
    from icha.configuration.topographies import read_topography
    from icha.surfaces.measured.topography import defects_of

    return defects_of(read_topography(section).square).description_of_outliers


def _coarse_contacts(campaign: Campaign, name: str) -> Iterator[Unusual]:
    """Yield the smallest target of a study for each contact of a smooth shape that there has too few cells."""
    for contact in campaign.runs(name):
        if not (MODELS[contact.model].by_cells and campaign.surfaces[contact.surface].smooth):
            continue
        resolution = resolution_of_smooth(campaign, contact)
        if not resolution.reaches(LEAST_CELLS):
            kind, value = campaign.studies[name].targets.states[0]
            source = f" ({resolution} for {contact.material} on {contact.surface})"
            shown = formatting.format_quantity(value, UNITS[kind]) if kind in UNITS else value
            expected = f"larger targets, or {resolution.grids(campaign.grid(contact.surface))}"
            yield Unusual(("studies", name, "targets", QUANTITIES[kind].plural), shown, expected, source)


def resolution_of_smooth(campaign: Campaign, contact: RunLabels) -> Resolution:
    """Return the number of cells in the smallest contact radius of a smooth shape at the targets of its study."""
    from icha.references.limits import contact_resolution  # imports SciPy, which takes time

    section = campaign.surfaces[contact.surface]
    material = campaign.materials[contact.material].material
    targets = campaign.studies[contact.study].targets.states
    return contact_resolution(section.shape.shape, section.side, section.grid, material, targets)


def _long_ranges(campaign: Campaign) -> Iterator[Unusual]:
    """For each material, yield the range of attraction if boundary elements badly assume a short range."""
    found: dict[str, tuple[float, Unusual]] = {}
    for name in campaign.studies:
        of_cells = [run for run in campaign.runs(name) if MODELS[run.model].by_cells]
        for contact in {contact._replace(seed=0): contact for contact in of_cells}.values():
            value = tabor_parameter(campaign, contact)
            origin = campaign.origin("materials", contact.material)
            if value is None or value >= min(LEAST_TABOR, found.get(origin, (math.inf,))[0]):
                continue
            material = campaign.materials[contact.material].material
            spacing = campaign.period(contact.surface) / campaign.grid(contact.surface)
            if attraction_on(material, spacing) == FINITE_RANGE:
                continue
            reach = formatting.length(material.interaction_range)
            cells = formatting.length(resolving_spacing(material), 3)
            source = f" for boundary elements of {contact.material} on {contact.surface}, which assume a short range, "
            source += f"because the grid does not resolve it; {describe_short_range(value)}"
            expected = f"a Tabor parameter of at least {LEAST_TABOR:g}, or grid cells of at most {cells}"
            found[origin] = value, Unusual(("materials", origin, "interaction_range"), reach, expected, source)
    yield from (unusual for _, unusual in found.values())


def tabor_parameter(campaign: Campaign, contact: RunLabels) -> float | None:
    """Return the Tabor parameter of a contact, as in the file of its run; None without adhesion or without a radius.

    The radius is 1/(rms curvature) of the roughness; without roughness, it is the radius of the shape.
    """
    section = campaign.surfaces[contact.surface]
    material = campaign.materials[contact.material].material
    radius = section.shape.shape.sphere_radius if section.smooth else 1 / rms_curvature(campaign, contact)
    return float(material.tabor_parameter(radius)) if material.surface_energy and radius else None


def rms_curvature(campaign: Campaign, contact: RunLabels) -> float:
    """Return the rms curvature of profiles of a rough surface at the rms slope of a contact, 1/m."""
    section = campaign.surfaces[contact.surface]
    if isinstance(section, SelfAffineSurface):
        moments = self_affine_moments(*section.lengths_and_hurst)
        return math.sqrt(moments.m4 / (2 * moments.m2)) * contact.rms_slope
    return campaign.topographies[contact.surface].rms_curvature * contact.rms_slope


_TOO_STICKY = f"{FULL_CONTACT_BELOW:g} to inf (for smaller values full contact has a lower energy than separated "
_TOO_STICKY += "surfaces, and the asperity model does not "
_TOO_STICKY += "apply; use a rougher surface, a stiffer material, or "
_RATIO = Usual(FULL_CONTACT_BELOW, math.inf, f"{_TOO_STICKY}`models: [boundary_elements]`)")
_RATIO_OF_LEVELS = _RATIO._replace(text=f"{_TOO_STICKY}`levels` without `asperities`)")


def full_contact(campaign: Campaign, contact: RunLabels) -> FullContact:
    """Return the full contact of the roughness of a contact with its half-space or layer, at its rms slope."""
    section, material = campaign.surfaces[contact.surface], campaign.materials[contact.material].material
    if isinstance(section, SelfAffineSurface):
        found = self_affine_full_contact(*section.lengths_and_hurst, softness_of(material))
    elif material.layered:
        from icha.configuration.topographies import full_contact_on_layer

        found = full_contact_on_layer(section, material)
    else:
        found = campaign.topographies[contact.surface].full_contact
    return found.scaled(contact.rms_slope)


def energy_ratio(campaign: Campaign, contact: RunLabels) -> float:
    """Return U_full/dgamma of a contact: elastic energy of full contact per area, divided by the work of adhesion.

    The energy is that of the roughness. Without roughness, the ratio does not matter, and infinity is returned.
    """
    material = campaign.materials[contact.material]
    if campaign.surfaces[contact.surface].smooth:
        return math.inf
    energy = full_contact(campaign, contact).energy
    return full_contact_energy_ratio(energy, material.contact_modulus, material.surface_energy)


def sticky_runs(campaign: Campaign) -> Iterator[Unusual]:
    """For each study, yield the asperity run with the smallest U_full/dgamma if this ratio favours full contact."""
    for name, study in campaign.studies.items():
        if DEFAULT_MODEL not in study.models:
            continue
        ratios = {contact: energy_ratio(campaign, contact) for contact in campaign.contacts(name)}
        lowest = min(ratios, key=ratios.get)
        if (ratio := ratios[lowest]) < FULL_CONTACT_BELOW:
            source = f" for {lowest.material} on {lowest.surface} at rms slope {lowest.rms_slope:.3g}"
            key, usual = ("models", _RATIO) if study.levels is None else ("levels", _RATIO_OF_LEVELS)
            yield Unusual(("studies", name, key), f"asperities with U_full/dgamma = {ratio:.3g}", usual, source)
