"""Section `publication`: authors, version and other metadata of a deposit."""

import contextlib
import datetime
import re
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, WithJsonSchema, model_validator

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
# Translation of Crockford's digits of base 32 into the digits that Python reads.
_FROM_CROCKFORD = str.maketrans("0123456789abcdefghjkmnpqrstvwxyz", "0123456789abcdefghijklmnopqrstuv")


def _line(value: str) -> str:
    """Return a text of one line; raise ValueError for line breaks, tabs, or a text without visible characters."""
    if "\n" in value or "\t" in value:
        raise ValueError(
            "contains a line break or a tab; expected text of one line (in YAML, >- and |- end without a line break)"
        )
    return _prose(value)


def _prose(value: str) -> str:
    """Return a text; raise ValueError if the text has no visible character."""
    if not any(char.isprintable() and not char.isspace() for char in value):
        raise ValueError("is blank; expected text")
    return value


Line = Annotated[Text, AfterValidator(_line)]
Prose = Annotated[Text, AfterValidator(_prose)]


def _orcid(value: str) -> str | None:
    """Return the ORCID in a text or web address; None for another text, or if the check digit is wrong."""
    # The check digit follows ISO 7064 mod 11-2.
    plain = re.sub(r"^https?://orcid\.org/", "", value)
    if not re.fullmatch(r"([0-9]{4}-){3}[0-9]{3}[0-9X]", plain):
        return None
    digits = [10 if digit == "X" else int(digit) for digit in reversed(plain.replace("-", ""))]
    return plain if sum(digit * 2**power for power, digit in enumerate(digits)) % 11 == 1 else None


def _ror(value: str) -> str | None:
    """Return the web address of a ROR identifier; None if its check digits are wrong (ISO 7064 mod 97-10)."""
    found = re.fullmatch(r"(?:https?://ror\.org/)?(0([0-9a-hjkmnp-tv-z]{6})([0-9]{2}))", value.lower())
    right = found and int(found[3]) == 98 - int(found[2].translate(_FROM_CROCKFORD), 32) * 100 % 97
    return f"https://ror.org/{found[1]}" if right else None


def _doi(value: str) -> str | None:
    """Return the DOI in a text or in an address of doi.org; None for other texts."""
    plain = re.sub(r"(?i)^(https?://(dx\.)?doi\.org/|doi:)", "", value)
    return plain if re.fullmatch(rf"10\.[0-9]{{4,9}}/{_ADDRESS}", plain) else None


def _matching(pattern: str) -> Callable[[str], str | None]:
    """Return a function of a text. This function returns the text if it matches `pattern`, otherwise None."""
    return lambda value: value if re.fullmatch(pattern, value) else None


def _checked(read: Callable[[str], str | None], what: str, example: str):
    """Return the type of a checked text; `read` returns its plain form, or None or a ValueError if it is wrong."""

    def check(value: Any) -> str:
        # The YAML reader turns a date into a `datetime.date`, and a version such as 1.10 into the number 1.1.
        with contextlib.suppress(ValueError):
            if isinstance(value, str | datetime.date) and (plain := read(str(value))) is not None:
                return plain
        raise ValueError(f"is not valid; expected {what}, such as {example!r}")

    return Annotated[str, BeforeValidator(check), WithJsonSchema({"type": "string", "examples": [example]})]


_ROR, _DOI = "https://ror.org/03yrm5c26", "10.1007/s11249-017-0900-2"
_web = _matching(rf"{_ARXIV}|https?://[^\s/]+\.{_ADDRESS}")
Orcid = _checked(_orcid, "an ORCID with the right check digit", "0000-0002-1825-0097")
Ror = _checked(_ror, "a ROR identifier with the right check digits", _ROR)
Doi = _checked(_doi, "a DOI", _DOI)
Identifier = _checked(lambda value: _doi(value) or _web(value), "a DOI, arXiv:1234.56789 or a web address", _DOI)
FunderId = _checked(lambda value: _doi(value) or _ror(value), "a ROR identifier, or a DOI", "https://ror.org/00k4n6c32")
Date = _checked(lambda text: datetime.date.fromisoformat(text).isoformat(), "year, month and day", "2026-01-31")
Community = _checked(_matching(r"[a-z0-9_-]+"), "the end of the address of a Zenodo community", "contact-mechanics")
# The version is part of the name of a folder.
Version = _checked(
    _matching(r"[0-9A-Za-z]([0-9A-Za-z.+_-]{0,38}[0-9A-Za-z])?"),
    "letters and digits, with . + - _ between them (in quotes if the version looks like a number)",
    "1.0.0",
)


class Author(Section):
    """An author of the data: a person with `family_names` and `given_names`, or an organisation with `name`."""

    family_names: Line | None = None
    """Family names of the author, if the author is a person."""
    given_names: Line | None = None
    """Given names of the author, if the author is a person."""
    name: Line | None = None
    """Name of the author, if the author is an organisation or a team."""
    orcid: Orcid | None = None
    """ORCID of the person, such as `0000-0002-1825-0097`."""
    affiliation: Line | None = None
    """Institution of the person."""
    ror: Ror | None = None
    """ROR identifier of the institution, such as `https://ror.org/03yrm5c26`."""

    @model_validator(mode="after")
    def _who(self):
        person = self.family_names is not None or self.given_names is not None
        if person == (self.name is not None) or (person and None in (self.family_names, self.given_names)):
            raise ValueError(
                f"{self.model_dump(exclude_none=True)} is neither a person nor an organisation; expected "
                "family_names and given_names of a person, or name of an organisation"
            )
        if (self.orcid and not person) or (self.ror and person and not self.affiliation):
            raise ValueError(
                "expected orcid only for a person, and ror only for an organisation or a person with affiliation"
            )
        return self

    @property
    def is_person(self) -> bool:
        """True if the author is a person."""
        return self.name is None

    @property
    def orcid_address(self) -> str | None:
        """Web address of the ORCID; None without an ORCID."""
        return self.orcid and f"https://orcid.org/{self.orcid}"

    @property
    def full_name(self) -> str:
        """Name of the author with given names before family names."""
        return self.name or f"{self.given_names} {self.family_names}"

    @property
    def sorted_name(self) -> str:
        """Name of the author with family names before given names."""
        return self.name or f"{self.family_names}, {self.given_names}"


class Funding(Section):
    """A source of funding."""

    funder: Line
    """Name of the funder."""
    funder_id: FunderId | None = None
    """Identifier of the funder: a ROR identifier (`https://ror.org/…`), or a DOI from the funder registry."""
    award_number: Line | None = None
    """Number of the grant."""
    award_title: Line | None = None
    """Title of the grant."""
    award_url: Identifier | None = None
    """Web address or DOI of the grant."""


class RelatedIdentifier(Section):
    """Another work with a relation to the deposit, such as the paper about the data, or data that the campaign uses."""

    identifier: Identifier
    """DOI, `arXiv:…`, or web address of the other work."""
    relation: Literal[RELATIONS]
    """Relation of the deposit to the other work: a term of DataCite, such as `IsSupplementTo` or `Cites`."""
    resource: Literal[RESOURCES] | None = None
    """Type of the other work: a term of DataCite, such as `JournalArticle`."""


class KnownFailure(Section):
    """A run with a failed check that is published nevertheless, and an explanation."""

    run: Line
    """Name of the run as in `verdict.txt`, such as `study/surface/seed1/slope1/material`."""
    reason: Prose
    """Explanation for users of the data: why the check failed, and why you nevertheless publish the run."""


class Publication(Section):
    """Metadata of a deposit. Only the target `publish` needs this section."""

    version: Version | None = None
    """Version of the data, such as `1.0.0`. Required for publication."""
    date: Date | None = None
    """Day of publication, such as `2026-01-31`. Required for publication."""
    authors: Annotated[list[Author], AfterValidator(distinct)] = []
    """Authors of the data. At least one author is required for publication."""
    title: Line | None = None
    """Title of the deposit. Default: the title of the campaign."""
    summary: Prose | None = None
    """Abstract of the deposit. Default: the summary of the campaign."""
    license: Line | None = None
    """Licence of the data, as an SPDX identifier. Default: the licence of the campaign."""
    keywords: Annotated[list[Line], AfterValidator(distinct)] = []
    """Keywords of the deposit."""
    funding: Annotated[list[Funding], AfterValidator(distinct)] = []
    """Sources of funding for the work."""
    related_identifiers: Annotated[list[RelatedIdentifier], AfterValidator(distinct)] = []
    """Papers, data and programs with a relation to the deposit."""
    doi: Doi | None = None
    """DOI of this version of the data, if a DOI is reserved."""
    communities: Annotated[list[Community], AfterValidator(distinct)] = []
    """Communities of Zenodo to which the deposit is submitted."""
    known_failures: Annotated[list[KnownFailure], AfterValidator(distinct)] = []
    """Runs that are published although a check failed."""

    def problems(self, campaign: Any) -> Iterator[Problem]:
        """Yield a problem for each entry of `known_failures` whose run is not in the campaign."""
        if not self.known_failures:
            return
        runs = {run.path for label in campaign.studies for run in campaign.runs(label)}
        for index, failure in enumerate(self.known_failures):
            if failure.run not in runs:
                reason = f"is not a run; expected a run of the campaign, such as {min(runs)}"
                yield ("known_failures", index, "run"), failure.run, reason


def missing_metadata(publication: Publication) -> list[str]:
    """Return a message for each missing key that a deposit needs."""
    missing = [key for key in ("version", "date", "authors") if not getattr(publication, key)]
    return [f"publication.{key}: is missing; expected: {Publication.model_fields[key].description}" for key in missing]
