"""Metadata of a deposit: licence, CITATION.cff, metadata for Zenodo, attributes of the campaign dataset."""

import json
import re
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from icha.configuration.campaign import Campaign
from icha.configuration.publication import Author, Funding, Publication
from icha.contact.models import MODEL_PAPER
from icha.deposit.verify import ZENODO, read_text

TABLES = yaml.safe_load(Path(__file__).with_name("tables.yaml").read_text(encoding="utf-8"))


class Licence(NamedTuple):
    """A licence of data: SPDX identifier, name and web address."""

    identifier: str
    name: str
    address: str


def find_licence(identifier: str) -> Licence:
    """Return the licence with an SPDX identifier.

    Raises
    ------
    ValueError
        If the identifier is not an SPDX identifier of a single licence, or has another spelling than in SPDX.
    """
    try:
        found = canonicalize_license_expression(identifier)
    except InvalidLicenseExpression:
        found = ""
    if not re.fullmatch(r"(?!LicenseRef-)[A-Za-z0-9.-]+", found):
        raise ValueError(
            "is not a licence in the SPDX list; expected one identifier of https://spdx.org/licenses, for data usually "
            f"{' or '.join(TABLES['licences'])}"
        )
    if identifier != found:
        raise ValueError(f"has another spelling in the SPDX list; expected {found!r}")
    return Licence(found, *TABLES["licences"].get(found, (found, f"https://spdx.org/licenses/{found}.html")))


def licence_problem(campaign: Campaign) -> tuple[str, str] | None:
    """Return configuration key and text of a problem with the licence of the data; None if there is no problem."""
    licence = campaign.deposit_metadata().license
    try:
        find_licence(licence)
    except ValueError as error:
        return "publication.license" if campaign.publication.license else "license", f"{licence!r} {error}"
    return None


def acknowledgement(funding: Funding) -> str:
    """Return a sentence that acknowledges funder and grant, with the web address of the grant if it is known."""
    number = f"award {funding.award_number}" if funding.award_number else ""
    award = ": ".join(filter(None, (number, funding.award_title)))
    award = ", ".join(filter(None, (award, funding.award_url and web_address(funding.award_url))))
    return f"Funded by {funding.funder}{f' ({award})' if award else ''}"


def discovery_attributes(publication: Publication) -> dict[str, str]:
    """Return attributes of the Attribute Convention for Data Discovery (ACDD 1.3) that describe a publication.

    Semicolons separate creators, because names contain commas. Every attribute lists the creators in the same order.
    """
    authors = publication.authors
    values = {
        "creator_name": [author.full_name for author in authors],
        "creator_type": ["person" if author.is_person else "institution" for author in authors],
        "creator_url": [author.orcid_address or author.ror or "" for author in authors],
        "creator_institution": [author.affiliation or "" for author in authors],
        "keywords": [", ".join(publication.keywords)],
        "product_version": [publication.version or ""],
        "acknowledgement": [acknowledgement(each) for each in publication.funding],
        "metadata_link": [f"https://doi.org/{publication.doi}" if publication.doi else ""],
    }
    return {name: "; ".join(texts) for name, texts in values.items() if any(texts)}


def web_address(identifier: str) -> str:
    """Return the web address for a DOI or an identifier `arXiv:…`; return a web address unchanged."""
    if identifier.startswith("10."):
        return f"https://doi.org/{identifier}"
    return identifier.replace("arXiv:", "https://arxiv.org/abs/", 1)


def citation_cff(publication: Publication, revision: str) -> str:
    """Return CITATION.cff of the data, in Citation File Format 1.2.0 (https://doi.org/10.5281/zenodo.5171937).

    Parameters
    ----------
    publication : complete metadata (`icha.configuration.publication.missing_metadata`).
    revision : revision of the program that made the data.
    """
    licence = find_licence(publication.license)
    paper = {
        "type": "article",
        "title": MODEL_PAPER.title,
        "authors": [{"family-names": family, "given-names": given} for given, family in MODEL_PAPER.authors],
        "year": MODEL_PAPER.year,
        "url": MODEL_PAPER.address,
    }
    content = {
        "cff-version": "1.2.0",
        "message": "If you use these data, please cite the data as below, and the paper of the model (in references).",
        "type": "dataset",
        "title": publication.title,
        "abstract": publication.summary,
        "authors": [_cff_author(author) for author in publication.authors],
        "version": publication.version,
        "date-released": publication.date,
        # The format accepts only the SPDX licences of 2021. Any other licence is given by its web address.
        "license": licence.identifier if licence.identifier in TABLES["licences"] else None,
        "license-url": None if licence.identifier in TABLES["licences"] else licence.address,
        "commit": revision,
        "doi": publication.doi,
        "keywords": publication.keywords,
        "references": [paper],
    }
    return yaml.safe_dump(without_empty(content), sort_keys=False, allow_unicode=True, width=100)


def _cff_author(author: Author) -> dict[str, str | None]:
    if not author.is_person:
        return {"name": author.name, "website": author.ror}
    names = {"family-names": author.family_names, "given-names": author.given_names}
    return names | {"orcid": author.orcid_address, "affiliation": author.affiliation}


def zenodo_metadata(publication: Publication) -> dict[str, Any]:
    """Return the metadata of `.zenodo.json` in the format of Zenodo's deposit API (https://developers.zenodo.org).

    Grants are listed if Zenodo has a record of the funder. The notes list all funding, and all runs that are published
    although a check failed.
    """
    notes = [f"{acknowledgement(funding)}." for funding in publication.funding]
    notes += [f"Published with a failed check: {each.run}. {each.reason}" for each in publication.known_failures]
    creators = [
        {"name": author.sorted_name, "affiliation": author.affiliation, "orcid": author.orcid}
        for author in publication.authors
    ]
    related = [
        {
            "identifier": each.identifier,
            "relation": each.relation[0].lower() + each.relation[1:],
            "resource_type": each.resource and TABLES["zenodo_types"][each.resource],
        }
        for each in publication.related_identifiers
    ]
    grants = [
        {"id": f"{funding.funder_id}::{funding.award_number}"}
        for funding in publication.funding
        if funding.funder_id in TABLES["zenodo_funders"] and funding.award_number
    ]
    content = {
        "upload_type": "dataset",
        "title": publication.title,
        "description": _html(paragraphs(publication.summary)),
        "publication_date": publication.date,
        "version": publication.version,
        "creators": creators,
        "access_right": "open",
        "license": find_licence(publication.license).identifier.lower(),
        "language": "eng",
        "doi": publication.doi,
        "keywords": publication.keywords,
        "related_identifiers": related,
        "references": [MODEL_PAPER.line],
        "grants": grants,
        "communities": [{"identifier": community} for community in publication.communities],
        "notes": _html(notes),
    }
    return without_empty(content)


def read_zenodo_metadata(folder: Path) -> dict[str, Any]:
    """Read the metadata for Zenodo from a deposit of unknown origin; raise ValueError if the content is invalid."""
    try:
        metadata = json.loads(read_text(folder, ZENODO))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{ZENODO}: cannot be read: {error}") from None
    if not isinstance(metadata, dict):
        raise ValueError(f"{ZENODO}: is not a mapping; expected a JSON object")
    return metadata


def paragraphs(text: str) -> list[str]:
    """Split a text at empty lines into paragraphs, and join the lines of each paragraph."""
    return [" ".join(part.split()) for part in re.split(r"\n\s*\n", text) if part.strip()]


def _html(texts: list[str]) -> str:
    """Return paragraphs of plain text as HTML."""
    return "".join(f"<p>{escape(text, quote=False)}</p>" for text in texts)


def without_empty(content: Any) -> Any:
    """Return nested mappings and lists without empty entries of mappings."""
    if isinstance(content, dict):
        pruned = {key: without_empty(value) for key, value in content.items()}
        return {key: value for key, value in pruned.items() if value not in (None, [], "")}
    return [without_empty(each) for each in content] if isinstance(content, list) else content
