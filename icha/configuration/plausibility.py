"""Values that are allowed and almost surely slips, as a rule of their unit: what is usual, and what is meant anyway.

An unusual value is refused unless the list `confirmed` of the campaign names its key; then it is warned of.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

from icha.asperity.full_contact import FULL_CONTACT_BELOW, full_contact_energy_ratio
from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SelfAffineSurface
from icha.contact.models import DEFAULT_MODEL
from icha.support import formatting
from icha.support.values import Problem, listed, to_number, to_si
from icha.surfaces.moments import self_affine_full_contact_energy

CONFIRMED = "confirmed"
# Where keys of that name are quantities; in all other sections they are not, or are names of what is in these.
_SECTIONS = ("defaults", "surfaces", "materials", "studies")


class Usual(NamedTuple):
    """The usual values of a key, and why they end there."""

    si_unit: str
    least: str
    most: str
    why: str
    or_zero: bool = False

    def contains(self, value: Any) -> bool:
        """Whether a value, as it is written, is usual; what is no such value at all is refused elsewhere."""
        try:
            number = self._read(value)
        except ValueError:
            return True
        return (self.or_zero and number == 0) or self._read(self.least) <= number <= self._read(self.most)

    def _read(self, value):
        return to_number(value) if self.si_unit == "1" else to_si(value, self.si_unit)

    def __str__(self):
        """The range and its reason, as messages give them."""
        return f"{'0 or ' if self.or_zero else ''}{self.least} to {self.most} ({self.why})"


_SIDE = Usual("m", "1 nm", "1 m", "from a few atoms to a machine part")
_WAVE = Usual("m", "0.1 nm", "1 m", "from an atom to a machine part")
_SLOPE = Usual("1", "1e-4", "5", "from superpolished mirrors, 1e-3, to fracture surfaces, about 1")
# Why a measured slope may be unusual.
_OF_SLOPE = "as units, size, or a number for missing points make it"
_OF_ENERGY = "van der Waals forces give 10 to 200 mJ/m^2, clean metals 1 to 3 J/m^2"
_OF_RANGE = "chemical bonds reach less than 1 nm, van der Waals forces some nm, what grids resolve some 100 nm"
# By key. Wide on purpose: what is asked for by reason lies in it, a wrong prefix of a unit as a rule does not.
USUAL = {
    "contact_modulus": Usual("Pa", "1 kPa", "2000 GPa", "from soft gels to diamond against something rigid, 1150 GPa"),
    "surface_energy": Usual("J/m^2", "0.001 mJ/m^2", "3 J/m^2", _OF_ENERGY, or_zero=True),
    "interaction_range": Usual("m", "0.05 nm", "1 um", _OF_RANGE),
    "period": _SIDE,
    "size": _SIDE,
    "rolloff_wavelength": _WAVE,
    "short_wavelength": _WAVE,
    "cutoff": _WAVE,
    "rms_slope": _SLOPE,
    "rms_slopes": _SLOPE,
}


class Unusual(NamedTuple):
    """An unusual value: where it is written, the value, what is usual there, and whence it is if it is not written."""

    location: tuple
    value: Any
    usual: Usual
    source: str = ""

    @property
    def how(self) -> str:
        """Whence it is, as messages add it."""
        return f", {self.source}" if self.source else ""

    @property
    def key(self) -> str:
        """How `confirmed` calls it: all entries of a list by the key of the list."""
        return ".".join(part for part in self.location if isinstance(part, str))


def unusual_values(written: Mapping) -> list[Unusual]:
    """All unusual values of a configuration, as it was written."""
    return [found for section in _SECTIONS for found in _unusual((section,), written.get(section))]


def _unusual(location: tuple, value: Any) -> Iterator[Unusual]:
    if isinstance(value, Mapping | list):
        inside = value.items() if isinstance(value, Mapping) else enumerate(value)
        for part, each in inside:
            yield from _unusual((*location, part), each)
        return
    name = next(part for part in reversed(location) if isinstance(part, str))
    if name in USUAL and not USUAL[name].contains(value):
        yield Unusual(location, value, USUAL[name])


def unusual_topography(location: tuple, section: Any, period: float, rms_slope: float | None) -> Iterator[Unusual]:
    """What is unusual of a topography as its file has it.

    Parameters
    ----------
    location, section : of the surface in the configuration.
    period : side of the square, m.
    rms_slope : its own; None if no study asks for it.
    """
    if getattr(section, "size", section) is None and not _SIDE.contains(f"{period!r} m"):
        yield Unusual((*location, "size"), formatting.length(period), _SIDE, "as the file has it")
    if rms_slope is not None and not _SLOPE.contains(rms_slope):
        about = f"rms slope {rms_slope:.3g}"
        yield Unusual((*location, "height_unit"), about, _SLOPE, _OF_SLOPE)


def plausibility_problems(unusual: Collection[Unusual], confirmed: Any) -> Iterator[Problem]:
    """Unusual values that are not confirmed.

    `confirmed` is the list as it is written; what is no such list is refused elsewhere.
    """
    meant = set(_keys(confirmed))
    for each in unusual:
        if each.key not in meant:
            reason = f"is unusual{each.how}; usual: {each.usual}; allowed: another value, or, if it is meant, this one"
            yield each.location, each.value, f"{reason} with `{CONFIRMED}: [{each.key}]` at the top level"


def needless_confirmations(unusual: Collection[Unusual], confirmed: Any) -> Iterator[Problem]:
    """What is confirmed without being unusual."""
    keys = dict.fromkeys(each.key for each in unusual)
    for index, key in enumerate(_keys(confirmed)):
        if key not in keys:
            reason = f"is the key of no unusual value; allowed: {listed(keys) or 'nothing, for all values are usual'}"
            yield (CONFIRMED, index), key, reason


def _keys(confirmed):
    return [key for key in confirmed if isinstance(key, str)] if isinstance(confirmed, list) else []


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
        return self_affine_full_contact_energy(*section.lengths_and_hurst)
    return campaign.topography(surface).full_contact_energy


def energy_ratio(campaign: Campaign, contact) -> float:
    """U_full/dgamma of a contact: a case with its surface, rms slope and material."""
    material = campaign.materials[contact.material]
    energy = full_contact_energy(campaign, contact.surface) * contact.rms_slope**2
    return full_contact_energy_ratio(energy, material.contact_modulus, material.surface_energy)


def sticky_runs(campaign: Campaign) -> Iterator[Unusual]:
    """The stickiest run of asperities of every study in which full contact has the lower energy."""
    for name, study in campaign.studies.items():
        if DEFAULT_MODEL not in study.models:
            continue
        ratios = {contact: energy_ratio(campaign, contact) for contact in campaign.contacts(name)}
        lowest = min(ratios, key=ratios.get)
        if ratios[lowest] < FULL_CONTACT_BELOW:
            place = f"{lowest.material} on {lowest.surface} at rms slope {lowest.rms_slope:.3g}"
            value = f"asperities with U_full/dgamma = {ratios[lowest]:.3g}"
            yield Unusual(("studies", name, "models"), value, _RATIO, f"for {place}")
