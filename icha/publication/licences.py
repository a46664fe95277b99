"""Licences of data: which there are, by their SPDX identifiers, and the text of those that data usually have."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

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
    """The licence of an SPDX identifier, whose letters may be of either case.

    Raises
    ------
    ValueError
        If SPDX has no such licence, or if it is an expression of several.
    """
    try:
        canonical = canonicalize_license_expression(identifier)
    except InvalidLicenseExpression:
        canonical = ""
    if not canonical or " " in canonical or canonical.startswith("LicenseRef-"):
        raise ValueError(
            f"is no licence that SPDX knows; allowed: one identifier of https://spdx.org/licenses, for data usually "
            f"one of {', '.join(_USUAL)}"
        )
    if canonical not in _USUAL:
        return Licence(canonical, canonical, f"https://spdx.org/licenses/{canonical}.html", "")
    return Licence(canonical, *_USUAL[canonical], (_TEXTS / f"{canonical}.txt").read_text(encoding="utf-8"))


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
