"""The citation of a deposit, the same for people (CITATION.cff), for Zenodo and for DataCite."""

import re
from html import escape
from typing import Any

import yaml

from icha.configuration.publication import Author, Funding, Publication
from icha.contact.models import MODEL_PAPER
from icha.deposit.attributes import acknowledgement
from icha.deposit.licences import known_licence

# Types of Zenodo for what is related, by DataCite's names (https://developers.zenodo.org, deposit metadata).
_ZENODO_TYPES = {
    "Book": "publication-book",
    "BookChapter": "publication-section",
    "ConferencePaper": "publication-conferencepaper",
    "Dataset": "dataset",
    "Dissertation": "publication-thesis",
    "Image": "image-other",
    "JournalArticle": "publication-article",
    "Other": "other",
    "Preprint": "publication-preprint",
    "Report": "publication-report",
    "Software": "software",
    "Text": "publication-other",
    "Workflow": "other",
}
# Funders whose grants Zenodo knows, by their DOI in the funder registry (the same page).
_ZENODO_FUNDERS = frozenset(
    {
        "10.13039/501100000923",
        "10.13039/501100002428",
        "10.13039/501100000780",
        "10.13039/501100000806",
        "10.13039/501100002341",
        "10.13039/501100004488",
        "10.13039/501100001871",
        "10.13039/501100004564",
        "10.13039/501100006588",
        "10.13039/501100000925",
        "10.13039/100000002",
        "10.13039/100000001",
        "10.13039/501100003246",
        "10.13039/501100000690",
        "10.13039/501100001711",
        "10.13039/501100001602",
        "10.13039/100004440",
    }
)
_ROR = "https://ror.org/"
_ZENODO_DOI = "10.5281/zenodo."


def web_address(identifier: str) -> str:
    """Where an identifier leads: a DOI, `arXiv:…` or a web address."""
    if identifier.startswith("10."):
        return f"https://doi.org/{identifier}"
    if identifier.startswith("arXiv:"):
        return f"https://arxiv.org/abs/{identifier.removeprefix('arXiv:')}"
    return identifier


def citation_cff(publication: Publication, revision: str) -> str:
    """CITATION.cff of the data, Citation File Format 1.2.0 (https://doi.org/10.5281/zenodo.5171937).

    Parameters
    ----------
    publication : what is to be cited; complete (`icha.configuration.publication.needed`).
    revision : the state of the program that made the data.
    """
    licence = known_licence(publication.license)
    content = {
        "cff-version": "1.2.0",
        "message": "If you use these data, please cite them as below, and the paper of their model (in references).",
        "type": "dataset",
        "title": publication.title,
        "abstract": publication.summary,
        "authors": [_cff_author(author) for author in publication.authors],
        "version": publication.version,
        "date-released": publication.date,
        # Of licences, the format knows those that SPDX had in 2021; an address can be given of any.
        "license": licence.identifier if licence.text else None,
        "license-url": None if licence.text else licence.address,
        "commit": revision,
        "doi": publication.doi,
        "keywords": publication.keywords,
        "references": [
            {
                "type": "article",
                "title": MODEL_PAPER.title,
                "authors": [{"family-names": family, "given-names": given} for given, family in MODEL_PAPER.authors],
                "year": MODEL_PAPER.year,
                "url": MODEL_PAPER.address,
            }
        ],
    }
    return yaml.safe_dump(_given(content), sort_keys=False, allow_unicode=True, width=100)


def _cff_author(author: Author) -> dict[str, str]:
    if not author.is_person:
        return _given({"name": author.name, "website": author.ror})
    return _given(
        {
            "family-names": author.family_names,
            "given-names": author.given_names,
            "orcid": author.orcid_address,
            "affiliation": author.affiliation,
        }
    )


def zenodo_metadata(publication: Publication) -> dict[str, Any]:
    """Metadata as Zenodo's deposit API takes them (https://developers.zenodo.org), also for `.zenodo.json`.

    Funding stands among the grants where Zenodo knows the funder's, and always in the notes; there, too, are the
    runs that are published although a check fails.
    """
    notes = [f"{acknowledgement(funding)}." for funding in publication.funding]
    notes += [f"Published with a failed check: {each.run}. {each.reason}" for each in publication.known_failures]
    grants = [
        {"id": f"{funding.funder_id}::{funding.award_number}"}
        for funding in publication.funding
        if funding.funder_id in _ZENODO_FUNDERS and funding.award_number
    ]
    return _given(
        {
            "upload_type": "dataset",
            "title": publication.title,
            "description": _html(paragraphs(publication.summary)),
            "publication_date": publication.date,
            "version": publication.version,
            "creators": [
                _given({"name": author.sorted_name, "affiliation": author.affiliation, "orcid": author.orcid})
                for author in publication.authors
            ],
            "access_right": "open",
            "license": known_licence(publication.license).identifier.lower(),
            "language": "eng",
            "doi": publication.doi,
            "keywords": publication.keywords,
            "related_identifiers": [
                _given(
                    {
                        "identifier": related.identifier,
                        "relation": related.relation[0].lower() + related.relation[1:],
                        "resource_type": related.resource and _ZENODO_TYPES[related.resource],
                    }
                )
                for related in publication.related_identifiers
            ],
            "references": [MODEL_PAPER.line],
            "grants": grants,
            "communities": [{"identifier": community} for community in publication.communities],
            "notes": _html(notes),
        }
    )


def datacite_metadata(publication: Publication) -> dict[str, Any]:
    """Metadata after DataCite's schema 4.5 (https://doi.org/10.14454/g8e5-6293), as JSON.

    Who publishes the data is known only if their DOI is; else it is `:tba`, DataCite's word for what will be known
    later.
    """
    licence = known_licence(publication.license)
    published = publication.doi is not None and publication.doi.startswith(_ZENODO_DOI)
    return _given(
        {
            "schemaVersion": "http://datacite.org/schema/kernel-4",
            "doi": publication.doi,
            "types": {"resourceTypeGeneral": "Dataset", "resourceType": "Simulation results"},
            "creators": [_datacite_creator(author) for author in publication.authors],
            "titles": [{"title": publication.title}],
            "publisher": {"name": "Zenodo" if published else ":tba"},
            "publicationYear": publication.date[:4],
            "dates": [{"date": publication.date, "dateType": "Issued"}],
            "version": publication.version,
            "language": "en",
            "descriptions": [{"description": publication.summary, "descriptionType": "Abstract"}],
            "subjects": [{"subject": keyword} for keyword in publication.keywords],
            "rightsList": [
                {
                    "rights": licence.name,
                    "rightsUri": licence.address,
                    "rightsIdentifier": licence.identifier,
                    "rightsIdentifierScheme": "SPDX",
                    "schemeUri": "https://spdx.org/licenses/",
                }
            ],
            "relatedIdentifiers": [
                _given(
                    {
                        "relatedIdentifier": related.identifier,
                        "relatedIdentifierType": _datacite_type(related.identifier),
                        "relationType": related.relation,
                        "resourceTypeGeneral": related.resource,
                    }
                )
                for related in publication.related_identifiers
            ],
            "relatedItems": [_datacite_paper()],
            "fundingReferences": [_datacite_funding(funding) for funding in publication.funding],
        }
    )


def _datacite_paper() -> dict[str, Any]:
    """The paper of the model."""
    return {
        "relatedItemType": "Preprint",
        "relationType": "Cites",
        "relatedItemIdentifier": {
            "relatedItemIdentifier": f"arXiv:{MODEL_PAPER.arxiv}",
            "relatedItemIdentifierType": "arXiv",
        },
        "publicationYear": str(MODEL_PAPER.year),
        "titles": [{"title": MODEL_PAPER.title}],
        "creators": [
            {"name": f"{family}, {given}", "nameType": "Personal", "givenName": given, "familyName": family}
            for given, family in MODEL_PAPER.authors
        ],
    }


def _datacite_creator(author: Author) -> dict[str, Any]:
    creator: dict[str, Any] = {
        "name": author.sorted_name,
        "nameType": "Personal" if author.is_person else "Organizational",
        "givenName": author.given_names,
        "familyName": author.family_names,
    }
    ror = author.ror and {"schemeUri": _ROR}
    if author.orcid:
        creator["nameIdentifiers"] = [
            {
                "nameIdentifier": author.orcid_address,
                "nameIdentifierScheme": "ORCID",
                "schemeUri": "https://orcid.org",
            }
        ]
    if ror and not author.is_person:
        creator["nameIdentifiers"] = [{"nameIdentifier": author.ror, "nameIdentifierScheme": "ROR"} | ror]
    elif ror:
        identified = {"affiliationIdentifier": author.ror, "affiliationIdentifierScheme": "ROR"} | ror
        creator["affiliation"] = [{"name": author.affiliation} | identified]
    elif author.affiliation:
        creator["affiliation"] = [{"name": author.affiliation}]
    return _given(creator)


def _datacite_type(identifier: str) -> str:
    return "DOI" if identifier.startswith("10.") else "arXiv" if identifier.startswith("arXiv:") else "URL"


def _datacite_funding(funding: Funding) -> dict[str, Any]:
    kind = None
    if funding.funder_id is not None:
        registries = {_ROR: "ROR", "10.13039/": "Crossref Funder ID"}
        kind = next((name for start, name in registries.items() if funding.funder_id.startswith(start)), "Other")
    return _given(
        {
            "funderName": funding.funder,
            "funderIdentifier": funding.funder_id and web_address(funding.funder_id),
            "funderIdentifierType": kind,
            "awardNumber": funding.award_number,
            "awardTitle": funding.award_title,
            "awardUri": funding.award_url and web_address(funding.award_url),
        }
    )


def paragraphs(text: str) -> list[str]:
    """The paragraphs of a text, between which lines are empty; each in a line."""
    return [" ".join(part.split()) for part in re.split(r"\n\s*\n", text) if part.strip()]


def _html(texts: list[str]) -> str:
    """Paragraphs of plain text as HTML."""
    return "".join(f"<p>{escape(text, quote=False)}</p>" for text in texts)


def _given(content: dict[str, Any]) -> dict[str, Any]:
    """Without what is not given."""
    return {key: value for key, value in content.items() if value not in (None, [], "")}
