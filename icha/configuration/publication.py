"""Section `publication`: metadata of a deposit, which only a deposit needs."""

import datetime
import re
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, model_validator

from icha.datasets.labels import RunLabels
from icha.support.values import Problem, Section, Text, distinct

# Relations of a deposit to other works: the types of DataCite 4.5 that Zenodo also supports.
RELATIONS = tuple(
    "IsCitedBy Cites IsSupplementTo IsSupplementedBy IsContinuedBy Continues IsDescribedBy Describes HasMetadata "
    "IsMetadataFor IsNewVersionOf IsPreviousVersionOf IsPartOf HasPart IsReferencedBy References IsDocumentedBy "
    "Documents IsCompiledBy Compiles IsVariantFormOf IsOriginalFormOf IsIdenticalTo IsReviewedBy Reviews IsDerivedFrom "
    "IsSourceOf IsRequiredBy Requires Obsoletes IsObsoletedBy".split()
)
# Types of related works, by DataCite's names.
RESOURCES = tuple(
    "Book BookChapter ConferencePaper Dataset Dissertation Image JournalArticle Other Preprint Report Software Text "
    "Workflow".split()
)
# Characters of a web address (RFC 3986).
_ADDRESS = r"[^\s<>\"{}|\\^`\x00-\x1f\u200b-\u200f]+"
_ARXIV = r"arXiv:([0-9]{4}\.[0-9]{4,5}|[a-z-]+(\.[A-Z]{2})?/[0-9]{7})(v[0-9]+)?"
# Crockford's digits of base 32, and those of Python.
_FROM_CROCKFORD = str.maketrans("0123456789abcdefghjkmnpqrstvwxyz", "0123456789abcdefghijklmnopqrstuv")


def _line(value: str) -> str:
    """Refuse text with line breaks or tabs, or without a visible character."""
    if "\n" in value or "\t" in value:
        raise ValueError(
            "holds a line break or a tab; expected text of one line (in YAML, >- and |- end it without one)"
        )
    return _prose(value)


def _prose(value: str) -> str:
    """Refuse text without a visible character."""
    if not any(char.isprintable() and not char.isspace() for char in value):
        raise ValueError("is blank; expected text")
    return value


def _orcid(value: Any) -> str:
    """Return the ORCID in a text or a web address; refuse others and wrong check digits (ISO 7064 mod 11-2)."""
    plain = re.sub(r"^https?://orcid\.org/", "", str(value))
    if re.fullmatch(r"([0-9]{4}-){3}[0-9]{3}[0-9X]", plain):
        digits = [10 if digit == "X" else int(digit) for digit in reversed(plain.replace("-", ""))]
        if sum(digit * 2**power for power, digit in enumerate(digits)) % 11 == 1:
            return plain
    raise ValueError("is not an ORCID, or its check digit is wrong; expected one such as '0000-0002-1825-0097'")


def _ror(value: Any) -> str:
    """Return the address of a ROR identifier; refuse others and wrong check digits (ISO 7064 mod 97-10)."""
    found = re.fullmatch(r"(?:https?://ror\.org/)?(0([0-9a-hjkmnp-tv-z]{6})([0-9]{2}))", str(value).lower())
    if found and int(found[3]) == 98 - int(found[2].translate(_FROM_CROCKFORD), 32) * 100 % 97:
        return f"https://ror.org/{found[1]}"
    raise ValueError(
        "is not a ROR identifier, or its check digits are wrong; expected one of https://ror.org, such as "
        "'https://ror.org/03yrm5c26'"
    )


def _plain_doi(value: Any) -> str | None:
    """Return the DOI in a text or an address of doi.org; None if it is not a DOI."""
    plain = re.sub(r"(?i)^(https?://(dx\.)?doi\.org/|doi:)", "", str(value))
    return plain if re.fullmatch(rf"10\.[0-9]{{4,9}}/{_ADDRESS}", plain) else None


def _doi(value: Any) -> str:
    if doi := _plain_doi(value):
        return doi
    raise ValueError("is not a DOI; expected a DOI such as '10.1007/s11249-017-0900-2'")


def _identifier(value: Any) -> str:
    if doi := _plain_doi(value):
        return doi
    if isinstance(value, str) and re.fullmatch(rf"{_ARXIV}|https?://[^\s/]+\.{_ADDRESS}", value):
        return value
    raise ValueError(
        "is not an identifier; expected a DOI such as '10.1007/s11249-017-0900-2', 'arXiv:1234.56789', or a web address"
    )


def _date(value: Any) -> str:
    """Refuse values that are not a date from 1900 to 2199; the YAML reader may have converted the text to a date."""
    value = value.isoformat() if isinstance(value, datetime.date) else str(value)
    try:
        if not re.fullmatch(r"(19|20|21)[0-9]{2}-[0-9]{2}-[0-9]{2}", value):
            raise ValueError
        datetime.date.fromisoformat(value)
    except ValueError:
        raise ValueError("is not a date; expected year, month and day from 1900 to 2199, such as 2026-01-31") from None
    return value


def _example(check: Callable[[Any], str], example: str):
    """Make the type of a text with a check, and with an example for the schema."""
    return Annotated[str, BeforeValidator(check), WithJsonSchema({"type": "string", "examples": [example]})]


def _matching(pattern: str, problem: str, example: str):
    """Make the type of a text that matches a pattern."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or not re.fullmatch(pattern, value):
            raise ValueError(problem)
        return value

    return _example(check, example)


Orcid = _example(_orcid, "0000-0002-1825-0097")
Ror = _example(_ror, "https://ror.org/03yrm5c26")
Doi = _example(_doi, "10.1007/s11249-017-0900-2")
Identifier = _example(_identifier, "10.1007/s11249-017-0900-2")
FunderId = _example(lambda value: _plain_doi(value) or _ror(value), "https://ror.org/00k4n6c32")
Date = _example(_date, "2026-01-31")
Community = _matching(
    r"[a-z0-9_-]+",
    "is not a community of Zenodo; expected the end of its address: lower-case letters, digits, - and _",
    "contact-mechanics",
)
# Part of the name of a folder. YAML reads 1.10 without quotes as the number 1.1.
Version = _matching(
    r"[0-9A-Za-z]([0-9A-Za-z.+_-]{0,38}[0-9A-Za-z])?",
    "is not a version; expected letters, digits and . + - _ between them, in quotes if it looks like a number, such as "
    "'1.0.0'",
    "1.0.0",
)
Line = Annotated[Text, AfterValidator(_line)]
Prose = Annotated[Text, AfterValidator(_prose)]


class _Entry(Section):
    def __repr__(self):
        """Return the keys that the configuration contains, for messages."""
        return self.model_dump_json(exclude_none=True)


class Author(_Entry):
    """An author of the data: a person with `family_names` and `given_names`, or an organisation with `name`."""

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
                f"{self.model_dump(exclude_none=True)} is neither a person nor an organisation; expected "
                "family_names and given_names of a person, or name of an organisation"
            )
        if (self.orcid and not person) or (self.ror and person and not self.affiliation):
            raise ValueError("expected orcid only for a person, and ror for an organisation or with an affiliation")
        return self

    @property
    def is_person(self) -> bool:
        """Whether the author is a person."""
        return self.name is None

    @property
    def orcid_address(self) -> str | None:
        """Web address of the ORCID, if there is one."""
        return self.orcid and f"https://orcid.org/{self.orcid}"

    @property
    def full_name(self) -> str:
        """Name with given names before family names."""
        return self.name or f"{self.given_names} {self.family_names}"

    @property
    def sorted_name(self) -> str:
        """Name with family names before given names."""
        return self.name or f"{self.family_names}, {self.given_names}"


class Funding(_Entry):
    """A source of funding."""

    funder: Line = Field(description="Name of the funder.")
    funder_id: FunderId | None = Field(
        default=None,
        description="Identifier of the funder: of ROR (`https://ror.org/…`), or a DOI of the funder registry.",
    )
    award_number: Line | None = Field(default=None, description="Number of the grant.")
    award_title: Line | None = Field(default=None, description="Title of the grant.")
    award_url: Identifier | None = Field(default=None, description="Web address or DOI of the grant.")


class RelatedIdentifier(_Entry):
    """A work that the deposit is related to, such as the paper that it supplements, or data that it uses."""

    identifier: Identifier = Field(description="A DOI, `arXiv:…`, or a web address.")
    relation: Literal[RELATIONS] = Field(
        description="Relation of the deposit to the work, by DataCite's names, such as `IsSupplementTo` or `Cites`."
    )
    resource: Literal[RESOURCES] | None = Field(
        default=None, description="Type of the work, by DataCite's names, such as `JournalArticle`."
    )


class KnownFailure(_Entry):
    """A run with a failed check that is nevertheless published, with an explanation."""

    run: Line = Field(description="The run by its name in the verdict: `study/surface/seed1/slope1/material`.")
    reason: Prose = Field(
        description="Explanation for readers: why it failed, and why the data are nevertheless published."
    )


class Publication(Section):
    """Metadata of a deposit. Only `publish` needs them."""

    version: Version | None = Field(
        default=None, description="Version of the data, such as `1.0.0`; needed to publish."
    )
    date: Date | None = Field(default=None, description="Day of publication, such as `2026-01-31`; needed to publish.")
    authors: Annotated[list[Author], AfterValidator(distinct)] = Field(
        default=[], description="Authors of the data; at least one is needed to publish."
    )
    title: Line | None = Field(default=None, description="Title of the deposit. Default: that of the campaign.")
    summary: Prose | None = Field(default=None, description="Abstract. Default: the summary of the campaign.")
    license: Line | None = Field(
        default=None, description="Licence of the data, an SPDX identifier. Default: that of the campaign."
    )
    keywords: Annotated[list[Line], AfterValidator(distinct)] = Field(default=[], description="Keywords.")
    funding: Annotated[list[Funding], AfterValidator(distinct)] = Field(default=[], description="Sources of funding.")
    related_identifiers: Annotated[list[RelatedIdentifier], AfterValidator(distinct)] = Field(
        default=[], description="Papers, data and programs that the deposit is related to."
    )
    doi: Doi | None = Field(default=None, description="DOI of this version, if one is reserved.")
    communities: Annotated[list[Community], AfterValidator(distinct)] = Field(
        default=[], description="Communities of Zenodo to which the deposit is submitted."
    )
    known_failures: Annotated[list[KnownFailure], AfterValidator(distinct)] = Field(
        default=[], description="Runs with failed checks that are nevertheless published."
    )

    def problems(self, campaign: Any) -> Iterator[Problem]:
        """Report known failures of runs that its `icha.configuration.campaign.Campaign` does not have."""
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
                reason = f"is not a run; expected a run of the campaign, such as {min(runs)}"
                yield ("known_failures", index, "run"), failure.run, reason


def missing_metadata(publication: Publication) -> list[str]:
    """Return a line for each key that a deposit needs and the section lacks."""
    needed = {
        "version": "the version of the data, such as '1.0.0'",
        "date": "the day of publication, such as 2026-01-31",
        "authors": "at least one, with family_names and given_names, or name",
    }
    found = [
        f"publication.{key}: is missing; expected {what}"
        for key, what in needed.items()
        if not getattr(publication, key)
    ]
    # Those of the campaign, which are the defaults, have not been checked yet.
    for key, check in {"title": _line, "summary": _prose}.items():
        try:
            check(getattr(publication, key))
        except ValueError as error:
            found.append(f"{key}: {getattr(publication, key)!r} {error}")
    return found
