"""What a deposit says of itself: its version, who made it, under which licence, who paid, what it belongs to.

Everything here may be left out of a configuration; only a deposit needs it (`icha.configuration.publication.needed`).
"""

from __future__ import annotations

import datetime
import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, model_validator

from icha.configuration.values import Section, Text, distinct

# How a deposit may stand to something else: the relation types of DataCite 4.5 that Zenodo knows, too.
RELATIONS = (
    "IsCitedBy",
    "Cites",
    "IsSupplementTo",
    "IsSupplementedBy",
    "IsContinuedBy",
    "Continues",
    "IsDescribedBy",
    "Describes",
    "HasMetadata",
    "IsMetadataFor",
    "IsNewVersionOf",
    "IsPreviousVersionOf",
    "IsPartOf",
    "HasPart",
    "IsReferencedBy",
    "References",
    "IsDocumentedBy",
    "Documents",
    "IsCompiledBy",
    "Compiles",
    "IsVariantFormOf",
    "IsOriginalFormOf",
    "IsIdenticalTo",
    "IsReviewedBy",
    "Reviews",
    "IsDerivedFrom",
    "IsSourceOf",
    "IsRequiredBy",
    "Requires",
    "Obsoletes",
    "IsObsoletedBy",
)
# Kinds of what is related, by DataCite's names.
RESOURCES = (
    "Book",
    "BookChapter",
    "ConferencePaper",
    "Dataset",
    "Dissertation",
    "Image",
    "JournalArticle",
    "Other",
    "Preprint",
    "Report",
    "Software",
    "Text",
    "Workflow",
)
_DOI = re.compile(r"10\.\d{4,9}/\S+")
_ARXIV = re.compile(r"arXiv:(\d{4}\.\d{4,5}|[a-z-]+(\.[A-Z]{2})?/\d{7})(v\d+)?")
_URL = re.compile(r"https?://[^\s/]+\.[^\s]+")
_DOI_SITE = re.compile(r"https?://(dx\.)?doi\.org/", re.IGNORECASE)


def _orcid(value: str) -> str:
    """Refuse an ORCID of the wrong form or with a wrong check digit (ISO 7064 mod 11-2); an address is taken for it."""
    plain = re.sub(r"^https?://orcid\.org/", "", value) if isinstance(value, str) else value
    example = "allowed: four groups of four digits of which the last is a check digit, such as '0000-0002-1825-0097'"
    if not isinstance(plain, str) or not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", plain):
        raise ValueError(f"is no ORCID; {example}")
    digits = plain.replace("-", "")
    total = 0
    for digit in digits[:-1]:
        total = (total + int(digit)) * 2
    check = (12 - total % 11) % 11
    if digits[-1] != ("X" if check == 10 else str(check)):
        raise ValueError(f"is no ORCID: its check digit is wrong; {example}")
    return plain


def _ror(value: Any) -> str:
    """Refuse what is no identifier of the Research Organization Registry."""
    plain = re.sub(r"^https?://ror\.org/", "", value) if isinstance(value, str) else ""
    if not re.fullmatch(r"0[a-hj-km-np-tv-z0-9]{6}\d{2}", plain):
        raise ValueError("is no ROR identifier; allowed: one of https://ror.org, such as 'https://ror.org/03yrm5c26'")
    return f"https://ror.org/{plain}"


def _doi(value: Any) -> str:
    """Refuse what is no DOI; take its address for itself."""
    plain = re.sub(r"^doi:", "", _DOI_SITE.sub("", value)) if isinstance(value, str) else ""
    if not _DOI.fullmatch(plain):
        raise ValueError("is no DOI; allowed: a DOI such as '10.1007/s11249-017-0900-2'")
    return plain


def _identifier(value: Any) -> str:
    """Refuse what is neither a DOI nor an arXiv identifier nor a web address; take a DOI's address for itself."""
    if isinstance(value, str):
        plain = re.sub(r"^doi:", "", _DOI_SITE.sub("", value))
        for pattern, text in ((_DOI, plain), (_ARXIV, value), (_URL, value)):
            if pattern.fullmatch(text):
                return text
    raise ValueError(
        "is no identifier; allowed: a DOI such as '10.1007/s11249-017-0900-2', 'arXiv:1234.56789', or a web address"
    )


def _date(value: Any) -> str:
    """Refuse what is not a day of the calendar."""
    if isinstance(value, datetime.date) and not isinstance(value, datetime.datetime):
        return value.isoformat()
    try:
        if isinstance(value, str) and re.fullmatch(r"\d{4}-\d{2}-\d{2}", value):
            return datetime.date.fromisoformat(value).isoformat()
    except ValueError:
        pass
    raise ValueError("is no date; allowed: year, month and day, such as 2026-01-31")


def _version(value: Any) -> str:
    """Refuse a version that cannot be part of a folder's name; a number is refused, for 1.10 would become 1.1."""
    if not isinstance(value, str) or not re.fullmatch(r"[0-9A-Za-z]([0-9A-Za-z.+_-]{0,38}[0-9A-Za-z])?", value):
        raise ValueError(
            "is no version; allowed: letters, digits and . + - _ between them, in quotes if it looks like a number, "
            "such as '1.0.0'"
        )
    return value


def _text(pattern: str, example: str):
    return WithJsonSchema({"type": "string", "pattern": pattern, "examples": [example]})


Orcid = Annotated[
    str, BeforeValidator(_orcid), _text(r"^(https://orcid\.org/)?\d{4}-\d{4}-\d{4}-\d{3}[\dX]$", "0000-0002-1825-0097")
]
Ror = Annotated[
    str, BeforeValidator(_ror), _text(r"^(https://ror\.org/)?0[a-z0-9]{6}\d{2}$", "https://ror.org/03yrm5c26")
]
Doi = Annotated[str, BeforeValidator(_doi), _text(r"10\.\d{4,9}/", "10.1007/s11249-017-0900-2")]
Identifier = Annotated[str, BeforeValidator(_identifier), _text(r"^\S+$", "10.1007/s11249-017-0900-2")]
Date = Annotated[str, BeforeValidator(_date), _text(r"^\d{4}-\d{2}-\d{2}$", "2026-01-31")]
Version = Annotated[str, BeforeValidator(_version), _text(r"^[0-9A-Za-z][0-9A-Za-z.+_-]*$", "1.0.0")]


class Author(Section):
    """Who made the data: a person, by `family_names` and `given_names`, or an organisation, by `name`."""

    family_names: Text | None = Field(default=None, description="Family names of a person.")
    given_names: Text | None = Field(default=None, description="Given names of a person.")
    name: Text | None = Field(default=None, description="Name of an organisation or a team.")
    orcid: Orcid | None = Field(default=None, description="ORCID of a person, such as `0000-0002-1825-0097`.")
    affiliation: Text | None = Field(default=None, description="Institution of a person.")
    ror: Ror | None = Field(
        default=None, description="ROR identifier of the institution, such as `https://ror.org/03yrm5c26`."
    )

    @model_validator(mode="after")
    def _who(self):
        person = self.family_names is not None or self.given_names is not None
        if person == (self.name is not None) or (person and None in (self.family_names, self.given_names)):
            raise ValueError(
                "is neither a person nor an organisation; allowed: family_names and given_names of a person, or name "
                "of an organisation"
            )
        if not person and self.orcid is not None:
            raise ValueError("an organisation has no ORCID; allowed: orcid beside family_names and given_names")
        return self

    @property
    def is_person(self) -> bool:
        """Whether it is a person."""
        return self.name is None

    @property
    def full_name(self) -> str:
        """The name as it is read: given names before family names."""
        return self.name if self.name is not None else f"{self.given_names} {self.family_names}"

    @property
    def sorted_name(self) -> str:
        """The name as it is sorted: family names before given names."""
        return self.name if self.name is not None else f"{self.family_names}, {self.given_names}"


class Funding(Section):
    """Who paid."""

    funder: Text = Field(description="Name of the funder.")
    funder_id: Identifier | None = Field(
        default=None, description="Its identifier: that of ROR (`https://ror.org/…`) or a DOI of the funder registry."
    )
    award_number: Text | None = Field(default=None, description="Number of the grant.")
    award_title: Text | None = Field(default=None, description="Title of the grant.")
    award_url: Identifier | None = Field(default=None, description="Web address or DOI of the grant.")


class RelatedIdentifier(Section):
    """Something else that the deposit belongs to: the paper that it supplements, data that it was made from."""

    identifier: Identifier = Field(description="A DOI, `arXiv:…`, or a web address.")
    relation: Literal[RELATIONS] = Field(
        description="How the deposit stands to it, by DataCite's names, such as `IsSupplementTo` or `Cites`."
    )
    resource: Literal[RESOURCES] | None = Field(
        default=None, description="What it is, by DataCite's names, such as `JournalArticle`."
    )


class KnownFailure(Section):
    """A run with a failed check that is published nevertheless, and why."""

    run: Text = Field(description="The run as the verdict names it: `study/surface/seed1/slope1/material`.")
    reason: Text = Field(description="What readers are told: why it failed, and why the data are published.")


class Publication(Section):
    """What a deposit says of itself. Nothing of it is needed before something is to be published."""

    version: Version | None = Field(
        default=None, description="Version of the data, such as `1.0.0`; needed to publish."
    )
    date: Date | None = Field(default=None, description="Day of publication, such as `2026-01-31`; needed to publish.")
    authors: list[Author] = Field(default=[], description="Who made the data; at least one is needed to publish.")
    title: Text | None = Field(default=None, description="Title of the deposit; that of the campaign if left out.")
    summary: Text | None = Field(default=None, description="Abstract; the summary of the campaign if left out.")
    license: Text | None = Field(
        default=None, description="Licence of the data, an SPDX identifier; that of the campaign if left out."
    )
    keywords: Annotated[list[Text], AfterValidator(distinct)] = Field(default=[], description="Keywords.")
    funding: list[Funding] = Field(default=[], description="Who paid.")
    related_identifiers: list[RelatedIdentifier] = Field(
        default=[], description="Papers, data and programs that the deposit belongs to."
    )
    doi: Doi | None = Field(default=None, description="DOI of this version, if one is reserved for it.")
    communities: Annotated[list[Text], AfterValidator(distinct)] = Field(
        default=[], description="Communities of Zenodo to which it is proposed."
    )
    known_failures: list[KnownFailure] = Field(
        default=[], description="Runs whose checks fail and that are published nevertheless."
    )


# What the entries of its lists are.
PARTS = {
    "authors": Author,
    "funding": Funding,
    "related_identifiers": RelatedIdentifier,
    "known_failures": KnownFailure,
}


def needed(publication: Publication) -> list[str]:
    """What is missing for a deposit, a line for each key, with what is needed; empty if nothing is."""
    missing = {
        "version": (publication.version is None, "the version of the data, such as '1.0.0'"),
        "date": (publication.date is None, "the day of publication, such as 2026-01-31"),
        "authors": (not publication.authors, "at least one, with family_names and given_names, or name"),
    }
    return [f"publication.{key}: is missing; needed: {what}" for key, (lacks, what) in missing.items() if lacks]
