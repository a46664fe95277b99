"""Make a deposit, as a folder and as a zip: results, and all that others need to understand and reproduce the results.

The same results and the same revision of the program always give exactly the same files. A deposit contains no times
and no names of people, machines or folders, except those in the results, the configuration and the source.
"""

import json
import os
import shutil
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import xarray as xr

from icha.analysis.checks import read_checks, refuse_unknown_failures
from icha.configuration.campaign import Campaign
from icha.configuration.cases import campaign_sha256, run_sha256
from icha.datasets.files import read_campaign
from icha.deposit.crate import Job, write_crate
from icha.deposit.dictionary import data_dictionary
from icha.deposit.metadata import citation_cff, datacite_metadata, find_licence, zenodo_metadata
from icha.deposit.program import Source
from icha.deposit.readme import readme
from icha.deposit.verify import CHECKSUMS, CRATE, README, SOURCE, ZENODO, files_of, problem_with_name
from icha.planning.costs import Cost
from icha.planning.plan import DONE, FAILED, run_state
from icha.planning.results import campaign_files
from icha.support.atomic_files import moving, sync_folder, whole_file
from icha.support.checksums import is_whole, recorded_hash, sha256_of, stale

_BLOCK = 2**20
# All files in the zip have the earliest time that the format allows, so that the same files give the same zip.
_NO_TIME = (1980, 1, 1, 0, 0, 0)
# With this number in an entry of a zip, file permissions have the meaning of Unix.
_UNIX = 3


def make_deposit(
    folder: str | os.PathLike,
    archive: str | os.PathLike,
    *,
    results: str | os.PathLike,
    files: Iterable[str],
    campaign: Campaign,
    source: Source,
    jobs: Sequence[Job],
    cost: Cost,
) -> None:
    """Write a deposit to `folder` and a zip of the deposit to `archive`; an earlier deposit is replaced at the end.

    Parameters
    ----------
    folder, archive : paths of the deposit and of the zip. The folder in the zip has the name of `folder`.
    results : folder of results of the campaign.
    files : paths of the published files in `results`: at least config.used.yaml, checks.json and the campaign dataset.
    campaign : configuration with complete metadata (`icha.configuration.publication.missing_metadata`).
    source : source of the program.
    jobs : jobs that made the results.
    cost : expected time and memory for computing the campaign.

    Raises
    ------
    ValueError
        If a file has changed since a job wrote it, if some systems refuse the name of a file, or if the failed checks
        are not exactly the known failures.
    """
    folder, archive, results = Path(folder), Path(archive), Path(results)
    files, publication = sorted(files), campaign.deposit_metadata()
    refuse_unknown_failures(read_checks(results / "checks.json"), [each.run for each in publication.known_failures])
    _refuse_changed(results, files)
    staging = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(staging, ignore_errors=True)
    try:
        for file in files:
            (staging / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(results / file, staging / file)
            (staging / file).chmod(0o644)
        source.export(staging / SOURCE)
        if wrong := [f"  {file!r} {why}" for file in files_of(staging) if (why := problem_with_name(file))]:
            listed = "\n".join(wrong)
            raise ValueError(f"not published, because some systems refuse these file names. Rename them:\n{listed}")
        _describe(staging, files, campaign, source.revision, cost)
        checksums = {path: sha256_of(staging / path) for path in files_of(staging)}
        write_crate(staging, publication, jobs, campaign=campaign.name, revision=source.revision, checksums=checksums)
        checksums[CRATE] = sha256_of(staging / CRATE)
        _write(staging / CHECKSUMS, "".join(f"{checksums[path]}  {path}\n" for path in sorted(checksums)))
        with whole_file(archive) as temporary:
            _write_zip(temporary, staging, folder.name)
            sync_folder(staging)
            with moving():
                archive.unlink(missing_ok=True)
                shutil.rmtree(folder, ignore_errors=True)
                staging.rename(folder)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def refuse_mixed(results: Path, campaign: Campaign, recorded: Mapping[str, str]) -> None:
    """Raise ValueError if settings or input files have changed since the results were computed.

    Parameters
    ----------
    results : folder of results of the campaign.
    campaign : configuration of the campaign.
    recorded : for each path in `results`, the checksum of the job's parameters
        (`icha.support.checksums.hash_parameters`). The workflow has recorded these checksums.

    Raises
    ------
    ValueError
        If a result has other settings or inputs. The message lists these results with the reasons.
    """
    files = campaign_files(campaign)
    expected = {path: run_sha256(campaign, case) for path, case in files.runs.items()}
    expected[files.dataset] = campaign_sha256(campaign)
    wrong = dict(stale(results, recorded))
    for path, sha256 in expected.items():
        if run_state(results / path, sha256)[0] not in (DONE, FAILED):
            wrong[path] = "was not computed with the settings of the campaign"
    for path, asked in recorded.items():
        if asked != recorded_hash(results, path):
            wrong.setdefault(path, "was made by another job than the workflow has recorded")
    if wrong:
        raise ValueError(
            "not published, because these results do not belong together. Remove these files and repeat the command:\n"
            + "\n".join(f"  {results / path}: {why}" for path, why in sorted(wrong.items()))
        )


def _refuse_changed(results, files):
    """Raise `ValueError` for files that have changed since their jobs wrote them."""
    if changed := [f"  {results / file}" for file in files if not is_whole(results, file, thorough=True)]:
        listed = "\n".join(changed)
        raise ValueError(
            "not published, because these files have changed since their jobs wrote them. Remove these files, and run "
            f"the campaign again:\n{listed}"
        )


def _describe(staging: Path, files: Sequence[str], campaign: Campaign, revision: str, cost: Cost) -> None:
    """Write licence, CITATION.cff, metadata, data dictionary and README.md of the deposit."""
    publication = campaign.deposit_metadata()
    _write(staging / "LICENSE.txt", find_licence(publication.license).page())
    _write(staging / "CITATION.cff", citation_cff(publication, revision))
    for name, metadata in ((ZENODO, zenodo_metadata(publication)), ("datacite.json", datacite_metadata(publication))):
        _write(staging / name, json.dumps(metadata, indent=1, ensure_ascii=False) + "\n")
    _write(staging / "data_dictionary.csv", data_dictionary(staging, files))
    error = staging / "aggregated/model_error.nc"
    # The dataset may be large and the page shows little of it, so it is not loaded into memory.
    with xr.open_datatree(staging / f"dataset/{campaign.name}.nc", engine="netcdf4") as dataset:
        page = readme(
            campaign,
            revision=revision,
            dataset=dataset,
            checks=read_checks(staging / "checks.json"),
            model_error=read_campaign(error) if error.is_file() else None,
            sizes={path: (staging / path).stat().st_size for path in files_of(staging)},
            cost=cost,
        )
    _write(staging / README, page)


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
    path.chmod(0o644)


def _write_zip(path: Path, folder: Path, name: str) -> None:
    """Write a folder to a zip as folder `name`, uncompressed, because compressed bytes depend on the zlib version."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for file in files_of(folder):
            status = (folder / file).stat()
            entry = zipfile.ZipInfo(f"{name}/{file}", date_time=_NO_TIME)
            entry.create_system = _UNIX
            entry.external_attr = (0o100000 | (0o755 if status.st_mode & 0o100 else 0o644)) << 16
            entry.file_size = status.st_size
            with (folder / file).open("rb") as content, archive.open(entry, "w") as stored:
                shutil.copyfileobj(content, stored, _BLOCK)
