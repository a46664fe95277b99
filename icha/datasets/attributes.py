"""Global attributes that describe every file, and the reasons why a run is not a result.

The attributes are those of the CF conventions (section 2.6.2), and those of the Attribute Convention for Data Discovery
(ACDD 1.3) that apply. Attributes of places and times do not apply; authors and date belong to a publication as a whole.
Therefore the files do not claim to follow ACDD.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from importlib.metadata import version

CONVENTIONS = "CF-1.11"
KEYWORDS = ("contact mechanics", "rough surfaces", "tribology")

# Processing levels: free text in ACDD, here one for every step from a topography to statistics.
INPUT, COMPUTED, COLLECTED, DERIVED, THEORY = (
    "topography, input of the computations",
    "result of one computation",
    "results of all computations, as computed",
    "derived from the results of all computations",
    "theory, and published values",
)


def why_no_result(attrs: Mapping) -> str:
    """Explain from a run's attributes why it is not a result (it ended early, or checks failed); "" if it is one."""
    return str(attrs.get("incomplete") or attrs.get("failed_checks", ""))


def reasons_not_applicable(study: Mapping) -> Counter[str]:
    """Count the runs of a study to which their model is not applicable, by reason."""
    return Counter(filter(None, study["applicability"].values.ravel().astype(str).tolist()))


def file_attributes(
    title: str,
    summary: str,
    level: str,
    *,
    programs: Iterable[str] = ("icha",),
    sources: Iterable[str] = (),
    references: str = "",
    keywords: Iterable[str] = (),
) -> dict[str, str]:
    """Return the global attributes of a file.

    Parameters
    ----------
    title, summary : its content, in a line and in sentences.
    level : one of the processing levels of this module.
    programs : names of the Python packages that computed the content; their versions are added.
    sources : programs with their versions, if other programs than the installed ones computed the content.
    references : publications of the methods.
    keywords : besides those of all files.
    """
    source = "; ".join([*sources] or [f"{name} {version(name)}" for name in programs])
    found = {
        "title": title,
        "summary": summary,
        "keywords": ", ".join([*KEYWORDS, *keywords]),
        "Conventions": CONVENTIONS,
        "source": source,
        # CF asks for an audit trail. Its first entry has no time: the same input gives the same bytes.
        "history": f"{level}: {source}",
        "processing_level": level,
        "references": references,
    }
    return {name: text for name, text in found.items() if text}


def combine_attributes(title: str, summary: str, level: str, origins: Iterable[Mapping[str, str]]) -> dict[str, str]:
    """Return the global attributes of a file made from datasets with the global attributes `origins`, in any order.

    Programs, publications and further keywords are those of the datasets, each once.
    """
    origins = list(origins)
    sources, references, keywords = (
        sorted({part.strip() for each in origins for part in each.get(name, "").split(mark) if part.strip()})
        for name, mark in (("source", ";"), ("references", ";"), ("keywords", ","))
    )
    further = [word for word in keywords if word not in KEYWORDS]
    return file_attributes(title, summary, level, sources=sources, references="; ".join(references), keywords=further)
