"""The wheel contains all files that campaigns need; files that describe the package agree, also checksums."""

import re
import subprocess
import tomllib

import pytest
import yaml
from conftest import REPOSITORY

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
METADATA = PROJECT["project"]
WHEEL = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
# Files that are not in the wheel.
LEFT_OUT = ("tests/", "docs/", "benchmarks/", "validation/", "recipe/", "results/", ".")
LEFT_OUT += ("CONTRIBUTING.md", "VISION.md", "Containerfile")


def test_every_file_of_the_repository_is_in_the_wheel_or_in_the_list_of_omitted_files():
    listed = [*WHEEL["packages"], *WHEEL["hooks"]["custom"]["files"]]
    assert {"Snakefile", "workflow", "config", "profiles", "pyproject.toml", "uv.lock", "Makefile"} <= set(listed)
    assert [name for name in listed if not (REPOSITORY / name).exists()] == []
    if not (REPOSITORY / ".git").exists():
        pytest.skip("not a clone")
    files = subprocess.run(["git", "ls-files"], cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout
    for file in files.splitlines():
        shipped = any(file == name or file.startswith(f"{name}/") for name in listed)
        assert shipped is not (file.startswith(LEFT_OUT) and file not in listed), file


def test_the_recipe_for_conda_has_the_version_and_the_requirements_of_the_package():
    cited = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))
    recipe = yaml.safe_load((REPOSITORY / "recipe/recipe.yaml").read_text(encoding="utf-8"))
    assert METADATA["version"] == cited["version"] == recipe["context"]["version"]
    other_names = {"matplotlib": "matplotlib-base", "snakemake": "snakemake-minimal"}
    library, workflow = (output["requirements"]["run"] for output in recipe["outputs"])
    for there, asked in (
        (library, METADATA["dependencies"]),
        (workflow, METADATA["optional-dependencies"]["workflow"]),
    ):
        split = [re.fullmatch(r"([\w-]+)(.*)", line).groups() for line in asked]
        expected = {f"{other_names.get(name.lower(), name.lower())} {versions}" for name, versions in split}
        assert {line for line in there if not line.startswith(("python ", "__unix", "${{"))} == expected
    assert recipe["context"]["python_min"] == METADATA["requires-python"].removeprefix(">=")
