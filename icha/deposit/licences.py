"""Licences of data: which there are, by their SPDX identifiers, and the text of those that data usually have."""

from pathlib import Path
from typing import NamedTuple

# Not of the public part, which does not tell licences from expressions, nor what is deprecated.
from packaging.licenses._spdx import LICENSES

from icha.configuration.campaign import Campaign

_TEXTS = Path(__file__).parent / "license_texts"
# Names and addresses of the licences whose text is here, as their authors give them.
_USUAL = {
    "CC-BY-4.0": (
        "Creative Commons Attribution 4.0 International",
        "https://creativecommons.org/licenses/by/4.0/",
    ),
    "CC-BY-SA-4.0": (
        "Creative Commons Attribution-ShareAlike 4.0 International",
        "https://creativecommons.org/licenses/by-sa/4.0/",
    ),
    "CC0-1.0": ("CC0 1.0 Universal", "https://creativecommons.org/publicdomain/zero/1.0/"),
    "ODbL-1.0": ("Open Data Commons Open Database License v1.0", "https://opendatacommons.org/licenses/odbl/1-0/"),
}


class Licence(NamedTuple):
    """A licence: its SPDX identifier, its name and address, and its text if that is here (else empty)."""

    identifier: str
    name: str
    address: str
    text: str


def known_licence(identifier: str) -> Licence:
    """The licence of an SPDX identifier.

    Raises
    ------
    ValueError
        If SPDX has no such licence, writes it otherwise, or has deprecated it, or if it is an expression of several.
    """
    known = LICENSES.get(identifier.strip().lower())
    if known is None:
        raise ValueError(
            f"is no licence that SPDX knows; allowed: one identifier of https://spdx.org/licenses, for data usually "
            f"one of {', '.join(_USUAL)}"
        )
    found = known["id"]
    if known["deprecated"]:
        current = ", ".join(repr(each) for each in _successors(found)) or "a current one of https://spdx.org/licenses"
        raise ValueError(f"is an identifier that SPDX has deprecated; allowed: {current}")
    if identifier != found:
        raise ValueError(f"is not written as SPDX writes it; allowed: {found!r}")
    if found not in _USUAL:
        return Licence(found, found, f"https://spdx.org/licenses/{found}.html", "")
    return Licence(found, *_USUAL[found], (_TEXTS / f"{found}.txt").read_text(encoding="utf-8"))


def licence_problem(campaign: Campaign) -> tuple[str, str] | None:
    """Key and text of what is wrong with the licence of a campaign's data; None if a deposit can have it."""
    licence = campaign.published().license
    try:
        known_licence(licence)
    except ValueError as error:
        return "publication.license" if campaign.publication.license else "license", f"{licence!r} {error}"
    return None


def _successors(deprecated: str) -> list[str]:
    """The current identifiers of a deprecated one that did not say which versions it means, or did so by a `+`."""
    plain = deprecated.removesuffix("+")
    possible = [f"{plain}-or-later"] if deprecated.endswith("+") else [f"{plain}-only", f"{plain}-or-later"]
    return [each for each in possible if each.lower() in LICENSES]


def licence_page(licence: Licence, *, source: str) -> str:
    """What a deposit says of its licence: which one it is, of what, and its text.

    Parameters
    ----------
    licence : that of the data.
    source : where the source of the program lies in the deposit.
    """
    name = licence.identifier if licence.name == licence.identifier else f"{licence.name} ({licence.identifier})"
    said = (
        f"Data, figures and texts of this deposit: {name}\n{licence.address}\n\n"
        f"The program in {source}/ has a licence of its own: {source}/LICENSE\n"
    )
    return f"{said}\n{'-' * 72}\n\n{licence.text}" if licence.text else said
