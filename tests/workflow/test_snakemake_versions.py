"""A campaign with the lowest permitted version of Snakemake, and with the newest; other tests use the locked one.

The test installs both from the index of packages. Without access to the index the test is skipped, or fails with
`ICHA_REQUIRE_SNAKEMAKE=1`.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from conftest import REPOSITORY
from packaging.requirements import Requirement
from tiny_campaign import CAMPAIGN


def lowest_version():
    """Return the lowest permitted version; no version is too new."""
    listed = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]["workflow"]
    requirement = next(found for found in map(Requirement, listed) if found.name == "snakemake")
    (limit,) = requirement.specifier
    assert limit.operator == ">="
    return limit.version


def test_the_snakefile_requires_the_lowest_version():
    assert f'min_version("{lowest_version()}")' in (REPOSITORY / "Snakefile").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("version", [f"=={lowest_version()}.*", ""], ids=["lowest", "newest"])
def test_a_campaign_with_other_versions(version, tmp_path):
    python = str(tmp_path / "environment/bin/python")
    uv = shutil.which("uv") or str(REPOSITORY / ".venv-tools/bin/uv")
    for command in (
        ["venv", "--quiet", "--python", sys.executable, str(tmp_path / "environment")],
        ["pip", "install", "--quiet", "--python", python, f"snakemake{version}", f"{REPOSITORY}[workflow]"],
    ):
        done = subprocess.run([uv, *command], capture_output=True, text=True)
        if done.returncode:
            (pytest.fail if os.environ.get("ICHA_REQUIRE_SNAKEMAKE") == "1" else pytest.skip)(done.stderr)
    (tmp_path / "tiny.yaml").write_text(CAMPAIGN)
    command = [python, "-m", "snakemake", "--snakefile", REPOSITORY / "Snakefile", "--directory", tmp_path, "dataset"]

    def run():
        done = subprocess.run(
            [*map(str, command), "report", "--configfile", str(tmp_path / "tiny.yaml")],
            env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert done.returncode == 0, done.stdout
        return done.stdout

    assert "steps (100%) done" in run()
    assert "Nothing to be done" in run()
    # A batch keeps the runs that exist.
    kept, removed = (tmp_path / f"results/tiny/runs/load/rough/seed1/slope1/{name}.nc" for name in ("bare", "soft"))
    content, number = removed.read_bytes(), kept.stat().st_ino
    removed.unlink()
    assert "steps (100%) done" in run()
    assert removed.read_bytes() == content and kept.stat().st_ino == number
    assert Path(tmp_path, "results/tiny/report.html").is_file()
