"""Which job made which result, from Snakemake's own records of the jobs that it ran."""

import ast
import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

from snakemake_records import record_of

from icha.deposit.crate import Job
from icha.deposit.verify import SOURCE

SCRIPTS = "workflow/scripts"


def recorded_jobs(
    records: Path, made: Mapping[str, str], given: Mapping[str, str], *, scripts: Path = Path(SCRIPTS)
) -> list[Job]:
    """The jobs that made the results of a deposit, ordered by what they made.

    Parameters
    ----------
    records : Snakemake's records, `.snakemake/metadata`.
    made : where each result lies in the deposit, by its name as Snakemake knows it (`results/<campaign>/…`).
    given : the same for files that no job made: the configuration as used, topographies, measurements.
    scripts : the folder of the jobs' scripts, from which their description is taken.

    Raises
    ------
    ValueError
        If there is no record of a result, or if a result was made from a file that is not in the deposit.
    """
    places = {**made, **given}
    outputs: dict[str, list[str]] = {}
    of_job: dict[str, dict[str, Any]] = {}
    for name in sorted(made):
        record = _record(records, name)
        # All outputs of a job have a log in common, and no two jobs have.
        job = record["log"][0]
        of_job[job] = record
        outputs.setdefault(job, []).append(name)
    jobs = []
    for job, record in of_job.items():
        missing = [name for name in record["input"] if name not in places]
        if missing:
            raise ValueError(
                f"{missing[0]}: {outputs[job][0]} was made from it, but it is not to be in the deposit; every input "
                "of a result has to be"
            )
        script = PurePosixPath(record["code"].strip().strip("\"'")).name
        jobs.append(
            Job(
                rule=record["rule"],
                inputs=tuple(sorted({places[name] for name in record["input"]})),
                outputs=tuple(sorted(made[name] for name in outputs[job])),
                parameters=_settings(record["params"]),
                description=_description(scripts / script),
                script=f"{SOURCE}/{SCRIPTS}/{script}",
            )
        )
    return sorted(jobs, key=lambda job: job.outputs)


def recorded_parameters(records: Path, name: str) -> list[str]:
    """The parameters of the job that made the file `name`, as Python represents them; errors as `recorded_jobs`."""
    return _record(records, name)["params"]


def _record(records: Path, name: str) -> dict[str, Any]:
    """What Snakemake recorded when it made the file `name`."""
    what = "there is no record"
    try:
        record = json.loads(record_of(name, records).read_text(encoding="utf-8"))
        if all(record.get(key) for key in ("rule", "log", "code")) and not record.get("incomplete"):
            return record
        what = "there is no complete record"
    except FileNotFoundError:
        pass
    except json.JSONDecodeError:
        what = "the record cannot be read"
    raise ValueError(
        f"{name}: {what} of how it was made in {records}, so its origin cannot be published; needed: "
        "`icha run CONFIGURATION -- --touch --forceall` once, which records it of all results and computes nothing"
    )


def _settings(params: list[str]) -> tuple[tuple[str, str], ...]:
    """Names and values of a job's settings, of which Snakemake records the representations of the values alone.

    Sections have names within themselves; a value outside of one has none and is left out. So are the attributes of
    datasets, which say to which campaign a result belongs, and paths of this machine.
    """
    settings: dict[str, str] = {}
    for text in params:
        try:
            value = ast.literal_eval(text)
        except (ValueError, SyntaxError):
            continue
        if isinstance(value, dict) and "campaign" not in value:
            settings.update((name, text) for name, text in _flat(value) if not text.startswith("/"))
    return tuple(sorted(settings.items()))


def _flat(section: dict, above: str = "") -> Iterator[tuple[str, str]]:
    for key, value in section.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{above}{key}.")
        elif value is not None:
            yield f"{above}{key}", value if isinstance(value, str) else repr(value)


@cache
def _description(script: Path) -> str:
    """The first paragraph of a script's docstring."""
    text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())
