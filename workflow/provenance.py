"""Find the job that made each result, from Snakemake's own records."""

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
    """Return the jobs that made the results of a deposit, sorted by their outputs.

    Parameters
    ----------
    records : Snakemake's records, `.snakemake/metadata`.
    made : for the name of each result in Snakemake (`results/<campaign>/…`), the path of this result in the deposit.
    given : for each file that no job made (configuration as used, topographies, measurements), its path in the deposit.
    scripts : folder of the scripts, whose docstrings describe the jobs.

    Raises
    ------
    ValueError
        If the record of a result is missing, or a result was made from a file that is not in the deposit.
    """
    places = {**made, **given}
    outputs: dict[str, list[str]] = {}
    record_of_job: dict[str, dict[str, Any]] = {}
    for name in sorted(made):
        record = _record(records, name)
        # The outputs of one job have the same log, and outputs of two jobs have different logs.
        log = record["log"][0]
        record_of_job[log] = record
        outputs.setdefault(log, []).append(name)
    jobs = []
    for log, record in record_of_job.items():
        missing = [name for name in record["input"] if name not in places]
        if missing:
            raise ValueError(
                f"{missing[0]}: {outputs[log][0]} was made from this file, but the deposit will not contain the file; "
                "expected every input of a result in the deposit"
            )
        script = PurePosixPath(record["code"].strip().strip("\"'")).name
        jobs.append(
            Job(
                rule=record["rule"],
                inputs=tuple(sorted({places[name] for name in record["input"]})),
                outputs=tuple(sorted(made[name] for name in outputs[log])),
                parameters=_settings(record["params"]),
                description=_description(scripts / script),
                script=f"{SOURCE}/{SCRIPTS}/{script}",
            )
        )
    return sorted(jobs, key=lambda job: job.outputs)


def recorded_parameters(records: Path, name: str) -> list[str]:
    """Return the `repr` of each parameter of the job that made a file; raise the same errors as `recorded_jobs`."""
    return _record(records, name)["params"]


def _record(records: Path, name: str) -> dict[str, Any]:
    """Read Snakemake's record of a file."""
    problem = "is missing"
    try:
        record = json.loads(record_of(name, records).read_text(encoding="utf-8"))
        if all(record.get(key) for key in ("rule", "log", "code")) and not record.get("incomplete"):
            return record
        problem = "is incomplete"
    except FileNotFoundError:
        pass
    except json.JSONDecodeError:
        problem = "cannot be read"
    raise ValueError(
        f"{name}: its record in {records} {problem}, so its origin cannot be published. Run "
        "`icha run CONFIGURATION -- --touch --forceall` once, which records all results and computes nothing"
    )


def _settings(params: list[str]) -> tuple[tuple[str, str], ...]:
    """Return names and values of the settings of a job, from its recorded parameters.

    Snakemake records parameters without their names. Therefore the function returns only parameters that are mappings,
    because the keys of a mapping are names. It omits the attributes of datasets, and paths of this machine.
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


def _flat(section: dict, prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in section.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        elif value is not None:
            yield f"{prefix}{key}", value if isinstance(value, str) else repr(value)


@cache
def _description(script: Path) -> str:
    """Return the first paragraph of the docstring of a script."""
    text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())
