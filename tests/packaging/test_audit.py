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
