"""The source of a deposit is what was committed, and nothing else can be published."""

import re
import shutil
import subprocess

import pytest

from icha.deposit.deposit_files import files_of
from icha.deposit.source import committed_source


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
        ".gitattributes": "icha/data.txt export-ignore\n*.txt text eol=crlf\nicha/id.py export-subst\n",
        "icha/physics.py": "ONE = 1\n",
        "icha/id.py": "COMMIT = '$Format:%H$'\n",
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
    source = committed_source(repository)
    assert source.revision == git(repository, "rev-parse", "HEAD").strip()
    source.export(tmp_path / "export")
    exported = {name: tmp_path / "export" / name for name in files_of(tmp_path / "export")}
    assert set(exported) == set(git(repository, "-c", "core.quotePath=false", "ls-files").splitlines())
    for name, path in exported.items():
        assert path.read_bytes() == (repository / name).read_bytes(), name
    assert {name for name, path in exported.items() if path.stat().st_mode & 0o111} == {"workflow/tool.sh"}


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda r: (r / "icha/physics.py").write_text("ONE = 2\n"), "changed: icha/physics.py"),
        (lambda r: (r / "docs/page.md").write_text("# Pages\n"), "changed: docs/page.md"),
        (lambda r: (r / "icha/physics.py").unlink(), "changed: icha/physics.py"),
        (lambda r: (r / "icha/more.py").write_text("TWO = 2\n"), "not committed: icha/more.py"),
        (lambda r: (r / "profiles/default/more.yaml").write_text(""), "not committed: profiles/default/more.yaml"),
        (lambda r: (r / "workflow/rules/ä b.smk").write_text(""), "not committed: workflow/rules/ä b.smk"),
    ],
)
def test_changes_that_are_not_committed_are_refused(repository, spoil, said):
    spoil(repository)
    with pytest.raises(ValueError, match=f"git commit(.|\n)*{re.escape(said)}"):
        committed_source(repository)


def test_changes_cannot_be_hidden(repository, monkeypatch, tmp_path):
    (repository / "icha/more.py").write_text("TWO = 2\n")
    git(repository, "add", "icha/more.py")
    with pytest.raises(ValueError, match=r"not committed: icha/more\.py"):
        committed_source(repository)
    git(repository, "reset", "--quiet")
    (repository / ".git/info/exclude").write_text("more.py\n")
    (tmp_path / "ignore").write_text("more.py\n")
    (tmp_path / "gitconfig").write_text(f"[core]\nexcludesFile = {tmp_path / 'ignore'}\n")
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "gitconfig"))
    assert git(repository, "status", "--porcelain") == ""
    with pytest.raises(ValueError, match=r"not committed: icha/more\.py"):
        committed_source(repository)
    (repository / "icha/more.py").unlink()
    git(repository, "update-index", "--assume-unchanged", "icha/physics.py")
    (repository / "icha/physics.py").write_text("ONE = 2\n")
    assert git(repository, "status", "--porcelain") == ""
    with pytest.raises(ValueError, match=r"changed: icha/physics\.py"):
        committed_source(repository)


def test_configurations_results_and_other_files_are_no_part_of_the_program(repository):
    commit = committed_source(repository).revision
    (repository / "config/config.yaml").write_text("name: yours\n")
    for name in ("config/campaigns/new.yaml", "results/x.nc", "icha/__pycache__/physics.pyc", "notes.txt"):
        (repository / name).parent.mkdir(parents=True, exist_ok=True)
        (repository / name).write_text("")
    source = committed_source(repository)
    assert source.revision == commit and "notes.txt" not in source.files


def test_a_project_may_be_a_part_of_a_repository_and_of_a_shallow_clone(repository, tmp_path, monkeypatch):
    outer = tmp_path / "outer"
    shutil.copytree(repository, outer / "sub/contact", ignore=shutil.ignore_patterns(".git"))
    (outer / "private.txt").write_text("not of the project\n")
    git(outer, "init", "--quiet")
    git(outer, "add", ".")
    git(outer, "commit", "--quiet", "--message", "All")
    (outer / "private.txt").write_text("changed, too\n")
    git(outer, "commit", "--quiet", "--all", "--message", "More")
    git(tmp_path, "clone", "--quiet", "--depth", "1", f"file://{outer}", "shallow")
    for folder in (outer, tmp_path / "shallow"):
        # Where git thinks that it is called from a hook.
        monkeypatch.setenv("GIT_DIR", str(repository / ".git"))
        source = committed_source(folder / "sub/contact")
        monkeypatch.delenv("GIT_DIR")
        assert source.revision == git(outer, "rev-parse", "HEAD").strip()
        target = tmp_path / f"of_{folder.name}"
        source.export(target)
        own = {name: (repository / name).read_bytes() for name in files_of(repository) if not name.startswith(".git/")}
        assert {name: (target / name).read_bytes() for name in files_of(target)} == own


def test_folders_without_a_commit_are_refused(repository, tmp_path, monkeypatch):
    plain = shutil.copytree(repository, tmp_path / "plain", ignore=shutil.ignore_patterns(".git"))
    with pytest.raises(ValueError, match=r"is not under git(.|\n)*git init"):
        committed_source(plain)
    git(plain, "init", "--quiet")
    with pytest.raises(ValueError, match="nothing is committed yet"):
        committed_source(plain)
    (repository / "link").symlink_to("Snakefile")
    git(repository, "add", "link")
    git(repository, "commit", "--quiet", "--message", "Link")
    with pytest.raises(ValueError, match=r"files only(.|\n)*link"):
        committed_source(repository)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ValueError, match="git: no such program"):
        committed_source(repository)
