"""All installed files have checksums; the audit for vulnerabilities is skipped if the database cannot be reached."""

import re
import subprocess
import sys
import tomllib

import pytest
from conftest import REPOSITORY


@pytest.mark.skipif(not (REPOSITORY / ".venv-tools/bin/uv").exists(), reason="uv is not installed: make environment")
def test_without_a_database_the_audit_is_skipped_with_the_reason(monkeypatch):
    monkeypatch.setenv("UV_HTTP_RETRIES", "0")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    command = [sys.executable, REPOSITORY / "tests/packaging/audit.py", "--service-url", "http://127.0.0.1:9"]
    for required, status in (("0", 0), ("1", 2)):
        monkeypatch.setenv("ICHA_REQUIRE_AUDIT", required)
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == status and "the database could not be reached: error: " in done.stdout + done.stderr


def test_every_locked_file_has_a_checksum():
    packages = tomllib.loads((REPOSITORY / "uv.lock").read_text())["package"]
    for package in packages:
        if "editable" not in package["source"]:
            files = [*package.get("wheels", ()), *([package["sdist"]] if "sdist" in package else [])]
            assert files and all(re.fullmatch("sha256:[0-9a-f]{64}", file["hash"]) for file in files), package["name"]


def test_make_installs_only_files_with_checksums():
    """pip and `uv pip` need the option --require-hashes, `uv sync --locked` does not.

    The executor of this repository and aspher, which is compiled, have no checksums.
    """
    makefile = (REPOSITORY / "Makefile").read_text()
    calls = re.findall(r"^\t-?(.*pip (?:install|sync) .*)$", makefile, re.MULTILINE)
    without = [call for call in calls if "--require-hashes" not in call]
    assert len(calls) >= 4 and len(without) == 2
    assert "--editable profiles/slurm/executor" in without[0] and "requirements-aspher.txt" in without[1]
    assert not re.search(r"uv sync(?!.*--locked)", makefile)
    assert re.search(r"^uv==\S+ \\\n( +--hash=sha256:[0-9a-f]{64}( \\)?\n)+$",
                     (REPOSITORY / "workflow/envs/uv.txt").read_text(), re.MULTILINE)  # fmt: skip
