"""Find unusual values in a configuration; the usual cause is a wrong unit.

ICHA refuses an unusual value, unless the campaign's list `confirmed` contains the key of the value. An unusual value
that is confirmed causes a warning.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

from icha.asperity.full_contact import FULL_CONTACT_BELOW, full_contact_energy_ratio
from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SelfAffineSurface
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.labels import is_derived_study
from icha.support import formatting
from icha.support.usual import RMS_SLOPE, SIDE, USUAL, Usual
from icha.support.values import Problem, to_number, to_si
from icha.surfaces.moments import self_affine_full_contact_energy

CONFIRMED = "confirmed"
# Sections whose keys are checked.
_SECTIONS = ("defaults", "surfaces", "materials", "studies")


class Unusual(NamedTuple):
    """A value outside the usual range of its key.

    Attributes
    ----------
    location : keys that lead to the value in the configuration.
    source : origin of a value that is not in the configuration, as text with a blank in front; otherwise empty.
    """

    location: tuple
    value: Any
    usual: Usual
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


def unusual_topography(location: tuple, section: Any, period: float, rms_slope: float | None) -> Iterator[Unusual]:
    """For a topography from a file, yield the size if it is unusual, and the rms slope if it is unusual.

    Parameters
    ----------
    location, section : keys that lead to the surface in the configuration, and the section of the surface.
    period : side of the square, m.
    rms_slope : measured rms slope; None if no study uses the measured slope.
    """
    if getattr(section, "size", section) is None and not SIDE.contains(period):
        yield Unusual((*location, "size"), formatting.length(period), SIDE, " in the file")
    if rms_slope is not None and not RMS_SLOPE.contains(rms_slope):
        source = " (the slope depends on units, size and numbers for missing points)"
        yield Unusual((*location, "height_unit"), f"rms slope {rms_slope:.3g}", RMS_SLOPE, source)


def plausibility_problems(
    unusual: Collection[Unusual], confirmed: Any, addition: str = f"`{CONFIRMED}: [{{}}]` at the top level"
) -> Iterator[Problem]:
    """Yield a problem for each unusual value whose key is not confirmed; `addition` explains how to confirm keys."""
    for each in unusual:
        if not (isinstance(confirmed, list) and each.key in confirmed):
            reason = f"is unusual{each.source}; expected {each.usual}. Correct the value, or add "
            yield each.location, each.value, f"{reason}{addition.format(each.key)} if you intend this value"


def unusual_heights(campaign: Campaign) -> Iterator[Unusual]:
    """For each study with rms heights, yield the first height that gives an unusual rms slope."""
    for name, study in campaign.studies.items():
        if study.rms_heights is None or is_derived_study(name, campaign.studies):
            continue
        for contact in campaign.contacts(name):
            if not campaign.surfaces[contact.surface].smooth and not RMS_SLOPE.contains(contact.rms_slope):
                heights = ", ".join(map(formatting.length, study.rms_heights))
                source = f" on {contact.surface}, where the rms slope is {contact.rms_slope:.3g}"
                yield Unusual(("studies", name, "rms_heights"), heights, RMS_SLOPE, source)
                break


_TOO_STICKY = f"{FULL_CONTACT_BELOW:g} to inf (for smaller values full contact has a lower energy than separated "
_TOO_STICKY += "surfaces, and the asperity model does not "
_TOO_STICKY += "apply; use a rougher surface, a stiffer material, or "
_RATIO = Usual(FULL_CONTACT_BELOW, math.inf, f"{_TOO_STICKY}`models: [boundary_elements]`)")
_RATIO_OF_LEVELS = _RATIO._replace(text=f"{_TOO_STICKY}`levels` without `asperities`)")


def energy_ratio(campaign: Campaign, contact) -> float:
    """Return U_full/dgamma of a contact: elastic energy of full contact per area, divided by the work of adhesion.

    The energy is that of the roughness. Without roughness, the ratio does not matter, and infinity is returned.
    """
    surface, material = campaign.surfaces[contact.surface], campaign.materials[contact.material]
    if surface.smooth:
        return math.inf
    if isinstance(surface, SelfAffineSurface):
        energy = self_affine_full_contact_energy(*surface.lengths_and_hurst)
    else:
        energy = campaign.topography(contact.surface).full_contact_energy
    energy *= contact.rms_slope**2
    return full_contact_energy_ratio(energy, material.contact_modulus, material.surface_energy)


def sticky_runs(campaign: Campaign) -> Iterator[Unusual]:
    """For each study, yield the asperity run with the smallest U_full/dgamma if this ratio favours full contact."""
    for name, study in campaign.studies.items():
        if DEFAULT_MODEL not in study.models:
            continue
        ratios = {contact: energy_ratio(campaign, contact) for contact in campaign.contacts(name)}
        lowest = min(ratios, key=ratios.get)
        if ratios[lowest] < FULL_CONTACT_BELOW:
            source = f" for {lowest.material} on {lowest.surface} at rms slope {lowest.rms_slope:.3g}"
            value = f"asperities with U_full/dgamma = {ratios[lowest]:.3g}"
            key, usual = ("models", _RATIO) if study.levels is None else ("levels", _RATIO_OF_LEVELS)
            yield Unusual(("studies", name, key), value, usual, source)
