"""The lowest version of Snakemake that is allowed; the highest one is that of the lock, with which all else is tested.

An environment is made for it, from the index of packages: without one the test is skipped, with
`ICHA_REQUIRE_SNAKEMAKE=1` it fails.
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

CAMPAIGN = """
name: least
title: Least
summary: For tests.
license: CC0-1.0
surfaces:
  rough: {kind: self_affine, period: 100 um, rolloff_wavelength: 50 um, short_wavelength: 20 um, hurst: 0.8, grid: 32}
materials:
  bare: {contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 2 nm}
studies:
  load:
    surfaces: [rough]
    seeds: [1]
    rms_slopes: [1.0]
    materials: [bare]
    targets: {reduced_pressures: [1.0e-3, 1.0e-2]}
"""


def bounds():
    """The lowest version that is allowed, and the first one that is not."""
    listed = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]["workflow"]
    requirement = next(found for found in map(Requirement, listed) if found.name == "snakemake")
    limits = {limit.operator: Version(limit.version) for limit in requirement.specifier}
    return limits[">="], limits["<"]


def test_the_installed_version_is_the_highest_that_is_allowed():
    assert Version(installed.__version__).release[:2] == (bounds()[1].major, bounds()[1].minor - 1)


def test_the_snakefile_asks_for_the_lowest_version():
    lowest = bounds()[0]
    assert f'min_version("{lowest}")' in (REPOSITORY / "Snakefile").read_text()


@pytest.mark.slow
def test_a_campaign_with_the_lowest_version(tmp_path):
    environment = tmp_path / "environment"
    uv = shutil.which("uv") or str(REPOSITORY / ".venv-tools/bin/uv")
    python = environment / "bin/python"
    lowest = f"{bounds()[0]}.0"
    for command in (
        ["venv", "--quiet", "--python", sys.executable, str(environment)],
        ["pip", "install", "--quiet", "--python", str(python), f"snakemake=={lowest}", f"{REPOSITORY}[workflow]"],
    ):
        try:
            done = subprocess.run([uv, *command], capture_output=True, text=True)
            wrong = done.stderr if done.returncode else None
        except OSError as error:
            wrong = str(error)
        if wrong:
            (pytest.fail if os.environ.get("ICHA_REQUIRE_SNAKEMAKE") == "1" else pytest.skip)(wrong)
    (tmp_path / "least.yaml").write_text(CAMPAIGN)
    command = [python, "-m", "snakemake", "--snakefile", REPOSITORY / "Snakefile", "--directory", tmp_path]
    for said in ("10 of 10 steps", "Nothing to be done"):
        done = subprocess.run(
            [*map(str, command), "dataset", "report", "--configfile", str(tmp_path / "least.yaml")],
            env=os.environ | {"PYTHONPATH": modules_of(REPOSITORY)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert done.returncode == 0 and said in done.stdout, done.stdout
    assert (
        f'"{lowest}"'
        in subprocess.run(
            [str(python), "-c", "import snakemake, json; print(json.dumps(snakemake.__version__))"],
            capture_output=True,
            text=True,
        ).stdout
    )
    assert Path(tmp_path, "results/least/report.html").is_file()
