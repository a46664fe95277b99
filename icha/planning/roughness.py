"""What of a campaign's surfaces the costs of their runs depend on, before a surface is made."""

import math

from icha.configuration.campaign import Campaign
from icha.configuration.measured_surfaces import MeasuredSurface
from icha.configuration.surfaces import SelfAffineSurface
from icha.planning.costs import Roughness, roughness_of, self_affine_moments
from icha.surfaces.moments import (
    SpectralMoments,
    cells_per_short_wave,
    height_statistics,
    slope_anisotropy,
    spectral_moments,
    summit_density,
)


def roughness(campaign: Campaign, name: str) -> Roughness:
    """Of a random surface what its spectrum leads to expect; of one from a file its summits are counted there."""
    section = campaign.surfaces[name]
    if isinstance(section, SelfAffineSurface):
        lengths = section.period, section.rolloff_wavelength, section.short_wavelength
        return roughness_of(section.grid, section.period, *self_affine_moments(*lengths, section.hurst))
    return measured_roughness(_read(section))


def rms_curvature(campaign: Campaign, name: str) -> float:
    """Rms curvature of a profile of a surface at rms slope 1, 1/m."""
    section = campaign.surfaces[name]
    if isinstance(section, SelfAffineSurface):
        lengths = section.period, section.rolloff_wavelength, section.short_wavelength
        _, m2, m4 = self_affine_moments(*lengths, section.hurst)
        return math.sqrt(m4 / (2 * m2))
    surface = _read(section)
    return surface.rms_curvature / surface.rms_slope


def surface_facts(campaign: Campaign, name: str) -> dict[str, float]:
    """Values of a surface by the names of `icha.analysis.validated_range.VALIDATED`, as far as a surface has them.

    A random surface is Gaussian and isotropic; one from a file is measured.
    """
    section = campaign.surfaces[name]
    if isinstance(section, SelfAffineSurface):
        lengths = section.period, section.rolloff_wavelength, section.short_wavelength
        moments = SpectralMoments(*self_affine_moments(*lengths, section.hurst))
        skewness, kurtosis, anisotropy, free = 0.0, 3.0, 1.0, False
        summits = section.period**2 * summit_density(moments.m2, moments.m4)
        unsupported, grid = 0, section.grid
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
        from icha.surfaces.measured.topography import prepared_topography

        return prepared_topography(section.path, section.preparation).surface
    from icha.surfaces.measured.array_files import read_height_map
    from icha.surfaces.surface import Surface

    return Surface(read_height_map(section.path, section.metres_per_unit), section.period)


def measured_roughness(surface) -> Roughness:
    """Of an `icha.Surface` that is there."""
    from icha.surfaces.summits import count_summits

    moments = spectral_moments(surface)
    return roughness_of(surface.grid, surface.period, moments.m0, moments.m2, moments.m4, count_summits(surface))
