"""The source of a deposit is the program as it ran, and its environment that of the lock file."""

import hashlib
import importlib.metadata
import re
import shutil
import subprocess

import pytest
from conftest import REPOSITORY, copy_project
from outside_validators import lock

import icha
from icha.deposit.program import program_source, refuse_other_environment, version_differences
from icha.deposit.verify import files_of


def git(folder, *arguments):
    return subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A clone whose package runs; git sets a variable for its hooks, which must not matter."""
    folder = copy_project(REPOSITORY, tmp_path / "clone")
    monkeypatch.setattr(icha, "__file__", str(folder / "icha/__init__.py"))
    monkeypatch.setenv("GIT_DIR", str(REPOSITORY / ".git"))
    return folder


def test_the_source_is_the_program_as_it_ran(clone, tmp_path):
    (clone / "icha/__pycache__").mkdir(exist_ok=True)
    (clone / "icha/__pycache__/x.pyc").touch()
    (clone / "config/campaigns/secret.yaml").write_text("name: secret\n")
    (clone / "notes.txt").write_text("secret\n")
    source = program_source(clone)
    source.export(tmp_path / "export")
    exported = files_of(tmp_path / "export")
    assert {"Snakefile", "uv.lock", "Makefile", "icha/__init__.py", "workflow/rules/runs.smk"} <= set(exported)
    assert {path.split("/")[0] for path in exported} <= {
        *("Snakefile", "uv.lock", "Makefile", "pyproject.toml", "README.md", "LICENSE", "icha", "workflow", "profiles")
    }
    assert not [path for path in exported if "secret" in path or path.endswith(".pyc")]
    for path in exported:
        assert (tmp_path / "export" / path).read_bytes() == (clone / path).read_bytes(), path


def test_the_revision_is_the_commit_or_a_checksum_of_the_files(clone, monkeypatch):
    commit = program_source(clone).revision
    monkeypatch.delenv("GIT_DIR")
    assert commit == git(clone, "rev-parse", "HEAD")
    (clone / "config/config.yaml").write_text("name: mine\n")
    (clone / "results").mkdir()
    assert program_source(clone).revision == commit

    def checksum():
        source = program_source(clone)
        sums = "".join(
            f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {name}\n" for name, file in source.files.items()
        )
        digest = hashlib.sha256(sums.encode()).hexdigest()
        assert source.revision == f"icha-{importlib.metadata.version('icha')}-{digest}"
        return digest

    (clone / "icha/more.py").write_text("TWO = 2\n")
    (clone / ".git/info/exclude").write_text("more.py\n")
    untracked = checksum()
    (clone / "icha/more.py").write_text("TWO = 3\n")
    assert checksum() != untracked
    (clone / "icha/more.py").unlink()
    (clone / "Snakefile").write_text("# changed\n")
    changed = checksum()
    shutil.rmtree(clone / ".git")
    assert checksum() == changed
    monkeypatch.setenv("PATH", str(clone))  # without git
    assert checksum() == changed


def test_another_environment_than_the_locked_one_is_refused(tmp_path):
    numpy = importlib.metadata.version("numpy")
    (tmp_path / "uv.lock").write_text(lock(NumPy=numpy, nobody="1"))
    refuse_other_environment(tmp_path)
    (tmp_path / "uv.lock").write_text(lock(NumPy="0.1"))
    assert version_differences(lock(NumPy="0.1")) == {"numpy": f"{numpy} is installed, 0.1 is locked"}
    with pytest.raises(ValueError, match=re.compile("make environment.*numpy: ", re.DOTALL)):
        refuse_other_environment(tmp_path)
