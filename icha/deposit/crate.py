"""Describe a deposit as an RO-Crate 1.1 (https://w3id.org/ro/crate/1.1): files, software, licence, authors, origin.

One action states how the files were made: the program in `source/` computed the results from the configuration and the
inputs. The crate contains no times and no names of people who ran jobs, so the same data always have the same crate.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from icha.configuration.load import INPUTS
from icha.configuration.publication import Author, Publication
from icha.contact.models import MODEL_PAPER
from icha.datasets.results import CONFIGURATION
from icha.deposit.metadata import TABLES, licence_address, web_address, without_empty
from icha.deposit.verify import COMPUTED, CRATE, SOURCE

_VERSION = "https://w3id.org/ro/crate/1.1"
_PROGRAM = f"{SOURCE}/"
_LICENCE = f"{_PROGRAM}LICENSE"


def write_crate(
    folder: Path, publication: Publication, *, campaign: str, revision: str, sizes: Mapping[str, int]
) -> None:
    """Write the file `ro-crate-metadata.json` of a deposit.

    `revision` is that of the program in `source/`; `sizes` has the size in bytes of every file, by path in the deposit.
    """
    shown = [path for path in sorted(sizes) if not path.startswith(_PROGRAM) or path == _LICENCE]
    authors = [_author(author) for author in publication.authors]
    licence = licence_address(publication.license)
    describes = {"conformsTo": {"@id": _VERSION}, "about": {"@id": "./"}}
    root = {
        "name": publication.title,
        "alternateName": f"{campaign}-{publication.version}",
        "description": publication.summary,
        "datePublished": publication.date,
        "version": publication.version,
        "keywords": publication.keywords,
        "identifier": publication.doi and web_address(publication.doi),
        "license": {"@id": licence},
        "author": [{"@id": author["@id"]} for author, *_ in authors],
        "citation": {"@id": MODEL_PAPER.address},
        "hasPart": [{"@id": _PROGRAM}, *_files(shown)],
        "mentions": {"@id": "#campaign"},
    }
    program = {
        "name": "ICHA: adhesive rough contact by interacting and coalescing asperities",
        "description": "Source of the program that computed the results, and versions of all packages (uv.lock).",
        "version": revision,
        "license": {"@id": _LICENCE},
        "softwareRequirements": "Python",
    }
    origin = {
        "name": f"Campaign {campaign}",
        "description": "The program in source/ computed the results from the configuration and the inputs.",
        "instrument": {"@id": _PROGRAM},
        "object": _files(path for path in shown if path == CONFIGURATION or path.startswith(f"{INPUTS}/")),
        "result": _files(path for path in shown if path.split("/")[0] in COMPUTED),
    }
    entities = [
        _entity(CRATE, "CreativeWork", **describes),
        _entity("./", "Dataset", **root),
        _entity(licence, "CreativeWork", name=publication.license),
        *(entity for each in authors for entity in each),
        _entity(MODEL_PAPER.address, "ScholarlyArticle", name=MODEL_PAPER.line),
        _entity(_PROGRAM, ["Dataset", "SoftwareApplication"], **program),
        _entity("#campaign", "CreateAction", **origin),
    ]
    for path in shown:
        kind = TABLES["formats"].get(Path(path).suffix, "application/octet-stream")
        entities.append(_entity(quote(path), "File", name=path, contentSize=str(sizes[path]), encodingFormat=kind))
    # Authors from the same institution share one entity.
    graph = {entity["@id"]: entity for entity in entities}
    content = {"@context": f"{_VERSION}/context", "@graph": list(graph.values())}
    (folder / CRATE).write_text(f"{json.dumps(content, indent=1, ensure_ascii=False)}\n", encoding="utf-8")


def _author(author: Author) -> list[dict[str, Any]]:
    """Return the entity of an author, followed by the entity of the author's institution."""
    institution = author.affiliation if author.is_person else author.name
    key = author.ror or f"#organisation/{quote(institution or '')}"
    organisation = _entity(key, "Organization", name=institution, url=author.ror)
    if not author.is_person:
        return [organisation]
    person = _entity(
        author.orcid_address or f"#person/{quote(author.full_name)}",
        "Person",
        name=author.full_name,
        givenName=author.given_names,
        familyName=author.family_names,
        affiliation=institution and {"@id": key},
    )
    return [person, organisation] if institution else [person]


def _entity(key: str, kind: str | list[str], **properties: Any) -> dict[str, Any]:
    """Return an entity without empty properties; a list with one entry is written as this entry."""
    filled = without_empty({"@id": key, "@type": kind, **properties})
    return {name: value[0] if isinstance(value, list) and len(value) == 1 else value for name, value in filled.items()}


def _files(paths: Iterable[str]) -> list[dict[str, str]]:
    return [{"@id": quote(path)} for path in paths]
