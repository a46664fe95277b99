"""What is done before Snakemake looks at the results that are there, and before it starts its jobs."""

import functools
import json
import os
from base64 import urlsafe_b64decode
from pathlib import Path

from snakemake.logging import logger

from icha.support import checksums
from icha.support.atomic_files import why_not_writable


def before_execution(workflow, results: str, prepare) -> None:
    """Have `prepare(dry_run)` called before the jobs of this call of Snakemake are planned.

    Snakemake has a hook for what is done before its jobs start, but none before it has decided on them. Calls that only
    report or clean up do not come here, nor do those that Snakemake makes of itself.

    What `prepare` returns are files that are made in any case. Where nothing can be written, the call ends well only if
    there is nothing to do.
    """
    execute = workflow.execute

    @functools.wraps(execute)
    def prepared(executor_plugin, *args, **kwargs):
        settings = executor_plugin.common_settings
        if not workflow.is_main_process or settings.touch_exec:
            return execute(executor_plugin, *args, **kwargs)
        forced = prepare(settings.dryrun_exec)
        workflow.dag_settings.forcerun = frozenset([*workflow.dag_settings.forcerun, *forced])
        try:
            return execute(executor_plugin, *args, **kwargs)
        except Exception:
            if not settings.dryrun_exec:
                refuse_unwritable(results)
            raise

    workflow.execute = prepared


def set_damaged_aside(results: str, dry_run: bool) -> list[str]:
    """Rename the results of a campaign that are not what was written, and say so; list the files to be made again.

    These are the damaged ones and those that are lost. Snakemake by itself makes lost files again only if they are
    asked for, and takes what was made of them for up to date. A result of which Snakemake's record cannot be read is
    not known to be up to date, and counts as one whose job was killed.
    """
    damaged = checksums.damaged(results)
    for path in damaged:
        file = f"{results}/{path}"
        if dry_run:
            _tell(f"damaged, to be made again: {file}")
            continue
        try:
            aside = checksums.set_aside(results, path)
        except OSError as error:
            raise SystemExit(
                f"{file} is not what was written, by its checksum, and cannot be set aside: {error.strerror}. "
                f"Make {os.path.dirname(file)} writable, or copy the results elsewhere."
            ) from None
        _tell(f"damaged, to be made again: {file} (what was there is {aside.name} now)")
    for record, file in _unreadable_records(results):
        _tell(f"to be made again, for Snakemake's record of it is damaged: {file}")
        if not dry_run:
            unfinished = Path(".snakemake/incomplete", record.relative_to(".snakemake/metadata"))
            unfinished.parent.mkdir(parents=True, exist_ok=True)
            unfinished.write_text(json.dumps({"external_jobid": None}), encoding="ascii")
            record.unlink()
    return [f"{results}/{path}" for path in {*damaged, *checksums.lost(results)}]


def jobs_end_with_this_process() -> None:
    """Tell jobs which process wants them: they end with it, however that does (see scripts/job.py)."""
    os.environ["ICHA_SNAKEMAKE"] = str(os.getpid())


def refuse_unwritable(results: str) -> None:
    """End the program with a message if jobs could not write their results."""
    for folder in (results, ".snakemake"):
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
            reason = why_not_writable(Path(folder))
        except OSError as error:
            reason = error
        if reason is not None:
            raise SystemExit(_unwritable(folder, reason.strerror))
    for folder, _, _ in os.walk(results):
        if not os.access(folder, os.W_OK | os.X_OK):
            raise SystemExit(_unwritable(folder, "Permission denied"))


def _unwritable(folder, reason):
    return (
        f"{folder} cannot be written to: {reason}. Nothing was computed. Make room there or make it writable, or work "
        f"in another folder: `icha run --directory FOLDER`, `snakemake --directory FOLDER`."
    )


def _tell(text):
    logger.warning(text, extra={"remark": text})


def _unreadable_records(results):
    """Snakemake's records of results of a campaign that are no records, with the files that they are of."""
    for folder, _, names in os.walk(".snakemake/metadata"):
        for name in names:
            record = Path(folder, name)
            try:
                # Long names go on in folders, each part with @ before it; see `snakemake.persistence.file`.
                parts = record.relative_to(".snakemake/metadata").parts
                file = urlsafe_b64decode("".join(part.removeprefix("@") for part in parts)).decode()
            except ValueError:
                continue  # not of ours
            if file.startswith(f"{results}/") and not _is_record(record):
                yield record, file


def _is_record(file: Path) -> bool:
    from snakemake.persistence import MetadataRecord

    try:
        MetadataRecord.model_validate(json.loads(file.read_bytes()))
    except ValueError:
        return False
    return True
