"""The schema and the tables that are generated from the sections."""

from demo_configuration import REPOSITORY

from icha.configuration.schema import json_schema, readme_with_tables
from icha.support.values import Section


def test_schema_and_tables_are_those_of_the_model():
    advice = "out of date: run `make schema`"
    assert (REPOSITORY / "workflow/schemas/config.schema.json").read_text(encoding="utf-8") == json_schema(), advice
    readme = (REPOSITORY / "config/README.md").read_text(encoding="utf-8")
    assert readme == readme_with_tables(readme), advice


def test_every_key_is_described():
    def sections(kind):
        yield kind
        for child in kind.__subclasses__():
            yield from sections(child)

    for section in sections(Section):
        for key, field in section.model_fields.items():
            assert field.description, f"{section.__name__}.{key}"
