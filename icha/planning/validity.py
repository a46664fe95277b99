"""Expected properties of surfaces and expected validity of contact models, before a campaign runs."""

import math
from functools import cache

from icha.asperity.material import VAN_DER_WAALS_RANGE, WU_HOLDS_FROM
from icha.asperity.stickiness import stickiness, sticky_rms_height
from icha.asperity.tabor import describe_short_range
from icha.configuration.campaign import Campaign
from icha.configuration.plausibility import (
    energy_ratio,
    full_contact,
    resolution_of_smooth,
    rms_curvature,
    tabor_parameter,
)
from icha.configuration.surfaces import SelfAffineSurface
from icha.configuration.topographies import read_surface
from icha.contact.attraction import straight_strength
from icha.contact.models import MODELS
from icha.planning.statements import (
    COMPLETE_PRESSURE,
    DIRECTION,
    RESOLVED,
    RMS_HEIGHT,
    SHAPED,
    SPACING,
    STICKY_HEIGHT,
    STRENGTH,
    TABOR,
    THEORETICAL,
    Case,
    Statement,
    describe_layers,
    describe_sticky,
    statements,
)
from icha.support.formatting import format_quantity, join_first
from icha.surfaces.moments import (
    SpectralMoments,
    height_statistics,
    self_affine_moments,
    slope_anisotropy,
    spectral_moments,
    summit_density,
)
from icha.uncertainty.grid_error import length_in_cells

# Least number of cells in the contact radius at zero load for a pull-off force within a per cent (docs/indenter.md).
_LEAST_CELLS = 10
# Largest contact radius of an indenter, divided by the side of its square (docs/howto/indenter.md).
_LARGEST_SHARE = 1 / 3
# Radius of the mean summit of a Gaussian surface, multiplied by the rms curvature of the surface (McCool 1986).
# icha.references.summit_theories also contains this number, but takes long to import.
_SUMMIT_RADIUS = 3 * math.sqrt(math.pi) / 8

# Tabor parameter divided by that of the mean summit; about 5 % of the first contact spots are below this ratio.
_SMALLEST_TABOR = 0.84


def surface_facts(campaign: Campaign, name: str) -> dict[str, float]:
    """Return, by name, those properties of a surface at rms slope 1 that decide whether the contact models are valid.

    Random surfaces are assumed to be Gaussian and isotropic; surfaces from files have the properties of their heights.
    Beside `icha.planning.statements.VALIDATED`, these are the number of summits that the asperity model uses, and the
    rms height in m.
    """
    section = campaign.surfaces[name]
    if isinstance(section, SelfAffineSurface):
        moments, unsupported = self_affine_moments(*section.lengths_and_hurst), 0
        summits = section.period**2 * summit_density(moments.m2, moments.m4)
        skewness, kurtosis, anisotropy, free = 0.0, 3.0, 1.0, section.free
    else:
        from icha.surfaces.summits import locate_summits

        surface = read_surface(section)
        moments, (skewness, kurtosis) = spectral_moments(surface), height_statistics(surface)
        anisotropy, free = slope_anisotropy(surface), surface.free
        found = locate_summits(surface)
        summits, unsupported = len(found), len(found.unsupported_height)
    every = summits + unsupported
    return {
        "slope_anisotropy": anisotropy,
        "height_skewness": skewness,
        "height_kurtosis": kurtosis,
        "nayak_parameter": moments.nayak_parameter,
        "nodes_per_short_wave": campaign.resolution(name).cells,
        "unsupported_summits": unsupported / max(every, 1),
        "free_edges": float(free),
        "summits": summits,
        RMS_HEIGHT: math.sqrt(moments.m0 / (2 * moments.m2)),
    }


def expected_validity(campaign: Campaign) -> list[Statement]:
    """Return statements about the expected validity of the models; Tabor parameters are those of the mean summit."""
    facts_of = cache(lambda surface: surface_facts(campaign, surface))
    own, cases, tabor, sticky, loops = campaign.own_studies, [], {}, {}, {}
    # Contacts that differ only in the seed have the same expected properties.
    for case in dict.fromkeys(case._replace(seed=0) for case in campaign.all_runs):
        if case.study not in own:
            continue  # runs whose error the estimates correct
        section, material = campaign.surfaces[case.surface], campaign.materials[case.material].material
        spacing = campaign.period(case.surface) / campaign.grid(case.surface)
        resolution = campaign.resolution(case.surface)
        known = {"full_contact_energy_ratio": energy_ratio(campaign, case)}
        if (value := tabor_parameter(campaign, case)) is not None:
            known[TABOR] = value
        if MODELS[case.model].by_cells:
            tension = straight_strength(material.receding.adhesion_length / spacing) * material.contact_modulus
            known |= {STRENGTH: material.receding.interface_strength, RESOLVED: tension, SPACING: spacing}
        if section.smooth:
            resolution = min(resolution_of_smooth(campaign, case), resolution)
            cases.append(Case(case.model, case.surface, case.material, known, resolution))
            continue
        facts, by_summits = facts_of(case.surface), MODELS[case.model].by_summits
        # Only the asperity model needs surfaces that are similar to the surfaces of its validation.
        known = (facts if by_summits else {}) | known
        known |= {
            DIRECTION: material.receding.surface_energy / material.surface_energy if material.surface_energy else 1.0,
            SHAPED: float(campaign.surfaces[case.surface].shape is not None),
            COMPLETE_PRESSURE: full_contact(campaign, case).complete_pressure * material.contact_modulus,
            STRENGTH: material.receding.interface_strength,
            THEORETICAL: material.receding.theoretical_strength,
        }
        if isinstance(section, SelfAffineSurface):
            # The sum over all waves takes time, but gives exactly the height that the study asks for.
            exact = campaign.studies[case.study].rms_heights is not None
            height = section.rms_height_at_unit_slope if exact else facts[RMS_HEIGHT]
            known[RMS_HEIGHT] = case.rms_slope * height
            # The bearing area model is for half-spaces.
            if not material.layered:
                known[STICKY_HEIGHT] = sticky_rms_height(section.rolloff_wavelength, material)
        # The error of loops is known for one work of adhesion only.
        adhesive = material.surface_energy > 0 and not material.directed
        if MODELS[case.model].by_cells and campaign.studies[case.study].unload and adhesive and not section.shape:
            lengths = material.surface_energy, material.contact_modulus, rms_curvature(campaign, case), spacing
            key = case.material, case.surface
            loops[key] = min(float(length_in_cells(*lengths)), loops.get(key, math.inf))
        cases.append(Case(case.model, case.surface, case.material, known, resolution))
        if by_summits and material.surface_energy > 0:
            curvature = rms_curvature(campaign, case)
            of_summit = float(material.tabor_parameter(_SUMMIT_RADIUS / curvature))
            tabor.setdefault((case.material, case.surface), []).append(of_summit)
            value = stickiness(SpectralMoments(0.0, case.rms_slope**2 / 2, curvature**2), material)
            key = case.surface, case.material
            sticky[key] = max(value, sticky.get(key, 0.0))
    models = {name: study.models for name, study in own.items()}
    outside = _describe_outside(tabor) if tabor else None
    stated = statements(models, cases, outside, describe_sticky(sticky), loops)
    return [*stated, *_default_ranges(campaign), *_indenters(campaign)]


def _default_ranges(campaign):
    """Yield a statement if materials with adhesion have the default range of attraction."""
    used = dict.fromkeys(case.material for case in campaign.all_runs)
    names = [
        name
        for name in used
        if campaign.materials[name].surface_energy > 0
        and "interaction_range" not in campaign.materials[name].model_fields_set
    ]
    if names:
        value = f"{VAN_DER_WAALS_RANGE * 1e9:g} nm"
        yield Statement(
            "interaction range",
            f"{value} for {join_first(names)}, the default for van der Waals forces; the range decides when separated "
            "surfaces jump into contact",
            True,
        )


def _indenters(campaign):
    """Yield a statement for each shape and material: the contact of the smooth shape by theory, beside the square."""
    own, largest, layers, unloaded = campaign.own_studies, {}, {}, set()
    for study, surface, name in dict.fromkeys((case.study, case.surface, case.material) for case in campaign.all_runs):
        if campaign.surfaces[surface].shape and study in own:
            radii = [radius for _, radius in campaign.contact_radii(campaign.studies[study], surface, name).values()]
            largest[surface, name] = max(0.0, *radii, largest.get((surface, name), 0.0))
            unloaded |= {(surface, name)} if campaign.studies[study].unload else set()
    if not largest:
        return
    from icha.references.indentation import contact_radius_at, pull_off_state, theory_of  # imports SciPy
    from icha.references.limits import describe_coarse_pull_off

    for (surface, name), radius in largest.items():
        shape, material = campaign.surfaces[surface].shape.shape, campaign.materials[name]
        side, energy = campaign.period(surface), material.surface_energy
        properties = shape, material.contact_modulus, energy
        cells = campaign.grid(surface) / side
        if material.thickness:
            if radius:
                layers[f"{name} on {surface} (as on a half-space)"] = radius / material.thickness
            continue
        at_rest = contact_radius_at("force", 0.0, *properties) if energy else 0.0
        found = [f"at most {format_quantity(max(radius, at_rest), 'm')}"] if radius else []
        if energy:
            jumped = format_quantity(contact_radius_at("indentation", 0.0, *properties), "m")
            at_zero = f"{format_quantity(at_rest, 'm')} ({at_rest * cells:.2g} cells) at zero load"
            at_zero += " in loading" if material.receding_energy else ""
            found = [f"{jumped} after the jump-in", at_zero, *found]
        receding = material.receding_energy or energy
        released = pull_off_state(shape, material.contact_modulus, receding) if energy else None
        force = format_quantity(-float(released.force), "N") if released else ""
        pull_off = f"a pull-off force of {force}, and " if force else ""
        text = (
            f"by the theory of {theory_of(shape, adhesive=energy > 0)}, {name} on {surface} without roughness has "
            f"{pull_off}a contact radius of {', '.join(found)}; half the side is {format_quantity(side / 2, 'm')}"
        )
        enough = not energy or at_rest * cells >= _LEAST_CELLS
        if released and (surface, name) in unloaded:
            if coarse := describe_coarse_pull_off(shape, 1 / cells, float(released.contact_radius)):
                text, enough = f"{text}. With boundary elements, {coarse}", False
        if energy and shape.sphere_radius:
            tabor = math.cbrt((energy / material.contact_modulus) ** 2 * shape.sphere_radius)
            if long_range := describe_short_range(tabor / material.interaction_range):
                text, enough = f"{text}. JKR does not hold: {long_range}", False
        if found:
            yield Statement("indenter", text, enough and max(radius, at_rest) <= _LARGEST_SHARE * side)
    yield from describe_layers(layers)


def _describe_outside(tabor):
    """Describe the contacts that have spots outside the range of Wu's formula; `tabor` contains Tabor parameters."""
    cases = []
    for (material, surface), values in tabor.items():
        if _SMALLEST_TABOR * min(values) < WU_HOLDS_FROM:
            ends = dict.fromkeys(f"{float(f'{mu:.2g}'):g}" for mu in (min(values), max(values)))
            cases.append(f"{material} on {surface} (about {' to '.join(ends)})")
    return f"some or all spots are expected outside this range: {join_first(cases)}" if cases else ""
