"""Generate the JSON schema of configuration files, and the tables of all keys in config/README.md.

`python -m icha.configuration.schema` writes both to their files.
"""

import json
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SURFACE_KINDS

SCHEMA = Path("workflow/schemas/config.schema.json")
README = Path("config/README.md")
MARK = "<!-- generated from the model: make schema -->\n"


def json_schema() -> str:
    """Return the JSON schema with which text editors check and complete configuration files."""
    schema = _schema()
    for name in (*(kind.__name__ for kind in SURFACE_KINDS.values()), "Material", "Study"):
        # The defaults may contain a required key, so the schema must not require the key in every entry.
        schema["$defs"][name].pop("required", None)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _schema() -> dict:
    text = json.dumps(Campaign.model_json_schema())
    # Use the section's name `Material`, and remove line breaks from descriptions.
    return json.loads(re.sub(r"\\n *", " ", text.replace("MaterialSection", "Material")))


def key_tables() -> str:
    """Return a Markdown table for each section, with the default and the meaning of every key."""
    schema = _schema()
    places: dict[str, list[str]] = {}
    for name, place in _sections(schema, schema, ""):
        places.setdefault(name, []).append(place)
    known: set[tuple[str, str]] = set()
    top = _table("Top level", schema, known)
    tables = [_table(", ".join(dict.fromkeys(places[name])), schema["$defs"][name], known) for name in places]
    return "\n".join([top, *tables])


def _sections(section: dict, schema: dict, place: str) -> Iterator[tuple[str, str]]:
    """Yield class name and location of all sections inside a section, such as `Study` and `studies.<name>`."""
    others = section.get("additionalProperties")
    for key, value in (section["properties"] | ({"<name>": others} if others else {})).items():
        text = json.dumps(value)
        where = f"{place}{key}" + (".<name>" if "patternProperties" in text else "")
        for name in re.findall(r'"\$ref": "#/\$defs/(\w+)"', text):
            inner = schema["$defs"][name]
            kind = inner["properties"].get("kind", {}).get("const")
            yield name, f"`{where}`" + (", each" if '"items"' in text else f" with `kind: {kind}`" if kind else "")
            yield from _sections(inner, schema, f"{where}.")


def _table(heading: str, section: dict, known: set[tuple[str, str]]) -> str:
    """Return the table of one section; optional keys that an earlier table describes are only named."""
    required = section.get("required", [])
    rows, repeated = [], []
    for key, value in section["properties"].items():
        default = value.get("default")
        if default is None and key not in required and (key, value["description"]) in known:
            repeated.append(f"`{key}`")
            continue
        known.add((key, value["description"]))
        # If the default is a section, the section may be missing from the file.
        shown = "none" if default is None or isinstance(default, dict) else f"`{json.dumps(default)}`"
        rows.append(f"| `{key}` | {'required' if key in required else shown} | {value['description']} |")
    lines = [f"### {heading}", "", section.get("description", ""), ""]
    if rows:
        lines += ["| key | default | meaning |", "|---|---|---|", *rows, ""]
    if repeated:
        lines += [*textwrap.wrap(f"Keys with the meaning given above: {', '.join(repeated)}.", 120), ""]
    return "\n".join(lines)


def readme_with_tables(text: str) -> str:
    """Return the text of config/README.md with new tables of keys after the marker."""
    return text.split(MARK)[0] + MARK + "\n" + key_tables()


if __name__ == "__main__":
    SCHEMA.write_text(json_schema(), encoding="utf-8")
    README.write_text(readme_with_tables(README.read_text(encoding="utf-8")), encoding="utf-8")
