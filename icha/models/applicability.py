"""Where the asperity model is not applicable, whatever its equations give."""

from collections.abc import Sequence

from icha.asperity.full_contact import FULL_CONTACT_BELOW
from icha.path.limits import MAX_AREA_FRACTION

# Relative excess of a contact area over its limit that is within the tolerance of the equilibria.
_AREA_TOLERANCE = 1e-6


def asperity_applicability(
    full_contact_energy_ratio: float, summit_reasons: Sequence[str] = (), contact_area_fraction: float = 0.0
) -> str:
    """Return why the asperity model is not applicable; an empty text where it is.

    Parameters
    ----------
    full_contact_energy_ratio : elastic energy of full contact over the work of adhesion; infinite without adhesion.
    summit_reasons : reasons that lie in the summits of the surface.
    contact_area_fraction : largest A/A0 of the run.
    """
    reasons = []
    if full_contact_energy_ratio < FULL_CONTACT_BELOW:
        reasons.append(
            f"full contact has the lower energy (U_full/dgamma = {full_contact_energy_ratio:.3g}, less than "
            f"{FULL_CONTACT_BELOW:g})"
        )
    reasons += summit_reasons
    if contact_area_fraction > MAX_AREA_FRACTION * (1 + _AREA_TOLERANCE):
        reasons.append(f"contact area A/A0 = {contact_area_fraction:.3g}, beyond {MAX_AREA_FRACTION:g}")
    return f"asperity model not applicable: {'; '.join(reasons)}" if reasons else ""
