"""Software that only some campaigns need."""

import importlib.util

from icha.configuration.campaign import Campaign

TAMAAS = "tamaas"
# Sections of a campaign that ask for boundary elements at finite ranges.
BY_TAMAAS = ("finite_range", "boundary_element_loops", "error_sources", "one_asperity")


def further_software(campaign: Campaign) -> tuple[str, ...]:
    """Packages that a campaign needs besides those that every campaign needs."""
    return (TAMAAS,) if _sections(campaign) else ()


def missing_software(campaign: Campaign) -> str | None:
    """What is not installed that a campaign needs, and how to install it; None if all is there."""
    if not further_software(campaign) or importlib.util.find_spec(TAMAAS):
        return None
    return (
        f"{', '.join(_sections(campaign))}: solved by Tamaas, which is not installed; `make tamaas` installs it in a "
        "clone, `pip install tamaas` elsewhere. It is an extra of the package, for its licence is AGPL-3.0-or-later."
    )


def _sections(campaign):
    return [name for name in BY_TAMAAS if getattr(campaign, name)]
