"""Write README.md of a deposit, the page for readers of the deposit."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

import jinja2
import xarray as xr

from icha.analysis.checks import COMPLETED
from icha.checks.findings import Check
from icha.configuration.campaign import Campaign
from icha.configuration.publication import Publication
from icha.contact.models import MODEL_PAPER
from icha.datasets.campaign import run_place, runs_of_status
from icha.datasets.labels import LABELS, slopes_of
from icha.datasets.variables.campaign import BEYOND_MODEL, FAILED_RUNS, LOADED_RUNS, NOT_IN_DESIGN, STATUS_MEANINGS
from icha.deposit.metadata import TABLES, acknowledgement, licence_address, paragraphs, web_address
from icha.deposit.verify import COMPUTED
from icha.planning.costs import Cost
from icha.support import formatting

# A web address in a text, without the punctuation that follows the address.
_ADDRESS = re.compile(r"(https?://[^\s<>|`\\]*[^\s<>|`\\.,;:!?()\[\]*_~'\"])")
# Characters with a meaning in Markdown: anywhere in a line, and at the beginning of a line.
_SPECIAL = re.compile(r"[\\`*\[\]<>|~$#]|(?<![^\W_])_|_(?![^\W_])|&(?=[#\w])")
_SPECIAL_FIRST = re.compile(r"^(\d*)((?<!\d)[-+]|(?<=\d)[.)])(?!\w)")


def readme(
    campaign: Campaign,
    *,
    revision: str,
    dataset: xr.DataTree,
    checks: Sequence[Check],
    sizes: Mapping[str, int],
    cost: Cost,
) -> str:
    """Return the text of README.md of a deposit; `sizes` has the size of every file in bytes, by path."""
    publication = campaign.deposit_metadata()
    tops = {path.split("/")[0] for path in sizes}
    tables = [path for path in sizes if path.startswith("figures/") and path.endswith(".csv")]
    authors = "; ".join(author.sorted_name for author in publication.authors)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {
        "text": markdown,
        "acknowledgement": acknowledgement,
        "link": _link,
        "number": "{:.4g}".format,
        "value": "{:z.2g}".format,
        "size": formatting.size,
        "duration": formatting.duration,
        "few": lambda values: formatting.list_first(map(markdown, values)),
    }
    text = environment.get_template("README.md.jinja").render(
        campaign=campaign,
        publication=publication,
        citation=f"{authors} ({publication.date[:4]}): {publication.title}. Version {publication.version}. Data set.",
        paper=MODEL_PAPER,
        summary=paragraphs(publication.summary),
        licence_address=licence_address(publication.license),
        revision=revision,
        cost=cost,
        addresses={each.identifier: web_address(each.identifier) for each in publication.related_identifiers},
        contents={path: TABLES["contents"][path] for path in TABLES["contents"] if path in tops},
        files=len(sizes),
        size=sum(sizes.values()),
        computed=sum(size for path, size in sizes.items() if path.split("/")[0] in COMPUTED),
        compared="aggregated/model_error.nc" in sizes,
        figure_data=min(tables, key=lambda path: ("fig2_" not in path, path), default=""),
        **_outcome(publication, dataset, checks),
    )
    return text.rstrip() + "\n"


def _outcome(publication: Publication, dataset: xr.DataTree, checks: Sequence[Check]) -> dict:
    """Return the results that the page shows: runs of every study by status, incomplete runs, and checks."""
    known = {failure.run: failure.reason for failure in publication.known_failures}
    designs, incomplete, complete = [], [], []
    for name, node in dataset.children.items():
        study = node.to_dataset()
        counts = Counter(study["status"].values.ravel().tolist())
        axes = {each: slopes_of(study) if each == "rms_slope" else study[each].values.tolist() for each in LABELS}
        status = {text: counts[k] for k, text in enumerate(STATUS_MEANINGS)}
        designs.append({"name": name, "status": status, "runs": counts.total() - counts[NOT_IN_DESIGN], **axes})
        complete += runs_of_status(study, name, LOADED_RUNS)
        for labels in runs_of_status(study, name, FAILED_RUNS):
            run = study[["step_count", "failure"]].isel(run_place(study, labels))
            facts = {"steps": int(run["step_count"]), "failure": run["failure"].item()}
            incomplete.append({"labels": labels, "reason": known.get(str(labels), ""), **facts})
    example = complete[0] if complete else incomplete[0]["labels"]
    study = dataset[example.study].to_dataset()
    return {
        "designs": designs,
        "partial": [study["name"] for study in designs if study["status"][STATUS_MEANINGS[NOT_IN_DESIGN]]],
        "incomplete": incomplete,
        "beyond_model": sum(study["status"][STATUS_MEANINGS[BEYOND_MODEL]] for study in designs),
        "example": example,
        "slope_place": run_place(study, example)["rms_slope"],
        "failed": [check for check in checks if not check.passed and check.name != COMPLETED],
        "known": known,
        "passed": sum(check.passed for check in checks),
        "total": len(checks),
    }


def markdown(text) -> str:
    """Return plain text as one line of Markdown, also for cells of tables; web addresses become links."""
    line = " ".join(str(text).split())
    # Every second part of the split text is a web address.
    parts = [
        _link(part) if number % 2 else _SPECIAL.sub(r"\\\g<0>", part)
        for number, part in enumerate(_ADDRESS.split(line))
    ]
    return _SPECIAL_FIRST.sub(r"\1\\\2", "".join(parts))


def _link(address: str) -> str:
    """Return a web address as a link in Markdown."""
    plain = re.sub(r"[\s<>|`\\]", lambda found: quote(found[0]), address)
    return f"<{plain}>"
