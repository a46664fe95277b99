"""Global attributes that describe every file, and the reasons why a run does not count as a result.

The attributes follow the CF conventions (section 2.6.2) and partly the Attribute Convention for Data Discovery (ACDD
1.3). The files do not claim to follow ACDD, because the ACDD attributes for places and times on earth do not apply.
Authors and date describe a publication as a whole, and not a single file.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from importlib.metadata import version

CONVENTIONS = "CF-1.11"
KEYWORDS = ("contact mechanics", "rough surfaces", "tribology")

# Values of the ACDD attribute `processing_level`: one text for every step from a topography to statistics.
INPUT, COMPUTED, COLLECTED, DERIVED, THEORY = (
    "topography, input of the computations",
    "result of one computation",
    "results of all computations, as computed",
    "derived from the results of all computations",
    "theory, and published values",
)


def why_no_result(attrs: Mapping) -> str:
    """Return the reason why a run is not a result (ended early, or failed checks); "" for a run that is a result."""
    return str(attrs.get("incomplete") or attrs.get("failed_checks", ""))


def why_failed(attrs: Mapping) -> str:
    """Return the reason why a run failed, including failed checks of the loss, which leave the other results valid."""
    return why_no_result(attrs) or str(attrs.get("failed_loss_checks", ""))


def reasons_not_applicable(study: Mapping) -> Counter[str]:
    """Return the number of runs of a study for each reason why the asperity model is not applicable."""
    return Counter(filter(None, study["applicability"].values.ravel().astype(str).tolist()))


def file_attributes(
    title: str,
    summary: str,
    level: str,
    *,
    sources: Iterable[str] = (),
    references: str = "",
    keywords: Iterable[str] = (),
) -> dict[str, str]:
    """Return the global attributes of a file.

    Parameters
    ----------
    title, summary : content of the file, in one line and in full sentences.
    level : one of the processing levels of this module.
    sources : names and versions of the programs that computed the content. Default: the installed ICHA.
    references : publications of the methods.
    keywords : further keywords, in addition to those of all files.
    """
    source = "; ".join(sources) or f"icha {version('icha')}"
    found = {
        "title": title,
        "summary": summary,
        "keywords": ", ".join([*KEYWORDS, *keywords]),
        "Conventions": CONVENTIONS,
        "source": source,
        # CF requires a history of the file. The entry has no time, so that the same input gives the same bytes.
        "history": f"{level}: {source}",
        "processing_level": level,
        "references": references,
    }
    return {name: text for name, text in found.items() if text}


def combine_attributes(title: str, summary: str, level: str, origins: Iterable[Mapping[str, str]]) -> dict[str, str]:
    """Return the global attributes of a file that was made from datasets with the global attributes `origins`.

    The order of `origins` has no effect. Programs, publications and keywords of the datasets are listed once.
    """
    origins = list(origins)
    sources, references, keywords = (
        sorted({part.strip() for each in origins for part in each.get(name, "").split(mark) if part.strip()})
        for name, mark in (("source", ";"), ("references", ";"), ("keywords", ","))
    )
    further = [word for word in keywords if word not in KEYWORDS]
    return file_attributes(title, summary, level, sources=sources, references="; ".join(references), keywords=further)
