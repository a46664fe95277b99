"""Known vulnerabilities of locked packages fail the audit, and what is installed is what its checksum says."""

import json
import re
import subprocess
import sys
import threading
import tomllib
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest
from conftest import REPOSITORY

VULNERABLE = {"id": "GHSA-planted", "modified": "2024-01-01T00:00:00Z"}
RANGES = [{"type": "ECOSYSTEM", "events": [{"introduced": "0"}, {"fixed": "99"}]}]
ADVICE = VULNERABLE | {"published": "2024-01-01T00:00:00Z", "summary": "Request failed", "details": "planted"}
ADVICE |= {"affected": [{"package": {"name": "jinja2", "ecosystem": "PyPI"}, "ranges": RANGES}]}


@pytest.fixture
def database():
    """A function that starts a database like OSV in which these packages are vulnerable; its address."""
    servers = []

    def start(*vulnerable):
        class Database(BaseHTTPRequestHandler):
            def do_POST(self):
                asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))["queries"]
                self.answer({"results": [{"vulns": [VULNERABLE]} if each["package"]["name"] in vulnerable else {}
                                         for each in asked]})  # fmt: skip

            def do_GET(self):
                self.answer(ADVICE)

            def answer(self, content):
                self.send_response(200)
                self.send_header("Content-Type", "application/json")
                self.end_headers()
                self.wfile.write(json.dumps(content).encode())

            def log_message(self, *_):
                pass

        servers.append(HTTPServer(("127.0.0.1", 0), Database))
        threading.Thread(target=servers[-1].serve_forever, daemon=True).start()
        return f"http://127.0.0.1:{servers[-1].server_port}"

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


@pytest.fixture
def audit(monkeypatch):
    """Call the audit with a database."""
    if not (REPOSITORY / ".venv-tools/bin/uv").exists():
        pytest.skip("uv is not installed: make environment")
    monkeypatch.setenv("UV_HTTP_RETRIES", "0")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")

    def call(address):
        command = [sys.executable, REPOSITORY / "tests/packaging/audit.py", "--service-url", address]
        done = subprocess.run(command, capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    return call


def test_a_known_vulnerability_fails_the_audit(audit, database):
    assert audit(database())[0] == 0
    status, said = audit(database("jinja2"))
    assert status == 1 and "jinja2" in said and "GHSA-planted" in said


def test_without_a_database_it_is_skipped_and_says_why(audit, monkeypatch):
    status, said = audit("http://127.0.0.1:9")
    assert status == 0 and "audit: skipped, the database could not be asked: error: " in said
    monkeypatch.setenv("ICHA_REQUIRE_AUDIT", "1")
    assert audit("http://127.0.0.1:9")[0] == 2


def test_every_file_that_is_locked_has_a_checksum():
    packages = tomllib.loads((REPOSITORY / "uv.lock").read_text())["package"]
    for package in packages:
        if "editable" not in package["source"]:
            files = [*package.get("wheels", ()), *([package["sdist"]] if "sdist" in package else [])]
            assert files and all(re.fullmatch("sha256:[0-9a-f]{64}", file["hash"]) for file in files), package["name"]


def test_whatever_make_installs_is_held_against_a_checksum():
    """By pip and uv pip; `uv sync --locked` always does. Our own files and a code that must be compiled have none."""
    makefile = (REPOSITORY / "Makefile").read_text()
    calls = re.findall(r"^\t-?(.*pip (?:install|sync) .*)$", makefile, re.MULTILINE)
    without = [call for call in calls if "--require-hashes" not in call]
    assert len(calls) >= 4 and len(without) == 2
    assert "--editable profiles/slurm/executor" in without[0] and "requirements-aspher.txt" in without[1]
    assert not re.search(r"uv sync(?!.*--locked)", makefile)
    assert re.search(r"^uv==\S+ \\\n( +--hash=sha256:[0-9a-f]{64}( \\)?\n)+$",
                     (REPOSITORY / "workflow/envs/uv.txt").read_text(), re.MULTILINE)  # fmt: skip
