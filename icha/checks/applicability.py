"""Applicability of a model to a surface and a material, judged after a run."""

import math
from collections.abc import Sequence

from icha.path.targets import LEAST_GAP, largest_area_fraction
from icha.surfaces.surface import Surface

# Contact is concentrated at the edges of a free square if the share of contact in the outermost cells exceeds both the
# first number, and the share of these cells multiplied by the second number.
_EDGE_CONTACT, _EDGE_EXCESS = 0.05, 3.0


def reasons_of_edges(surface: Surface, steps: Sequence[dict]) -> list[str]:
    """Return a reason, as a sentence, if contact is concentrated at the edges of a free square; otherwise []."""
    largest = max((step.get("edge_contact", 0.0) for step in steps), default=0.0)
    share = 1 - (1 - 2 / surface.grid) ** 2
    if largest <= max(_EDGE_CONTACT, _EDGE_EXCESS * share):
        return []
    expected = "use a larger square" if surface.shape else "level the scan, or use a larger scan"
    return [
        f"{largest:.0%} of the contact area is in the outermost cells of the square, which are {share:.1%} of all "
        f"cells: the edges of the square carry the load; {expected}"
    ]


def asperity_applicability(
    full_contact_energy_ratio: float,
    summit_reasons: Sequence[str] = (),
    contact_area_fraction: float = 0.0,
    reduced_gap: float = math.inf,
) -> str:
    """Return the reasons why the asperity model is not applicable, as text; the text is empty if the model applies.

    Parameters
    ----------
    full_contact_energy_ratio : elastic energy of full contact divided by work of adhesion; infinite without adhesion.
    summit_reasons : reasons why the summits do not represent the surface.
    contact_area_fraction : largest contact area fraction A/A0 of the run.
    reduced_gap : smallest mean gap of the run, divided by the rms height.
    """
    reasons, ratio = list(summit_reasons), f"U_full/dgamma = {full_contact_energy_ratio:.3g}"
    limit = largest_area_fraction(full_contact_energy_ratio)
    if contact_area_fraction > limit:
        reasons.append(
            f"contact area A/A0 = {contact_area_fraction:.3g}, more than {limit:.3g}: adhesion unites neighbouring "
            f"spots ({ratio})"
        )
    if reduced_gap < LEAST_GAP:
        reasons.append(
            f"mean gap of {reduced_gap:.3g} rms heights, less than {LEAST_GAP:g}: the surfaces overlap beside the spots"
        )
    return f"asperity model not applicable: {'; '.join(reasons)}" if reasons else ""
