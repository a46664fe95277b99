"""Global attributes of every file, so that it can be found and understood by itself, and what they say of runs.

They are those of the CF conventions, section 2.6.2, and of the Attribute Convention for Data Discovery (ACDD 1.3) as
far as they apply. Those of place and time do not; who made a file and when is said of a publication as a whole. So ACDD
is not among the conventions that a file claims to follow.
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
    """Return why a run is no result, by its attributes: it ended early, or its checks failed; "" if it is one."""
    return str(attrs.get("incomplete") or attrs.get("failed_checks", ""))


def reasons_not_applicable(study: Mapping) -> Counter[str]:
    """Count the runs of a study to which their model is not applicable, by the reason; none in earlier versions."""
    if "applicability" not in study:
        return Counter()
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
    """Global attributes of a file.

    Parameters
    ----------
    title, summary : what it holds, in a line and in sentences.
    level : how far its content is from what was computed, one of the levels here.
    programs : names of the Python packages that computed it; their versions are added.
    sources : programs with their versions, where others than those installed did it.
    references : publications of the methods; none if empty.
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
    """Global attributes of a file made from datasets with the global attributes `origins`, in any order.

    Programs, publications and further keywords are theirs, each once.
    """
    origins = list(origins)
    sources, references, keywords = (
        sorted({part.strip() for each in origins for part in each.get(name, "").split(mark) if part.strip()})
        for name, mark in (("source", ";"), ("references", ";"), ("keywords", ","))
    )
    further = [word for word in keywords if word not in KEYWORDS]
    return file_attributes(title, summary, level, sources=sources, references="; ".join(references), keywords=further)
