"""Metadata of a deposit: licence, CITATION.cff, files for Zenodo and DataCite, attributes of the campaign dataset."""

import json
import re
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from icha.configuration.campaign import Campaign
from icha.configuration.publication import Author, Funding, Publication, RelatedIdentifier
from icha.contact.models import MODEL_PAPER
from icha.deposit.verify import SOURCE, ZENODO, read_text

_FOLDER = Path(__file__).parent
TABLES = yaml.safe_load((_FOLDER / "tables.yaml").read_text(encoding="utf-8"))


class Licence(NamedTuple):
    """A licence of data.

    Attributes
    ----------
    identifier : SPDX identifier of the licence.
    name, address : name and web address of the licence.
    text : full text of the licence; "" if ICHA does not contain the text.
    """

    identifier: str
    name: str
    address: str
    text: str

    def page(self) -> str:
        """Return the text of LICENSE.txt of a deposit whose data have this licence."""
        statement = (
            f"Data, figures and texts of this deposit: {self.name} ({self.identifier})\n{self.address}\n\n"
            f"The program in {SOURCE}/ has another licence: {SOURCE}/LICENSE\n"
        )
        return f"{statement}\n{'-' * 72}\n\n{self.text}" if self.text else statement


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
    if found not in TABLES["licences"]:
        return Licence(found, found, f"https://spdx.org/licenses/{found}.html", "")
    text = (_FOLDER / f"license_texts/{found}.txt").read_text(encoding="utf-8")
    return Licence(found, *TABLES["licences"][found], text)


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
        "license": licence.identifier if licence.text else None,
        "license-url": None if licence.text else licence.address,
        "commit": revision,
        "doi": publication.doi,
        "keywords": publication.keywords,
        "references": [paper],
    }
    return yaml.safe_dump(_without_empty(content), sort_keys=False, allow_unicode=True, width=100)


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
    return _without_empty(content)


def read_zenodo_metadata(folder: Path) -> dict[str, Any]:
    """Read the metadata for Zenodo from a deposit of unknown origin; raise ValueError if the content is invalid."""
    try:
        metadata = json.loads(read_text(folder, ZENODO))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{ZENODO}: cannot be read: {error}") from None
    if not isinstance(metadata, dict):
        raise ValueError(f"{ZENODO}: is not a mapping; expected a JSON object")
    return metadata


def summary_of(metadata: dict[str, Any]) -> dict[str, str]:
    """Return title, version, authors, licence and communities of Zenodo metadata as text; values may have any type."""

    def join(entries: Any, key: str) -> str:
        entries = entries if isinstance(entries, list) else ()
        return "; ".join(str(each.get(key, "")) for each in entries if isinstance(each, dict))

    texts = {name: str(metadata.get(name, "")) for name in ("title", "version", "license")}
    communities = join(metadata.get("communities"), "identifier")
    return texts | {"authors": join(metadata.get("creators"), "name"), "community": communities}


def datacite_metadata(publication: Publication) -> dict[str, Any]:
    """Return the metadata of `datacite.json` in DataCite's schema 4.5 (https://doi.org/10.14454/g8e5-6293).

    The publisher is Zenodo if the DOI is from Zenodo, and otherwise `:tba`, DataCite's code for "to be announced".
    """
    licence = find_licence(publication.license)
    paper = RelatedIdentifier(identifier=f"arXiv:{MODEL_PAPER.arxiv}", relation="Cites", resource="Preprint")
    rights = {
        "rights": licence.name,
        "rightsUri": licence.address,
        "rightsIdentifier": licence.identifier,
        "rightsIdentifierScheme": "SPDX",
        "schemeUri": "https://spdx.org/licenses/",
    }
    related = [
        {
            "relatedIdentifier": each.identifier,
            "relatedIdentifierType": _datacite_type(each.identifier),
            "relationType": each.relation,
            "resourceTypeGeneral": each.resource,
        }
        for each in (*publication.related_identifiers, paper)
    ]
    content = {
        "schemaVersion": "http://datacite.org/schema/kernel-4",
        "doi": publication.doi,
        "types": {"resourceTypeGeneral": "Dataset", "resourceType": "Simulation results"},
        "creators": [_datacite_creator(author) for author in publication.authors],
        "titles": [{"title": publication.title}],
        "publisher": {"name": "Zenodo" if (publication.doi or "").startswith("10.5281/zenodo.") else ":tba"},
        "publicationYear": publication.date[:4],
        "dates": [{"date": publication.date, "dateType": "Issued"}],
        "version": publication.version,
        "language": "en",
        "descriptions": [{"description": publication.summary, "descriptionType": "Abstract"}],
        "subjects": [{"subject": keyword} for keyword in publication.keywords],
        "rightsList": [rights],
        "relatedIdentifiers": related,
        "fundingReferences": [_datacite_funding(funding) for funding in publication.funding],
    }
    return _without_empty(content)


def _datacite_creator(author: Author) -> dict[str, Any]:
    identifier, scheme = (author.orcid_address, "ORCID") if author.is_person else (author.ror, "ROR")
    named = {"nameIdentifier": identifier, "nameIdentifierScheme": scheme, "schemeUri": f"https://{scheme.lower()}.org"}
    place = {"name": author.affiliation}
    if author.ror:
        place |= {
            "affiliationIdentifier": author.ror,
            "affiliationIdentifierScheme": "ROR",
            "schemeUri": "https://ror.org",
        }
    return {
        "name": author.sorted_name,
        "nameType": "Personal" if author.is_person else "Organizational",
        "givenName": author.given_names,
        "familyName": author.family_names,
        "nameIdentifiers": [named] if identifier else [],
        "affiliation": [place] if author.affiliation else [],
    }


def _datacite_type(identifier: str) -> str:
    return "DOI" if identifier.startswith("10.") else "arXiv" if identifier.startswith("arXiv:") else "URL"


def _datacite_funding(funding: Funding) -> dict[str, Any]:
    identifier = funding.funder_id or ""
    registry = "ROR" if "ror.org" in identifier else "Crossref Funder ID" if "10.13039/" in identifier else "Other"
    return {
        "funderName": funding.funder,
        "funderIdentifier": web_address(identifier),
        "funderIdentifierType": identifier and registry,
        "awardNumber": funding.award_number,
        "awardTitle": funding.award_title,
        "awardUri": funding.award_url and web_address(funding.award_url),
    }


def paragraphs(text: str) -> list[str]:
    """Split a text at empty lines into paragraphs, and join the lines of each paragraph."""
    return [" ".join(part.split()) for part in re.split(r"\n\s*\n", text) if part.strip()]


def _html(texts: list[str]) -> str:
    """Return paragraphs of plain text as HTML."""
    return "".join(f"<p>{escape(text, quote=False)}</p>" for text in texts)


def _without_empty(content: Any) -> Any:
    """Return nested mappings and lists without empty entries of mappings."""
    if isinstance(content, dict):
        pruned = {key: _without_empty(value) for key, value in content.items()}
        return {key: value for key, value in pruned.items() if value not in (None, [], "")}
    return [_without_empty(each) for each in content] if isinstance(content, list) else content
