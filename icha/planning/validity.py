"""What is known, before a campaign is run, of whether its models hold for it."""

import math
from functools import cache
from pathlib import Path

from icha.analysis.validity import Case, Statement, in_words_if_sticky, named, of_dataset, statements
from icha.asperity.full_contact import full_contact_energy_ratio
from icha.asperity.material import WU_HOLDS_FROM, Material
from icha.asperity.stickiness import stickiness
from icha.configuration.campaign import Campaign
from icha.configuration.cases import run_cases
from icha.configuration.full_contact import full_contact_energy
from icha.contact.models import ASPERITIES
from icha.planning.roughness import rms_curvature, surface_facts
from icha.surfaces.moments import SpectralMoments

# Radius of the mean curvature of the summits of a Gaussian surface times its rms curvature (McCool 1986, as in
# icha.references.summit_theories, for which this would have to wait).
_SUMMIT_RADIUS = 3 * math.sqrt(math.pi) / 8

# Of the spots that touch first one of twenty has a Tabor parameter of less than this times that of the mean.
_LEAST = 0.84


def expected_validity(campaign: Campaign) -> list[Statement]:
    """What is to be expected, with Tabor parameters of summits of the mean curvature that a Gaussian surface has."""
    facts = cache(lambda surface: surface_facts(campaign, surface))
    curvature = cache(lambda surface: rms_curvature(campaign, surface))
    cases, tabor, sticky = [], {}, {}
    for case in run_cases(campaign):
        section = campaign.materials[case.material]
        energy = full_contact_energy(campaign, case.surface) * case.rms_slope**2
        ratio = full_contact_energy_ratio(energy, section.contact_modulus, section.surface_energy)
        # Only of asperities it matters how far a surface is from those of the validation.
        own = facts(case.surface) if case.model == ASPERITIES else {}
        cases.append(Case(case.model, case.surface, case.material, {**own, "full_contact_energy_ratio": ratio}))
        if case.model == ASPERITIES and section.surface_energy > 0:
            material = Material(section.contact_modulus, section.surface_energy, section.interaction_range)
            curved = curvature(case.surface) * case.rms_slope
            tabor_parameter = float(material.tabor_parameter(_SUMMIT_RADIUS / curved))
            tabor.setdefault((case.material, case.surface), []).append(tabor_parameter)
            value = stickiness(SpectralMoments(0.0, case.rms_slope**2 / 2, curved**2), material)
            at = case.surface, case.material
            sticky[at] = max(value, sticky.get(at, 0.0))
    models = {name: study.models for name, study in campaign.studies.items()}
    outside = _expected_outside(tabor) if tabor else None
    return statements(models, cases, outside, in_words_if_sticky(sticky))


def _expected_outside(tabor):
    cases = [
        f"{material} on {surface} (about {' to '.join(dict.fromkeys(map(_roughly, (min(own), max(own)))))})"
        for (material, surface), own in tabor.items()
        if _LEAST * min(own) < WU_HOLDS_FROM
    ]
    return f"some or all spots expected outside: {named(cases)}" if cases else ""


def _roughly(mu):
    return f"{float(f'{mu:.2g}'):g}"


def found_validity(dataset: Path) -> list[Statement]:
    """What a campaign's dataset says."""
    import xarray as xr

    with xr.open_datatree(dataset, engine="netcdf4") as tree:
        return of_dataset(tree)
