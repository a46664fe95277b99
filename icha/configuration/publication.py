"""What a deposit says of itself: its version, who made it, under which licence, who paid, what it belongs to.

Everything here may be left out of a configuration; only a deposit needs it (`icha.configuration.publication.needed`).
"""

import datetime
import re
import unicodedata
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal
from urllib.parse import quote

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
_DOI = re.compile(r"10\.[0-9]{4,9}/.+", re.DOTALL)
_ARXIV = re.compile(r"arXiv:([0-9]{4}\.[0-9]{4,5}|[a-z-]+(\.[A-Z]{2})?/[0-9]{7})(v[0-9]+)?")
_URL = re.compile(r"https?://[^\s/]+\..+", re.DOTALL)
_DOI_SITE = re.compile(r"https?://(dx\.)?doi\.org/", re.IGNORECASE)
_ROR_SITE = re.compile(r"https?://ror\.org/", re.IGNORECASE)
# The digits of Crockford's base 32.
_BASE_32 = "0123456789abcdefghjkmnpqrstvwxyz"
_ROR = re.compile(rf"0([{_BASE_32}]{{6}})([0-9]{{2}})")
_FIRST_DAY, _LAST_DAY = "1900-01-01", "2199-12-31"


def _readable(value: Any, breaks: str, allowed: str) -> Any:
    """Refuse text without a visible character, and characters that formats of metadata cannot hold (XML 1.0, 2.2)."""
    if isinstance(value, str):
        for char in value:
            if char == "\n" and not breaks:
                raise ValueError(f"holds a line break; allowed: {allowed}; in YAML, >- and |- end it without one")
            foreign = unicodedata.category(char) in ("Cc", "Cs", "Zl", "Zp") or char in "\ufffe\uffff"
            if foreign and char not in breaks:
                raise ValueError(f"holds the control character {char!r}; allowed: {allowed}")
        if not any(char.isprintable() and not char.isspace() for char in value):
            raise ValueError(f"is blank; allowed: {allowed}")
    return value


def _line(value: Any) -> Any:
    return _readable(value, "", "text of one line")


def _prose(value: Any) -> Any:
    return _readable(value, "\n", "text, with or without line breaks")


def _once(what: str, key: Callable[[Any], tuple], shown: Callable[[Any], str]) -> AfterValidator:
    """Refuse a list with two entries that have the same key, whatever their capitals and spaces."""

    def check(entries):
        seen = set()
        for entry in entries:
            same = tuple(" ".join(str(part or "").split()).casefold() for part in key(entry))
            if same in seen:
                raise ValueError(f"{shown(entry)!r} is given twice; allowed: every {what} once")
            seen.add(same)
        return entries

    return AfterValidator(check)


def _orcid(value: str) -> str:
    """Refuse an ORCID of the wrong form or with a wrong check digit (ISO 7064 mod 11-2); an address is taken for it."""
    plain = re.sub(r"^https?://orcid\.org/", "", value) if isinstance(value, str) else value
    example = "allowed: four groups of four digits of which the last is a check digit, such as '0000-0002-1825-0097'"
    if not isinstance(plain, str) or not re.fullmatch(r"([0-9]{4}-){3}[0-9]{3}[0-9X]", plain):
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
    """Refuse what is no identifier of the Research Organization Registry, by its check digits (ISO 7064 mod 97-10)."""
    plain = _ROR_SITE.sub("", value).lower() if isinstance(value, str) else ""
    example = "allowed: one of https://ror.org, such as 'https://ror.org/03yrm5c26'"
    found = _ROR.fullmatch(plain)
    if not found:
        raise ValueError(f"is no ROR identifier; {example}")
    number = 0
    for digit in found[1]:
        number = 32 * number + _BASE_32.index(digit)
    if int(found[2]) != 98 - number * 100 % 97:
        raise ValueError(f"is no ROR identifier: its check digits are wrong; {example}")
    return f"https://ror.org/{plain}"


def _addressable(value: str) -> str:
    """Refuse characters that a web address cannot have (RFC 3986)."""
    for char in value:
        if char in ' <>"{}|\\^`':
            raise ValueError(f"holds {char!r}, which no web address can; allowed: none, or {quote(char)!r} for it")
        if char.isspace() or not char.isprintable():
            raise ValueError(f"holds {char!r}, which no web address can; allowed: visible characters")
    return value


def _plain_doi(value: Any) -> str | None:
    plain = re.sub(r"^doi:", "", _DOI_SITE.sub("", value)) if isinstance(value, str) else ""
    return _addressable(plain) if _DOI.fullmatch(plain) else None


def _doi(value: Any) -> str:
    """Refuse what is no DOI; take its address for itself."""
    plain = _plain_doi(value)
    if plain is None:
        raise ValueError("is no DOI; allowed: a DOI such as '10.1007/s11249-017-0900-2'")
    return plain


def _identifier(value: Any) -> str:
    """Refuse what is neither a DOI nor an arXiv identifier nor a web address; take a DOI's address for itself."""
    plain = _plain_doi(value)
    if plain is not None:
        return plain
    if isinstance(value, str) and (_ARXIV.fullmatch(value) or _URL.fullmatch(value)):
        return _addressable(value)
    raise ValueError(
        "is no identifier; allowed: a DOI such as '10.1007/s11249-017-0900-2', 'arXiv:1234.56789', or a web address"
    )


def _funder(value: Any) -> str:
    """Refuse what is neither a ROR identifier nor a DOI; take a DOI's address for itself."""
    if isinstance(value, str) and (_ROR_SITE.match(value) or _ROR.fullmatch(value.lower())):
        return _ror(value)
    plain = _plain_doi(value)
    if plain is None:
        raise ValueError(
            "is neither a ROR identifier nor a DOI; allowed: one of them, such as 'https://ror.org/00k4n6c32' or "
            "'10.13039/501100000780'"
        )
    return plain


def _community(value: Any) -> str:
    """Refuse what cannot name a community of Zenodo."""
    if not isinstance(value, str) or not re.fullmatch(r"[a-z0-9_-]+", value):
        raise ValueError(
            "is no community of Zenodo; allowed: what its address ends with: lower-case letters, digits, - and _"
        )
    return value


def _date(value: Any) -> str:
    """Refuse what is not a day of the calendar, or one of another age; YAML makes a date of its text."""
    value = value.isoformat() if isinstance(value, datetime.date) else value
    try:
        if not isinstance(value, str) or not re.fullmatch(r"[0-9]{4}-[0-9]{2}-[0-9]{2}", value):
            raise ValueError
        datetime.date.fromisoformat(value)
    except ValueError:
        raise ValueError("is no date; allowed: year, month and day, such as 2026-01-31") from None
    if not _FIRST_DAY <= value <= _LAST_DAY:
        raise ValueError(f"is no day of a publication; allowed: from {_FIRST_DAY} to {_LAST_DAY}")
    return value


def _version(value: Any) -> str:
    """Refuse a version that cannot be part of a folder's name; a number is refused, for 1.10 would become 1.1."""
    if not isinstance(value, str) or not re.fullmatch(r"[0-9A-Za-z]([0-9A-Za-z.+_-]{0,38}[0-9A-Za-z])?", value):
        raise ValueError(
            "is no version; allowed: letters, digits and . + - _ between them, in quotes if it looks like a number, "
            "such as '1.0.0'"
        )
    return value


def _schema(pattern: str, example: str):
    return WithJsonSchema({"type": "string", "pattern": pattern, "examples": [example]})


Orcid = Annotated[
    str,
    BeforeValidator(_orcid),
    _schema(r"^(https://orcid\.org/)?\d{4}-\d{4}-\d{4}-\d{3}[\dX]$", "0000-0002-1825-0097"),
]
Ror = Annotated[
    str, BeforeValidator(_ror), _schema(r"^(https?://ror\.org/)?0[A-Za-z0-9]{6}\d{2}$", "https://ror.org/03yrm5c26")
]
Doi = Annotated[str, BeforeValidator(_doi), _schema(r"10\.\d{4,9}/", "10.1007/s11249-017-0900-2")]
Identifier = Annotated[str, BeforeValidator(_identifier), _schema(r"^\S+$", "10.1007/s11249-017-0900-2")]
FunderId = Annotated[
    str,
    BeforeValidator(_funder),
    _schema(r"^(https?://ror\.org/)?0[A-Za-z0-9]{6}\d{2}$|10\.\d{4,9}/", "https://ror.org/00k4n6c32"),
]
Community = Annotated[str, BeforeValidator(_community), _schema(r"^[a-z0-9_-]+$", "contact-mechanics")]
Date = Annotated[str, BeforeValidator(_date), _schema(r"^\d{4}-\d{2}-\d{2}$", "2026-01-31")]
Version = Annotated[str, BeforeValidator(_version), _schema(r"^[0-9A-Za-z][0-9A-Za-z.+_-]*$", "1.0.0")]


Line = Annotated[Text, BeforeValidator(_line)]
Prose = Annotated[Text, BeforeValidator(_prose)]


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
        if not person and self.orcid is not None:
            raise ValueError("an organisation has no ORCID; allowed: orcid beside family_names and given_names")
        if person and self.ror is not None and self.affiliation is None:
            raise ValueError("a person has no ROR; allowed: ror beside affiliation, the institution that it identifies")
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


Authors = Annotated[
    list[Author],
    _once("author", lambda each: (each.orcid or each.full_name,), lambda each: each.full_name),
]
Fundings = Annotated[
    list[Funding],
    _once(
        "award of a funder",
        lambda each: (each.funder_id or each.funder, each.award_number or (each.award_title, each.award_url)),
        lambda each: each.funder,
    ),
]
Related = Annotated[
    list[RelatedIdentifier],
    _once(
        "relation to an identifier",
        lambda each: (each.relation, each.identifier),
        lambda each: f"{each.relation} {each.identifier}",
    ),
]
Failures = Annotated[list[KnownFailure], _once("run", lambda each: (each.run,), lambda each: each.run)]


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
