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
from icha.support.values import Problem, to_number, to_si
from icha.surfaces.moments import self_affine_full_contact_energy

CONFIRMED = "confirmed"
# Sections whose keys are checked.
_SECTIONS = ("defaults", "surfaces", "materials", "studies")


class Usual(NamedTuple):
    """Usual range of the values of a key, and the reason for this range."""

    si_unit: str
    least: str
    most: str
    why: str
    or_zero: bool = False

    def contains(self, value: Any) -> bool:
        """Return whether a value is in the usual range; True for invalid values, which other checks report."""
        try:
            number = self._read(value)
        except ValueError:
            return True
        # Other checks report negative values, and zero where it is not valid.
        return number <= 0 or self._read(self.least) <= number <= self._read(self.most)

    def _read(self, value):
        return to_number(value) if self.si_unit == "1" else to_si(value, self.si_unit)

    def __str__(self):
        """Return the usual range and its reason, as text for messages."""
        return f"{'0 or ' if self.or_zero else ''}{self.least} to {self.most} ({self.why})"


_MODULUS = Usual("Pa", "1 kPa", "2000 GPa", "from soft gels to diamond on a rigid body, 1150 GPa")
_SIDE = Usual("m", "1 nm", "1 m", "from a few atoms to a machine part")
_WAVE = Usual("m", "0.1 nm", "1 m", "from an atom to a machine part")
_RADIUS = Usual("m", "1 nm", "10 m", "from the tip of a microscope to a nearly flat lens")
_SLOPE = Usual("1", "1e-4", "5", "superpolished mirrors have 1e-3, fracture surfaces about 1")
_OF_ENERGY = "van der Waals forces give 10 to 200 mJ/m^2, clean metals 1 to 3 J/m^2"
_OF_RANGE = "chemical bonds have less than 1 nm, van der Waals forces some nm; a coarse grid may need some 100 nm"
# Usual values by key. The ranges contain every reasonable value and exclude most values with a wrong unit prefix.
USUAL = {
    "contact_modulus": _MODULUS,
    "youngs_modulus": _MODULUS,
    "surface_energy": Usual("J/m^2", "0.001 mJ/m^2", "3 J/m^2", _OF_ENERGY, or_zero=True),
    "interaction_range": Usual("m", "0.05 nm", "1 um", _OF_RANGE),
    "period": _SIDE,
    "side": _SIDE,
    "thickness": _SIDE,
    "radius": _RADIUS,
    "radii": _RADIUS,
    "size": _SIDE,
    "rolloff_wavelength": _WAVE,
    "short_wavelength": _WAVE,
    "cutoff": _WAVE,
    "rms_slope": _SLOPE,
    "rms_slopes": _SLOPE,
}


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
    if name in USUAL and not USUAL[name].contains(value):
        yield Unusual(location, value, USUAL[name])


def unusual_topography(location: tuple, section: Any, period: float, rms_slope: float | None) -> Iterator[Unusual]:
    """For a topography from a file, yield the size if it is unusual, and the rms slope if it is unusual.

    Parameters
    ----------
    location, section : keys that lead to the surface in the configuration, and the section of the surface.
    period : side of the square, m.
    rms_slope : measured rms slope; None if no study uses the measured slope.
    """
    if getattr(section, "size", section) is None and not _SIDE.contains(f"{period!r} m"):
        yield Unusual((*location, "size"), formatting.length(period), _SIDE, " in the file")
    if rms_slope is not None and not _SLOPE.contains(rms_slope):
        source = " (the slope depends on units, size and numbers for missing points)"
        yield Unusual((*location, "height_unit"), f"rms slope {rms_slope:.3g}", _SLOPE, source)


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
            if not campaign.surfaces[contact.surface].smooth and not _SLOPE.contains(contact.rms_slope):
                heights = ", ".join(map(formatting.length, study.rms_heights))
                source = f" on {contact.surface}, where the rms slope is {contact.rms_slope:.3g}"
                yield Unusual(("studies", name, "rms_heights"), heights, _SLOPE, source)
                break


_TOO_STICKY = (
    "for smaller values full contact has a lower energy than separated surfaces, and the asperity model does not "
)
_TOO_STICKY += "apply; use a rougher surface, a stiffer material, or "
_RATIO = Usual("1", f"{FULL_CONTACT_BELOW:g}", "inf", f"{_TOO_STICKY}`models: [boundary_elements]`")
_RATIO_OF_LEVELS = _RATIO._replace(why=f"{_TOO_STICKY}`levels` without `asperities`")


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
