"""What is known of the surfaces of a campaign before it is run, and whether its models hold for it."""

import math
from functools import cache
from pathlib import Path

from icha.analysis.validity import Case, Statement, in_words_if_sticky, named, of_dataset, statements
from icha.asperity.material import WU_HOLDS_FROM, Material
from icha.asperity.stickiness import stickiness
from icha.configuration.campaign import Campaign
from icha.configuration.cases import run_cases
from icha.configuration.plausibility import energy_ratio
from icha.configuration.surfaces import MeasuredSurface, SelfAffineSurface
from icha.contact.models import MODELS
from icha.surfaces.moments import (
    SpectralMoments,
    cells_per_short_wave,
    height_statistics,
    slope_anisotropy,
    spectral_moments,
    summit_density,
)

# Radius of the mean curvature of the summits of a Gaussian surface times its rms curvature (McCool 1986, as in
# icha.references.summit_theories, for which this would have to wait).
_SUMMIT_RADIUS = 3 * math.sqrt(math.pi) / 8

# Of the spots that touch first one of twenty has a Tabor parameter of less than this times that of the mean.
_LEAST = 0.84


def self_affine_moments(
    period: float, rolloff_wavelength: float, short_wavelength: float, hurst: float
) -> SpectralMoments:
    """Moments of a self-affine surface with roll-off, but for a common factor; lengths in m.

    Of the spectrum's moments as integrals over the plane of wave vectors, m0 = int C, m2 = 1/2 int q^2 C,
    m4 = 3/8 int q^4 C.
    """
    q_l, q_0, q_1 = (2 * math.pi / length for length in (period, rolloff_wavelength, short_wavelength))

    def moment(order):
        # int q^(order + 1) C dq: flat up to the roll-off, falling as q^(-2 (1 + H)) from there on.
        power = order - 2 * hurst
        falling = math.log(q_1 / q_0) if power == 0 else math.expm1(power * math.log(q_1 / q_0)) / power
        return (q_0 ** (order + 2) - q_l ** (order + 2)) / (order + 2) + q_0 ** (order + 2) * falling

    return SpectralMoments(moment(0), moment(2) / 2, 3 / 8 * moment(4))


def _moments(section) -> SpectralMoments:
    """Moments of a surface; of a random one but for a common factor."""
    if isinstance(section, SelfAffineSurface):
        return self_affine_moments(*section.lengths_and_hurst)
    return spectral_moments(_read(section))


def expected_summits(campaign: Campaign, name: str) -> float:
    """Number of summits of a random surface by its spectrum; those of a surface from a file are counted."""
    section = campaign.surfaces[name]
    if isinstance(section, SelfAffineSurface):
        moments = _moments(section)
        return section.period**2 * summit_density(moments.m2, moments.m4)
    from icha.surfaces.summits import locate_summits

    return len(locate_summits(_read(section)))


def rms_curvature(campaign: Campaign, name: str) -> float:
    """Rms curvature of a profile of a surface at rms slope 1, 1/m."""
    moments = _moments(campaign.surfaces[name])
    return math.sqrt(moments.m4 / (2 * moments.m2))


def surface_facts(campaign: Campaign, name: str) -> dict[str, float]:
    """Values of a surface by the names of `icha.analysis.validity.VALIDATED`, as far as a surface has them.

    A random surface is Gaussian and isotropic; one from a file is measured.
    """
    section = campaign.surfaces[name]
    if isinstance(section, SelfAffineSurface):
        moments, grid, unsupported = _moments(section), section.grid, 0
        skewness, kurtosis, anisotropy, free = 0.0, 3.0, 1.0, False
        summits = expected_summits(campaign, name)
    else:
        from icha.surfaces.summits import locate_summits

        surface = _read(section)
        moments, (skewness, kurtosis) = spectral_moments(surface), height_statistics(surface)
        anisotropy, free = slope_anisotropy(surface), surface.free
        found, grid = locate_summits(surface), surface.grid
        unsupported = len(found.unsupported_height)
        summits = len(found) + unsupported
    return {
        "slope_anisotropy": anisotropy,
        "height_skewness": skewness,
        "height_kurtosis": kurtosis,
        "nayak_parameter": moments.nayak_parameter,
        "nodes_per_short_wave": cells_per_short_wave(grid, summits),
        "unsupported_summits": unsupported / max(summits, 1),
        "free_edges": float(free),
    }


def _read(section):
    # SciPy, for which campaigns without such a surface do not wait.
    if isinstance(section, MeasuredSurface):
        from icha.surfaces.measured.topography import prepare_topography

        return prepare_topography(section.path, section.preparation).surface
    from icha.surfaces.measured.array_files import read_height_map
    from icha.surfaces.surface import Surface

    return Surface(read_height_map(section.path, section.height_unit), section.period)


def expected_validity(campaign: Campaign) -> list[Statement]:
    """What is to be expected, with Tabor parameters of summits of the mean curvature that a Gaussian surface has."""
    facts = cache(lambda surface: surface_facts(campaign, surface))
    curvature = cache(lambda surface: rms_curvature(campaign, surface))
    cases, tabor, sticky = [], {}, {}
    for case in run_cases(campaign):
        section = campaign.materials[case.material]
        ratio = energy_ratio(campaign, case)
        # Only of asperities it matters how far a surface is from those of the validation.
        own = facts(case.surface) if MODELS[case.model].by_summits else {}
        cases.append(Case(case.model, case.surface, case.material, {**own, "full_contact_energy_ratio": ratio}))
        if MODELS[case.model].by_summits and section.surface_energy > 0:
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
