"""That results belong together: computed with the settings that are published, and one from the other."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.cases import campaign_sha256, run_sha256
from icha.planning.plan import read_attributes
from icha.planning.results import campaign_files
from icha.support.checksums import made_as, stale


def refuse_mixed(results: Path, campaign: Campaign, recorded: Mapping[str, str]) -> None:
    """Refuse results of which one was not computed with the campaign's settings, or not from the others.

    Parameters
    ----------
    results : the campaign's folder of results.
    campaign : what is published.
    recorded : results, from that folder, with what the workflow has recorded that it asked of their jobs
        (`icha.support.checksums.asked_of`).

    Raises
    ------
    ValueError
        Naming each of them and the reason.
    """
    files = campaign_files(campaign)
    other = "it was not computed with the settings of this campaign"
    wrong = dict(stale(results, recorded))
    wrong |= {path: other for path, case in files.runs.items() if _differs(results / path, run_sha256(campaign, case))}
    wrong |= {path: other for path in [files.dataset] if _differs(results / path, campaign_sha256(campaign))}
    for path, asked in recorded.items():
        if asked != made_as(results, path):
            wrong.setdefault(path, "the workflow has recorded another job for it")
    if wrong:
        raise ValueError(
            "not published, for these results do not belong together; needed: remove them, and give the same command "
            "again:\n" + "\n".join(_lines(results, wrong))
        )


def _differs(file: Path, sha256: str) -> bool:
    return (read_attributes(file) or {}).get("config_sha256") != sha256


def _lines(results: Path, wrong: Mapping[str, str]) -> Iterable[str]:
    return (f"  {results / path}: {why}" for path, why in sorted(wrong.items()))
