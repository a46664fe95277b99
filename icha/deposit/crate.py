"""Describe a deposit as a Provenance Run RO-Crate: the type of every file, and the job and inputs that made the file.

The crate follows RO-Crate 1.1 (https://w3id.org/ro/crate/1.1) and Provenance Run Crate 0.5
(https://w3id.org/ro/wfrun/provenance/0.5).

The crate contains neither times of jobs nor names of people who ran jobs, so the same data always have the same crate.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from graphlib import TopologicalSorter
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from rocrate.model import ContextEntity, Dataset, Entity, File
from rocrate.rocrate import ROCrate

from icha.configuration.publication import Author, Publication
from icha.contact.models import MODEL_PAPER
from icha.datasets.results import CONFIGURATION
from icha.deposit.metadata import TABLES, find_licence, web_address
from icha.deposit.verify import CRATE, README, SOURCE

_PROGRAM = f"{SOURCE}/"
_WORKFLOW = f"{_PROGRAM}Snakefile"
_LICENCE = f"{_PROGRAM}LICENSE"
# Files of the program's source that the crate lists in addition to the scripts of the jobs.
_SHOWN = {_WORKFLOW, f"{_PROGRAM}uv.lock", _LICENCE}

_WORKFLOW_PROFILE = "https://w3id.org/workflowhub/workflow-ro-crate/1.0"
# Term for a checksum in Workflow Run RO-Crates (https://w3id.org/ro/terms/workflow-run/context).
_TERMS = {"sha256": "https://w3id.org/ro/terms/workflow-run#sha256"}


class Job(NamedTuple):
    """One job of the workflow.

    Attributes
    ----------
    rule : name of the rule in the workflow.
    inputs, outputs : files that the job read and wrote, as paths in the deposit; a job writes at least one file.
    parameters : names and values of the settings of the job.
    description : sentence on what the script does.
    script : script that the job ran, as a path in the deposit.
    """

    rule: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[tuple[str, str], ...]
    description: str
    script: str


def write_crate(
    folder: Path,
    publication: Publication,
    jobs: Iterable[Job],
    *,
    campaign: str,
    revision: str,
    checksums: Mapping[str, str],
) -> None:
    """Write the file `ro-crate-metadata.json` of a deposit.

    Parameters
    ----------
    folder : folder of the deposit, which contains all files in `checksums`.
    publication : complete metadata of the deposit.
    jobs : jobs that made the results, in any order; the deposit contains all files that the jobs read and wrote.
    campaign : name of the campaign.
    revision : revision of the program whose source is in `source/`.
    checksums : hexadecimal sha256 of every file, by path in the deposit.
    """
    jobs = sorted(jobs, key=lambda job: job.outputs)
    crate = ROCrate()
    crate.metadata.extra_terms.update(_TERMS)
    crate.metadata["conformsTo"] = [{"@id": crate.metadata.PROFILE}, {"@id": _WORKFLOW_PROFILE}]
    for key, properties in TABLES["entities"].items():
        crate.add(ContextEntity(crate, key, properties))
    _describe(crate, publication, campaign)
    shown = {path for path in checksums if not path.startswith(_PROGRAM)}
    shown |= {*_SHOWN, *(job.script for job in jobs)}
    files = {}
    for path in sorted(shown):
        file = folder / path
        kind = TABLES["formats"].get(file.suffix, "application/octet-stream")
        facts = {"contentSize": str(file.stat().st_size), "sha256": checksums[path], "encodingFormat": kind}
        files[path] = crate.add(File(crate, dest_path=path, properties={"name": path, **facts}))
    parts = [file for path, file in files.items() if path.startswith(_PROGRAM)]
    facts = {"version": revision, "identifier": revision, "hasPart": parts}
    _set(crate.add(Dataset(crate, dest_path=_PROGRAM)), name="Source of the workflow and of the program", **facts)
    number = version("snakemake")
    _set(crate.dereference("#snakemake"), name=f"Snakemake {number}", version=number)
    _describe_workflow(crate, files, revision, jobs)
    _add_jobs(crate, jobs, files, f"Campaign {campaign}", publication.title)
    _set(crate.root_dataset, mainEntity=files[_WORKFLOW])
    _set(files[README], about=crate.root_dataset)
    content = json.dumps(crate.metadata.generate(), indent=1, ensure_ascii=False)
    (folder / CRATE).write_text(f"{content}\n", encoding="utf-8")
    (folder / CRATE).chmod(0o644)


def _steps(jobs: Sequence[Job]) -> list[Job]:
    """Return the first job of every rule, sorted so that each rule follows the rules whose files it reads."""
    maker = {path: job for job in jobs for path in job.outputs}
    # Lists and not sets, because the order must be the same in every process.
    before = {job.outputs: [maker[path].outputs for path in job.inputs if path in maker] for job in jobs}
    # Position of the last job of each rule, in an order where every job follows the jobs that made its inputs.
    latest = {maker[outputs[0]].rule: k for k, outputs in enumerate(TopologicalSorter(before).static_order())}
    first = {job.rule: job for job in reversed(jobs)}
    return [first[rule] for rule in sorted(latest, key=latest.get)]


def _describe(crate: ROCrate, publication: Publication, campaign: str) -> None:
    """Add title, licence, authors and other metadata of the deposit to the crate."""
    licence = find_licence(publication.license)
    _set(
        crate.root_dataset,
        name=publication.title,
        alternateName=f"{campaign}-{publication.version}",
        description=publication.summary,
        datePublished=publication.date,
        version=publication.version,
        license=_add(crate, licence.address, "CreativeWork", name=licence.name, identifier=licence.identifier),
        author=[_add_author(crate, author) for author in publication.authors],
        conformsTo=[_add(crate, address, "CreativeWork", **known) for address, known in TABLES["profiles"].items()],
        keywords=publication.keywords,
        identifier=publication.doi and web_address(publication.doi),
        citation=_add(crate, MODEL_PAPER.address, "ScholarlyArticle", name=MODEL_PAPER.line),
    )


def _add_author(crate: ROCrate, author: Author) -> Entity:
    if not author.is_person:
        return _add_organisation(crate, author.name, author.ror)
    return _add(
        crate,
        author.orcid_address or f"#person/{quote(author.full_name)}",
        "Person",
        name=author.full_name,
        givenName=author.given_names,
        familyName=author.family_names,
        affiliation=author.affiliation and _add_organisation(crate, author.affiliation, author.ror),
    )


def _add_organisation(crate: ROCrate, name: str, address: str | None) -> Entity:
    return _add(crate, address or f"#organisation/{quote(name)}", "Organization", name=name, url=address)


def _describe_workflow(crate: ROCrate, files: Mapping[str, File], revision: str, jobs: Sequence[Job]) -> None:
    """Add the workflow, one step for each rule, and the scripts to the crate; a script is both program and file."""
    configuration = crate.dereference("#configuration")
    _set(files[CONFIGURATION], exampleOfWork=configuration)
    tools, steps = {}, []
    for position, job in enumerate(_steps(jobs), 1):
        tools[job.script] = files[job.script]
        facts = {"version": revision, "programmingLanguage": crate.dereference("#python")}
        _set(files[job.script], ["File", "SoftwareSourceCode"], name=job.rule, description=job.description, **facts)
        facts = {"position": str(position), "workExample": files[job.script]}
        steps.append(_add(crate, f"{_WORKFLOW}#{job.rule}", "HowToStep", name=job.rule, **facts))
    _set(
        files[_WORKFLOW],
        ["File", "SoftwareSourceCode", "ComputationalWorkflow", "HowTo"],
        name="ICHA: adhesive rough contact by interacting and coalescing asperities",
        version=revision,
        conformsTo={"@id": "https://bioschemas.org/profiles/ComputationalWorkflow/1.0-RELEASE"},
        license=files[_LICENCE],
        programmingLanguage=crate.dereference("#snakemake"),
        hasPart=list(tools.values()),
        step=steps,
        input=[configuration],
    )


def _add_jobs(crate: ROCrate, jobs: Sequence[Job], files: Mapping[str, File], campaign: str, description: str) -> None:
    """Add the run of the workflow and all its jobs to the crate; for every job, add the step that started the job."""
    engine = crate.dereference("#snakemake")
    made = {path for job in jobs for path in job.outputs}
    given = {path for job in jobs for path in job.inputs} - made | {CONFIGURATION}
    run = _add_action(
        crate,
        "#campaign",
        name=campaign,
        description=description,
        instrument=files[_WORKFLOW],
        object=[files[path] for path in sorted(given)],
        result=[files[path] for path in sorted(made)],
    )
    actions, controls = [], []
    for job in jobs:
        key, name = quote(job.outputs[0]), f"{job.rule}: {job.outputs[0]}"
        action = _add_action(
            crate,
            f"#job/{key}",
            name=name,
            description=job.description,
            instrument=files[job.script],
            object=[*(files[path] for path in job.inputs), *(_add_value(crate, job, *each) for each in job.parameters)],
            result=[files[path] for path in job.outputs],
        )
        actions.append(action)
        facts = {"instrument": {"@id": f"{_WORKFLOW}#{job.rule}"}, "object": action}
        controls.append(_add_action(crate, f"#control/{key}", "ControlAction", name=f"step {name}", **facts))
    name = f"{campaign}, organised by {engine['name']}"
    _add_action(crate, "#organised", "OrganizeAction", name=name, instrument=engine, object=controls, result=run)
    crate.root_dataset.append_to("mentions", [run, *actions])


def _add_action(crate: ROCrate, key: str, kind: str = "CreateAction", **properties: Any) -> Entity:
    return _add(crate, key, kind, **properties, actionStatus="http://schema.org/CompletedActionStatus")


def _add_value(crate: ROCrate, job: Job, name: str, value: str) -> Entity:
    """Add a setting of a job to the crate and return it; jobs of one rule with the same setting share one entity."""
    digest = hashlib.sha256(value.encode()).hexdigest()[:16]
    key = f"#{job.rule}/{quote(name)}/{digest}"
    return crate.dereference(key) or _add(crate, key, "PropertyValue", name=name, value=value)


def _add(crate: ROCrate, key: str, kind: str | list[str], **properties: Any) -> Entity:
    entity = crate.add(ContextEntity(crate, key, {"@type": kind}))
    _set(entity, **properties)
    return entity


def _set(entity: Entity, kind: list[str] | None = None, **properties: Any) -> None:
    """Set the properties of an entity, except empty properties; if `kind` is given, also set the types."""
    if kind:
        entity.properties()["@type"] = kind
    for name, value in properties.items():
        if value not in (None, "", []):
            entity[name] = value[0] if isinstance(value, list) and len(value) == 1 else value
