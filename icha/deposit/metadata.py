"""Metadata of a deposit: licence, CITATION.cff, metadata for Zenodo."""

import json
import re
from html import escape
from pathlib import Path
from typing import Any

import yaml
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from icha.configuration.campaign import Campaign
from icha.configuration.publication import Author, Funding, Publication
from icha.contact.models import MODEL_PAPER
from icha.deposit.verify import ZENODO, read_text

TABLES = yaml.safe_load(Path(__file__).with_name("tables.yaml").read_text(encoding="utf-8"))


# Common licences of data, which every reader of CITATION.cff knows; the format accepts only the SPDX licences of 2021.
COMMON_LICENCES = ("CC-BY-4.0", "CC-BY-SA-4.0", "CC0-1.0", "ODbL-1.0")


def licence_address(identifier: str) -> str:
    """Return the web address of the text of a licence with an SPDX identifier."""
    return f"https://spdx.org/licenses/{identifier}.html"


def licence_problem(campaign: Campaign) -> tuple[str, str] | None:
    """Return configuration key and text of a problem with the licence of the data; None if there is no problem.

    The licence must be the SPDX identifier of a single licence, with the spelling in SPDX.
    """
    licence = campaign.deposit_metadata().license
    key = "publication.license" if campaign.publication.license else "license"
    try:
        found = canonicalize_license_expression(licence)
    except InvalidLicenseExpression:
        found = ""
    if not re.fullmatch(r"(?!LicenseRef-)[A-Za-z0-9.-]+", found):
        return key, (
            f"{licence!r} is not a licence in the SPDX list; expected one identifier of https://spdx.org/licenses, for "
            f"data usually {' or '.join(COMMON_LICENCES)}"
        )
    return (key, f"{licence!r} has another spelling in the SPDX list; expected {found!r}") if licence != found else None


def acknowledgement(funding: Funding) -> str:
    """Return a sentence that acknowledges funder and grant, with the web address of the grant if it is known."""
    number = f"award {funding.award_number}" if funding.award_number else ""
    award = ": ".join(filter(None, (number, funding.award_title)))
    award = ", ".join(filter(None, (award, funding.award_url and web_address(funding.award_url))))
    return f"Funded by {funding.funder}{f' ({award})' if award else ''}"


def web_address(identifier: str) -> str:
    """Return the web address for a DOI or an identifier `arXiv:…`; return a web address unchanged."""
    if identifier.startswith("10."):
        return f"https://doi.org/{identifier}"
    return identifier.replace("arXiv:", "https://arxiv.org/abs/", 1)


def citation_cff(publication: Publication, revision: str) -> str:
    """Return CITATION.cff of the data, in Citation File Format 1.2.0 (https://doi.org/10.5281/zenodo.5171937)."""
    is_common = publication.license in COMMON_LICENCES
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
        "license": publication.license if is_common else None,
        "license-url": None if is_common else licence_address(publication.license),
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
        "license": publication.license.lower(),
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
