"""Sticky contacts: runs of asperities of which full contact has the lower energy, found before anything is computed."""

from collections.abc import Iterator

from icha.asperity.full_contact import FULL_CONTACT_BELOW, full_contact_energy_ratio
from icha.configuration.campaign import Campaign
from icha.configuration.plausibility import Unusual, Usual
from icha.configuration.surfaces import SelfAffineSurface
from icha.contact.models import ASPERITIES
from icha.surfaces.moments import self_affine_full_contact_energy

_RATIO = Usual(
    "1",
    f"{FULL_CONTACT_BELOW:g}",
    "inf",
    "below, full contact has the lower energy and the asperity model is not applicable: press a rougher surface or a "
    "stiffer material, or use `models: [boundary_elements]`",
)


def full_contact_energy(campaign: Campaign, surface: str) -> float:
    """U_full/E* of a surface at rms slope 1, m."""
    section = campaign.surfaces[surface]
    if isinstance(section, SelfAffineSurface):
        lengths = section.period, section.rolloff_wavelength, section.short_wavelength
        return self_affine_full_contact_energy(*lengths, section.hurst)
    return campaign.topography(surface).full_contact_energy


def sticky_runs(campaign: Campaign) -> Iterator[Unusual]:
    """The stickiest run of asperities of every study in which full contact has the lower energy."""
    for name, study in campaign.studies.items():
        if ASPERITIES not in study.models:
            continue
        ratios = {}
        for contact in campaign.contacts(name):
            material = campaign.materials[contact.material]
            energy = full_contact_energy(campaign, contact.surface) * contact.rms_slope**2
            ratios[contact] = full_contact_energy_ratio(energy, material.contact_modulus, material.surface_energy)
        lowest = min(ratios, key=ratios.get)
        if ratios[lowest] < FULL_CONTACT_BELOW:
            place = f"{lowest.material} on {lowest.surface} at rms slope {lowest.rms_slope:.3g}"
            value = f"asperities with U_full/dgamma = {ratios[lowest]:.3g}"
            yield Unusual(("studies", name, "models"), value, _RATIO, f"for {place}")
