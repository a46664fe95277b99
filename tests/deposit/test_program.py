"""The source of a deposit is what was committed or installed, its environment that of the lock."""

import hashlib
import importlib.metadata
import re
import shutil
import subprocess
from base64 import urlsafe_b64encode

import pytest
from conftest import REPOSITORY

from icha.deposit.program import MADE_WITH, note_versions, program_source, refuse_other_environment, version_differences
from icha.deposit.verify import files_of


def git(folder, *arguments):
    who = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org"]
    return subprocess.run(["git", *who, *arguments], cwd=folder, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def repository(tmp_path):
    """A repository with what the program's has, in small."""
    folder = tmp_path / "repository"
    for name, text in {
        "Snakefile": "rule all:\n",
        "uv.lock": "version = 1\n",
        ".gitignore": "__pycache__/\nresults/\n",
        "icha/physics.py": "ONE = 1\n",
        "icha/data.txt": "1\n2\n",
        "icha/mit Umlaut ä.txt": "ä\n",
        "workflow/rules/runs.smk": "rule run:\n",
        "profiles/default/config.yaml": "cores: 2\n",
        "config/config.yaml": "name: mine\n",
        "docs/page.md": "# Page\n",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(text.encode())
    (folder / "workflow/tool.sh").write_text("#!/bin/sh\n")
    (folder / "workflow/tool.sh").chmod(0o755)
    git(folder, "init", "--quiet")
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "--message", "All")
    return folder


def test_source_is_what_was_committed_byte_by_byte(repository, tmp_path):
    source = program_source(repository)
    assert source.revision == git(repository, "rev-parse", "HEAD").strip()
    source.export(tmp_path / "export")
    exported = {name: tmp_path / "export" / name for name in files_of(tmp_path / "export")}
    assert set(exported) == set(git(repository, "-c", "core.quotePath=false", "ls-files").splitlines())
    for name, path in exported.items():
        assert path.read_bytes() == (repository / name).read_bytes(), name
    assert {name for name, path in exported.items() if path.stat().st_mode & 0o111} == {"workflow/tool.sh"}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda r: (r / "icha/physics.py").write_text("ONE = 2\n"), "changed: icha/physics.py"),
        (lambda r: (r / "docs/page.md").write_text("# Pages\n"), "changed: docs/page.md"),
        (lambda r: (r / "icha/physics.py").unlink(), "changed: icha/physics.py"),
        (lambda r: (r / "icha/more.py").write_text("TWO = 2\n"), "not committed: icha/more.py"),
        (lambda r: (r / "workflow/rules/ä b.smk").write_text(""), "not committed: workflow/rules/ä b.smk"),
    ],
)
def test_changes_that_are_not_committed_are_refused(repository, spoil, message):
    spoil(repository)
    with pytest.raises(ValueError, match=f"git commit(.|\n)*{re.escape(message)}"):
        program_source(repository)


def test_changes_that_git_status_does_not_show_are_refused(repository):
    (repository / "icha/more.py").write_text("TWO = 2\n")
    (repository / ".git/info/exclude").write_text("more.py\n")
    git(repository, "update-index", "--assume-unchanged", "icha/physics.py")
    (repository / "icha/physics.py").write_text("ONE = 2\n")
    assert git(repository, "status", "--porcelain") == ""
    with pytest.raises(ValueError, match=r"changed: icha/physics\.py\n  not committed: icha/more\.py"):
        program_source(repository)


def test_configurations_results_and_other_files_are_no_part_of_the_program(repository):
    commit = program_source(repository).revision
    (repository / "config/config.yaml").write_text("name: yours\n")
    for name in ("config/campaigns/new.yaml", "results/x.nc", "icha/__pycache__/physics.pyc", "notes.txt"):
        (repository / name).parent.mkdir(parents=True, exist_ok=True)
        (repository / name).write_text("")
    source = program_source(repository)
    assert source.revision == commit


def test_a_project_may_be_a_folder_of_a_shallow_clone(repository, tmp_path, monkeypatch):
    outer = tmp_path / "outer"
    shutil.copytree(repository, outer / "sub/contact", ignore=shutil.ignore_patterns(".git"))
    (outer / "private.txt").write_text("not of the project\n")
    git(outer, "init", "--quiet")
    git(outer, "add", ".")
    git(outer, "commit", "--quiet", "--message", "All")
    git(tmp_path, "clone", "--quiet", "--depth", "1", f"file://{outer}", "shallow")
    # Git sets this variable for its hooks.
    monkeypatch.setenv("GIT_DIR", str(repository / ".git"))
    source = program_source(tmp_path / "shallow/sub/contact")
    monkeypatch.delenv("GIT_DIR")
    assert source.revision == git(outer, "rev-parse", "HEAD").strip()
    assert {name: content for name, (content, _) in source.files.items()} == {
        name: (repository / name).read_bytes() for name in files_of(repository) if not name.startswith(".git/")
    }


def test_folders_without_a_commit_and_links_are_refused(repository, tmp_path, monkeypatch):
    plain = shutil.copytree(repository, tmp_path / "plain", ignore=shutil.ignore_patterns(".git"))
    for _ in range(2):
        with pytest.raises(ValueError, match=r"not a git repository or has no commit(.|\n)*git init"):
            program_source(plain)
        git(plain, "init", "--quiet")
    (repository / "link").symlink_to("Snakefile")
    git(repository, "add", "link")
    git(repository, "commit", "--quiet", "--message", "Link")
    with pytest.raises(ValueError, match="a link: link"):
        program_source(repository)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ValueError, match="git: no such program"):
        program_source(repository)


INSTALLED = {
    "icha/__init__.py": "",
    "icha/physics.py": "ONE = 1\n",
    "icha_workflow/Snakefile": "rule all:\n",
    "icha_workflow/uv.lock": "version = 1\n",
}


@pytest.fixture
def place(tmp_path):
    """A folder as pip leaves it."""
    place, record = tmp_path / "site-packages", []
    for name, text in INSTALLED.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text)
        digest = urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).decode().rstrip("=")
        record.append(f"{name},sha256={digest},{len(text)}")
    information = place / "icha-7.1.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.4\nName: icha\nVersion: 7.1\n")
    (information / "RECORD").write_text("\n".join([*record, "../../bin/icha,sha256=x,1", "icha/physics.pyc,,"]) + "\n")
    return place


def test_source_is_what_was_installed_in_its_places_in_the_repository(place):
    (place / "icha/__pycache__").mkdir()
    (place / "icha/__pycache__/physics.pyc").write_bytes(b"x")
    source = program_source(place / "icha_workflow")
    shipped = {name: text.encode() for name, text in INSTALLED.items() if name.startswith("icha")}
    listed = "".join(f"{hashlib.sha256(shipped[name]).hexdigest()}  {name}\n" for name in sorted(shipped))
    assert source.revision == f"icha-7.1-{hashlib.sha256(listed.encode()).hexdigest()}"
    assert source.files == {name.removeprefix("icha_workflow/"): (content, 0o644) for name, content in shipped.items()}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda p: (p / "icha/physics.py").write_text("ONE = 2\n"), "changed: icha/physics.py"),
        (lambda p: (p / "icha_workflow/Snakefile").unlink(), "changed: icha_workflow/Snakefile"),
        (lambda p: (p / "icha/more.py").write_text(""), "not of the installed version: icha/more.py"),
        (lambda p: (p / "icha-7.1.dist-info").rename(p / "other"), "the package `icha` is not installed here"),
    ],
)
def test_another_program_than_what_was_installed_is_refused(place, spoil, message):
    spoil(place)
    with pytest.raises(ValueError, match=re.escape(message)):
        program_source(place / "icha_workflow")


def write_lock(folder, **versions):
    packages = (
        f'[[package]]\nname = "{name}"\nversion = "{version}"\nsource = {{ registry = "https://pypi.org/simple" }}\n'
        for name, version in versions.items()
    )
    text = "".join(['version = 1\n[[package]]\nname = "icha"\nsource = { editable = "." }\n', *packages])
    (folder / "uv.lock").write_text(text)
    return text


def test_another_environment_than_the_locked_one_is_refused(tmp_path):
    numpy = importlib.metadata.version("numpy")
    assert version_differences(write_lock(tmp_path, NumPy=numpy, nobody="1")) == {}
    assert version_differences(write_lock(tmp_path, NumPy="0.1")) == {"numpy": f"{numpy} is installed, 0.1 is locked"}
    with pytest.raises(ValueError, match=r"make environment(.|\n)*icha: imported from(.|\n)*numpy: "):
        refuse_other_environment(tmp_path, tmp_path / "results")


def test_results_that_were_made_with_other_versions_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("icha.deposit.program.package_of", lambda project: REPOSITORY / "icha")
    results = tmp_path / "results/mine"
    write_lock(tmp_path, numpy=importlib.metadata.version("numpy"))
    refuse_other_environment(tmp_path, results)  # nothing is known of them
    results.mkdir(parents=True)
    note_versions(results)
    refuse_other_environment(tmp_path, results)
    (results / MADE_WITH).write_text("numpy==0.1\nother==3\n")
    note_versions(results)
    noted = (results / MADE_WITH).read_text().splitlines()
    assert "numpy==0.1" in noted and len([line for line in noted if line.startswith("numpy==")]) == 2
    with pytest.raises(ValueError, match=r"made with other versions than those of uv\.lock(.|\n)*  numpy 0\.1"):
        refuse_other_environment(tmp_path, results)
    written = (results / MADE_WITH).stat().st_mtime_ns
    note_versions(results)
    assert (results / MADE_WITH).stat().st_mtime_ns == written
