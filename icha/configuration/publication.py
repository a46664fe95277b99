"""What a deposit says of itself: its version, who made it, under which licence, who paid, what it belongs to.

Everything here may be left out of a configuration; only a deposit needs it (`icha.configuration.publication.needed`).
"""

import datetime
import re
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, model_validator

from icha.datasets.labels import RunLabels
from icha.support.values import Problem, Section, Text, distinct

# Relations of a deposit to other works: the types of DataCite 4.5 that Zenodo knows, too.
RELATIONS = tuple(
    "IsCitedBy Cites IsSupplementTo IsSupplementedBy IsContinuedBy Continues IsDescribedBy Describes HasMetadata "
    "IsMetadataFor IsNewVersionOf IsPreviousVersionOf IsPartOf HasPart IsReferencedBy References IsDocumentedBy "
    "Documents IsCompiledBy Compiles IsVariantFormOf IsOriginalFormOf IsIdenticalTo IsReviewedBy Reviews IsDerivedFrom "
    "IsSourceOf IsRequiredBy Requires Obsoletes IsObsoletedBy".split()
)
# Kinds of related works, by DataCite's names.
RESOURCES = tuple(
    "Book BookChapter ConferencePaper Dataset Dissertation Image JournalArticle Other Preprint Report Software Text "
    "Workflow".split()
)
# Characters of a web address (RFC 3986).
_ADDRESS = r"[^\s<>\"{}|\\^`\x00-\x1f\u200b-\u200f]+"
_DOI = re.compile(rf"10\.[0-9]{{4,9}}/{_ADDRESS}")
_ARXIV = re.compile(r"arXiv:([0-9]{4}\.[0-9]{4,5}|[a-z-]+(\.[A-Z]{2})?/[0-9]{7})(v[0-9]+)?")
_URL = re.compile(rf"https?://[^\s/]+\.{_ADDRESS}")
# The digits of Crockford's base 32.
_BASE_32 = "0123456789abcdefghjkmnpqrstvwxyz"
_ROR = re.compile(rf"(https?://ror\.org/)?0([{_BASE_32}]{{6}})([0-9]{{2}})")


def _line(value: str) -> str:
    """Refuse text with line breaks or tabs, or without a visible character."""
    if "\n" in value or "\t" in value:
        raise ValueError(
            "holds a line break or a tab; allowed: text of one line; in YAML, >- and |- end it without one"
        )
    return _prose(value)


def _prose(value: str) -> str:
    if not any(char.isprintable() and not char.isspace() for char in value):
        raise ValueError("is blank; allowed: text")
    return value


def _once(entries: list) -> list:
    """Refuse a list of sections in which an entry stands twice."""
    seen = set()
    for entry in entries:
        written = entry.model_dump_json(exclude_none=True)
        if written in seen:
            raise ValueError(f"{written} is given twice; allowed: every entry once")
        seen.add(written)
    return entries


def _orcid(value: str) -> str:
    """Refuse an ORCID of the wrong form or with a wrong check digit (ISO 7064 mod 11-2); its address is accepted."""
    plain = re.sub(r"^https?://orcid\.org/", "", str(value))
    total = 0
    for digit in plain.replace("-", "")[:-1]:
        total = (total + int(digit)) * 2 if digit.isdecimal() else 0
    check = "0123456789X"[(12 - total % 11) % 11]
    if not re.fullmatch(r"([0-9]{4}-){3}[0-9]{3}[0-9X]", plain) or plain[-1] != check:
        raise ValueError("is no ORCID, or its check digit is wrong; allowed: such as '0000-0002-1825-0097'")
    return plain


def _ror(value: Any) -> str:
    """Refuse what is no identifier of the Research Organization Registry, by its check digits (ISO 7064 mod 97-10)."""
    found, number = _ROR.fullmatch(str(value).lower()), 0
    for digit in found[2] if found else "":
        number = 32 * number + _BASE_32.index(digit)
    if not found or int(found[3]) != 98 - number * 100 % 97:
        raise ValueError(
            "is no ROR identifier, or its check digits are wrong; allowed: one of https://ror.org, such as "
            "'https://ror.org/03yrm5c26'"
        )
    return f"https://ror.org/0{found[2]}{found[3]}"


def _plain_doi(value: Any) -> str | None:
    """Return the DOI that a text or an address of doi.org is; None if it is none."""
    plain = re.sub(r"(?i)^(https?://(dx\.)?doi\.org/|doi:)", "", str(value))
    return plain if _DOI.fullmatch(plain) else None


def _doi(value: Any) -> str:
    if doi := _plain_doi(value):
        return doi
    raise ValueError("is no DOI; allowed: a DOI such as '10.1007/s11249-017-0900-2'")


def _identifier(value: Any) -> str:
    if doi := _plain_doi(value):
        return doi
    if isinstance(value, str) and (_ARXIV.fullmatch(value) or _URL.fullmatch(value)):
        return value
    raise ValueError(
        "is no identifier; allowed: a DOI such as '10.1007/s11249-017-0900-2', 'arXiv:1234.56789', or a web address"
    )


def _funder(value: Any) -> str:
    """Refuse what is neither a DOI nor a ROR identifier."""
    return _plain_doi(value) or _ror(value)


def _community(value: Any) -> str:
    if not re.fullmatch(r"[a-z0-9_-]+", str(value)):
        raise ValueError(
            "is no community of Zenodo; allowed: what its address ends with: lower-case letters, digits, - and _"
        )
    return value


def _date(value: Any) -> str:
    """Refuse what is not a day of the calendar, or one of another age; YAML makes a date of its text."""
    value = value.isoformat() if isinstance(value, datetime.date) else str(value)
    try:
        if not re.fullmatch(r"(19|20|21)[0-9]{2}-[0-9]{2}-[0-9]{2}", value):
            raise ValueError
        datetime.date.fromisoformat(value)
    except ValueError:
        raise ValueError("is no date; allowed: year, month and day from 1900 to 2199, such as 2026-01-31") from None
    return value


def _version(value: Any) -> str:
    """Refuse a version that cannot be part of a folder's name; a number is refused, since 1.10 would become 1.1."""
    if not isinstance(value, str) or not re.fullmatch(r"[0-9A-Za-z]([0-9A-Za-z.+_-]{0,38}[0-9A-Za-z])?", value):
        raise ValueError(
            "is no version; allowed: letters, digits and . + - _ between them, in quotes if it looks like a number, "
            "such as '1.0.0'"
        )
    return value


def _example(check: Callable[[Any], str], example: str):
    """Type of a text that is checked, with an example for the schema."""
    return Annotated[str, BeforeValidator(check), WithJsonSchema({"type": "string", "examples": [example]})]


Orcid = _example(_orcid, "0000-0002-1825-0097")
Ror = _example(_ror, "https://ror.org/03yrm5c26")
Doi = _example(_doi, "10.1007/s11249-017-0900-2")
Identifier = _example(_identifier, "10.1007/s11249-017-0900-2")
FunderId = _example(_funder, "https://ror.org/00k4n6c32")
Community = _example(_community, "contact-mechanics")
Date = _example(_date, "2026-01-31")
Version = _example(_version, "1.0.0")
Line = Annotated[Text, AfterValidator(_line)]
Prose = Annotated[Text, AfterValidator(_prose)]


class Author(Section):
    """Who made the data: a person, by `family_names` and `given_names`, or an organisation, by `name`."""

    family_names: Line | None = Field(default=None, description="Family names of a person.")
    given_names: Line | None = Field(default=None, description="Given names of a person.")
    name: Line | None = Field(default=None, description="Name of an organisation or a team.")
    orcid: Orcid | None = Field(default=None, description="ORCID of a person, such as `0000-0002-1825-0097`.")
    affiliation: Line | None = Field(default=None, description="Institution of a person.")
    ror: Ror | None = Field(
        default=None, description="ROR identifier of the institution, such as `https://ror.org/03yrm5c26`."
    )

    @model_validator(mode="after")
    def _who(self):
        person = self.family_names is not None or self.given_names is not None
        if person == (self.name is not None) or (person and None in (self.family_names, self.given_names)):
            raise ValueError(
                f"{self.model_dump(exclude_none=True)} is neither a person nor an organisation; allowed: family_names "
                "and given_names of a person, or name of an organisation"
            )
        if (self.orcid and not person) or (self.ror and person and not self.affiliation):
            raise ValueError("allowed: orcid of a person; ror of an organisation, or beside a person's affiliation")
        return self

    @property
    def is_person(self) -> bool:
        """Whether it is a person."""
        return self.name is None

    @property
    def orcid_address(self) -> str | None:
        """Where the ORCID leads, if there is one."""
        return self.orcid and f"https://orcid.org/{self.orcid}"

    @property
    def full_name(self) -> str:
        """The name as it is read: given names before family names."""
        return self.name if self.name is not None else f"{self.given_names} {self.family_names}"

    @property
    def sorted_name(self) -> str:
        """The name as it is sorted: family names before given names."""
        return self.name if self.name is not None else f"{self.family_names}, {self.given_names}"


class Funding(Section):
    """Sources of funding."""

    funder: Line = Field(description="Name of the funder.")
    funder_id: FunderId | None = Field(
        default=None, description="Its identifier: that of ROR (`https://ror.org/…`) or a DOI of the funder registry."
    )
    award_number: Line | None = Field(default=None, description="Number of the grant.")
    award_title: Line | None = Field(default=None, description="Title of the grant.")
    award_url: Identifier | None = Field(default=None, description="Web address or DOI of the grant.")


class RelatedIdentifier(Section):
    """Something that the deposit is related to: the paper that it supplements, data that it was made from."""

    identifier: Identifier = Field(description="A DOI, `arXiv:…`, or a web address.")
    relation: Literal[RELATIONS] = Field(
        description="Relation of the deposit to it, by DataCite's names, such as `IsSupplementTo` or `Cites`."
    )
    resource: Literal[RESOURCES] | None = Field(
        default=None, description="What it is, by DataCite's names, such as `JournalArticle`."
    )


class KnownFailure(Section):
    """A run with a failed check that is published nevertheless, and why."""

    run: Line = Field(description="The run as the verdict names it: `study/surface/seed1/slope1/material`.")
    reason: Prose = Field(
        description="Explanation for readers: why it failed, and why the data are published nevertheless."
    )


Authors = Annotated[list[Author], AfterValidator(_once)]
Fundings = Annotated[list[Funding], AfterValidator(_once)]
Related = Annotated[list[RelatedIdentifier], AfterValidator(_once)]
Failures = Annotated[list[KnownFailure], AfterValidator(_once)]


class Publication(Section):
    """Metadata of a deposit. They are only needed when something is to be published."""

    version: Version | None = Field(
        default=None, description="Version of the data, such as `1.0.0`; needed to publish."
    )
    date: Date | None = Field(default=None, description="Day of publication, such as `2026-01-31`; needed to publish.")
    authors: Authors = Field(default=[], description="Who made the data; at least one is needed to publish.")
    title: Line | None = Field(default=None, description="Title of the deposit; that of the campaign if left out.")
    summary: Prose | None = Field(default=None, description="Abstract; the summary of the campaign if left out.")
    license: Line | None = Field(
        default=None, description="Licence of the data, an SPDX identifier; that of the campaign if left out."
    )
    keywords: Annotated[list[Line], AfterValidator(distinct)] = Field(default=[], description="Keywords.")
    funding: Fundings = Field(default=[], description="Sources of funding.")
    related_identifiers: Related = Field(
        default=[], description="Papers, data and programs that the deposit is related to."
    )
    doi: Doi | None = Field(default=None, description="DOI of this version, if one is reserved for it.")
    communities: Annotated[list[Community], AfterValidator(distinct)] = Field(
        default=[], description="Communities of Zenodo to which the deposit is submitted."
    )
    known_failures: Failures = Field(
        default=[], description="Runs whose checks fail and that are published nevertheless."
    )

    def problems(self, campaign: Any) -> Iterator[Problem]:
        """Failures that are known of runs that are none of its `icha.configuration.campaign.Campaign`."""
        if not self.known_failures:
            return
        runs = {
            RunLabels(label, model, *contact).path
            for label, study in campaign.studies.items()
            for model in study.models
            for contact in campaign.contacts(label)
        }
        for index, failure in enumerate(self.known_failures):
            if failure.run not in runs:
                reason = f"is not a run; allowed: a run of the campaign, such as {min(runs)}"
                yield ("known_failures", index, "run"), failure.run, reason


def needed(publication: Publication) -> list[str]:
    """What keeps it from being a deposit, a line for each key, with what is needed; empty if nothing does."""
    missing = {
        "version": (publication.version is None, "the version of the data, such as '1.0.0'"),
        "date": (publication.date is None, "the day of publication, such as 2026-01-31"),
        "authors": (not publication.authors, "at least one, with family_names and given_names, or name"),
    }
    found = [f"publication.{key}: is missing; needed: {what}" for key, (lacks, what) in missing.items() if lacks]
    # Those of the section have been checked; those of the campaign, which take their place, have not.
    for key, check in {"title": _line, "summary": _prose}.items():
        try:
            check(getattr(publication, key))
        except ValueError as error:
            found.append(f"{key}: {getattr(publication, key)!r} {error}")
    return found
