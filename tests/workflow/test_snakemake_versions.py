"""A campaign with the lowest permitted version of Snakemake; all other tests use the highest one, which is locked.

The test installs it from the index of packages. Without access to the index the test is skipped, or fails with
`ICHA_REQUIRE_SNAKEMAKE=1`.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import snakemake as installed
from conftest import REPOSITORY, modules_of
from packaging.requirements import Requirement
from packaging.version import Version
from tiny_campaign import CAMPAIGN


def bounds():
    """Return the lowest permitted version, and the first version above the permitted ones."""
    listed = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]["workflow"]
    requirement = next(found for found in map(Requirement, listed) if found.name == "snakemake")
    limits = {limit.operator: Version(limit.version) for limit in requirement.specifier}
    return limits[">="], limits["<"]


def test_the_highest_permitted_version_is_installed_and_the_snakefile_requires_the_lowest():
    lowest, first_refused = bounds()
    assert Version(installed.__version__).release[:2] == (first_refused.major, first_refused.minor - 1)
    assert f'min_version("{lowest}")' in (REPOSITORY / "Snakefile").read_text()


@pytest.mark.slow
def test_a_campaign_with_the_lowest_version(tmp_path):
    python = str(tmp_path / "environment/bin/python")
    uv = shutil.which("uv") or str(REPOSITORY / ".venv-tools/bin/uv")
    lowest = f"snakemake=={bounds()[0]}.0"
    for command in (
        ["venv", "--quiet", "--python", sys.executable, str(tmp_path / "environment")],
        ["pip", "install", "--quiet", "--python", python, lowest, f"{REPOSITORY}[workflow]"],
    ):
        done = subprocess.run([uv, *command], capture_output=True, text=True)
        if done.returncode:
            (pytest.fail if os.environ.get("ICHA_REQUIRE_SNAKEMAKE") == "1" else pytest.skip)(done.stderr)
    (tmp_path / "tiny.yaml").write_text(CAMPAIGN)
    command = [python, "-m", "snakemake", "--snakefile", REPOSITORY / "Snakefile", "--directory", tmp_path, "dataset"]
    for message in ("steps (100%) done", "Nothing to be done"):
        done = subprocess.run(
            [*map(str, command), "report", "--configfile", str(tmp_path / "tiny.yaml")],
            env=os.environ | {"PYTHONPATH": modules_of(REPOSITORY)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert done.returncode == 0 and message in done.stdout, done.stdout
    assert Path(tmp_path, "results/tiny/report.html").is_file()
