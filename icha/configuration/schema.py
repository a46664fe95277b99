"""The JSON schema of configuration files and the tables of their keys, generated from the model.

`python -m icha.configuration.schema` writes both where they belong.
"""

import json
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SURFACE_KINDS
from icha.figures.registry import DECLARATIONS

SCHEMA = Path("workflow/schemas/config.schema.json")
README = Path("config/README.md")
MARK = "<!-- generated from the model: make schema -->\n"


def json_schema() -> str:
    """Return the schema, with which editors check and complete a configuration."""
    schema = _schema()
    for name in _WITH_DEFAULTS:
        # Required keys may stand among the defaults.
        schema["$defs"][name].pop("required", None)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _schema() -> dict:
    # Sections have the names of the configuration.
    return json.loads(json.dumps(Campaign.model_json_schema()).replace("MaterialSection", "Material"))


def key_tables() -> str:
    """Return every key with its description and default, a Markdown table for each section."""
    schema = _schema()
    sections = {"Campaign": schema} | schema["$defs"]
    return "\n".join(_table(_HEADINGS[name], sections[name]) for name in _HEADINGS)


_WITH_DEFAULTS = (*(kind.__name__ for kind in SURFACE_KINDS.values()), "Material", "Study")


def _figure_headings() -> dict[str, str]:
    """Return the headings of the options of figures, which several figures may share."""
    sharing: dict[str, list[str]] = {}
    for name, declaration in DECLARATIONS.items():
        sharing.setdefault(declaration.options.__name__, []).append(f"`figures.{name}`")
    return {options: ", ".join(names) for options, names in sharing.items()}


_HEADINGS = {
    "Campaign": "Top level",
    "Defaults": "`defaults`",
    "SelfAffineSurface": "`surfaces.<name>` with `kind: self_affine`",
    "MeasuredSurface": "`surfaces.<name>` with `kind: measured`",
    "Crop": "`surfaces.<name>.crop`",
    "FileSurface": "`surfaces.<name>` with `kind: file`",
    "Material": "`materials.<name>`",
    "Study": "`studies.<name>`",
    "Vary": "`studies.<name>.vary`",
    "Case": "`studies.<name>.cases`, each",
    "Targets": "`studies.<name>.targets`",
    "Snapshot": "`studies.<name>.snapshots`, each",
    "TurningPoint": "`studies.<name>.turning_points`, each",
    "BoundaryElements": "`finite_range.<name>`",
    "BoundaryElementLoops": "`boundary_element_loops.<name>`",
    "Measurement": "`measurements.<name>`",
    "Column": "`measurements.<name>.load` and `.area`",
    "Figures": "`figures`",
    **_figure_headings(),
    "Publication": "`publication`",
    "Author": "`publication.authors`, each",
    "Funding": "`publication.funding`, each",
    "RelatedIdentifier": "`publication.related_identifiers`, each",
    "KnownFailure": "`publication.known_failures`, each",
}


def _table(heading: str, section: dict) -> str:
    required = section.get("required", [])
    lines = [f"### {heading}", "", section.get("description", ""), "", "| key | default | meaning |", "|---|---|---|"]
    for key, value in section["properties"].items():
        if key in required:
            default = "required"
        elif value.get("default") is None:
            default = "none"
        elif isinstance(value["default"], dict):
            default = "none"  # a section
        else:
            default = f"`{json.dumps(value['default'])}`"
        lines.append(f"| `{key}` | {default} | {value['description']} |")
    return "\n".join([*lines, ""])


def readme_with_tables(text: str) -> str:
    """Return `text` with the tables after the mark."""
    return text.split(MARK)[0] + MARK + "\n" + key_tables()


if __name__ == "__main__":
    SCHEMA.write_text(json_schema(), encoding="utf-8")
    README.write_text(readme_with_tables(README.read_text(encoding="utf-8")), encoding="utf-8")
