"""The README's examples run, and it is short."""

import re
from pathlib import Path

import pytest

from icha.configuration.load import load_configuration

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def only_block(language):
    (block,) = re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)
    return block


def test_readme_has_at_most_150_lines():
    assert len(README.splitlines()) <= 150


def test_python_example_runs_without_the_workflow():
    names = {}
    exec(compile(only_block("python"), "README", "exec"), names)
    assert list(names["run"].reduced_pressure.values) == pytest.approx([1e-3, 3e-3, 1e-2], rel=1e-9)


def test_campaign_is_valid(tmp_path):
    (tmp_path / "mine.yaml").write_text(only_block("yaml"), encoding="utf-8")
    study = load_configuration(tmp_path / "mine.yaml").campaign.studies["load"]
    assert list(study.models) == ["asperities", "boundary_elements"]
