"""`icha upload` against servers on this machine: requests, confirmation, and failures of servers."""

import hashlib
import json
import re
import threading
import zipfile
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace

import pytest
import requests
from typer.testing import CliRunner
from zenodo_mock.testing import spawn

from icha.cli import app, deposits
from icha.deposit.upload import Zenodo, ZenodoError, server_address

TOKEN = "Secret0f4ToKeN"
NAME = "mine-1.0.0"
METADATA = {
    "upload_type": "dataset",
    "title": "A campaign",
    "version": "1.0.0",
    "license": "cc-by-4.0",
    "creators": [{"name": "Carberry, Josiah"}, {"name": "The team"}],
    "communities": [{"identifier": "contact"}],
    "description": "<p>Small.</p>",
}
FILES = {
    "README.md": b"# A campaign\n",
    "ro-crate-metadata.json": b'{"@graph": []}\n',
    "dataset/mine.nc": bytes(range(256)) * 4000,
}
SENT = {f"{NAME}.zip", "README.md", "ro-crate-metadata.json"}


def make_deposit(folder, **metadata):
    """A deposit, as a folder and a zip, with just what an upload looks at."""
    files = FILES | {".zenodo.json": json.dumps(METADATA | metadata).encode()}
    files["SHA256SUMS"] = "".join(
        f"{hashlib.sha256(content).hexdigest()}  {name}\n" for name, content in sorted(files.items())
    ).encode()
    with zipfile.ZipFile(folder / f"{NAME}.zip", "w") as archive:
        for name, content in sorted(files.items()):
            (folder / NAME / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / NAME / name).write_bytes(content)
            archive.writestr(zipfile.ZipInfo(f"{NAME}/{name}"), content)
    return folder / f"{NAME}.zip"


@pytest.fixture
def deposit(tmp_path):
    return make_deposit(tmp_path)


def upload(*arguments, token=TOKEN):
    """The exit status and all that was printed; the token is never among it."""
    done = CliRunner().invoke(app, ["upload", *map(str, arguments)], env={"ZENODO_TOKEN": token})
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    assert not token or token not in done.output
    return done.exit_code, done.output


class Server(ThreadingHTTPServer):
    """Answers as Zenodo does, records requests, and fails on demand.

    `failures` are taken one after the other by the requests that they are for: method, part of the path, and the
    action that replaces the answer.
    """

    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.requests, self.failures, self.files, self.metadata, self.published = [], [], {}, {}, False
        self.address = f"http://127.0.0.1:{self.server_port}"

    def handle_error(self, request, client_address):
        """Ignore connections that tests break."""

    def deposition(self):
        files = {name: hashlib.md5(content).hexdigest() for name, content in self.files.items()}
        return {
            "id": 77,
            "submitted": self.published,
            "metadata": self.metadata | {"prereserve_doi": {"doi": "10.5072/zenodo.77"}},
            "files": [{"id": f"id-{name}", "filename": name, "checksum": md5} for name, md5 in files.items()],
            "links": {"bucket": f"{self.address}/api/files/b-77", "html": f"{self.address}/deposit/77"},
        }


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *arguments):
        pass

    def _handle(self):
        server = self.server
        server.requests.append((self.command, self.path, self.headers.get("Authorization")))
        for failure in server.failures:
            method, part, action = failure
            if method == self.command and part in self.path:
                server.failures.remove(failure)
                return action(self)
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        parts = self.path.strip("/").split("/")
        if parts[:2] == ["api", "files"] and self.command == "PUT":
            server.files[parts[3]] = body
            return self.answer(201, {"key": parts[3], "checksum": f"md5:{hashlib.md5(body).hexdigest()}"})
        if self.command == "PUT":
            server.metadata = json.loads(body)["metadata"]
        return self.answer(201 if self.command == "POST" else 200, server.deposition())

    do_GET = do_POST = do_PUT = _handle

    def answer(self, status, content=None, **headers):
        body = b"" if content is None else json.dumps(content).encode()
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        if status != 204:
            self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


@pytest.fixture
def server():
    with Server() as each:
        thread = threading.Thread(target=each.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        yield each
        each.shutdown()


def refuse(status, content=None, **headers):
    """A failure: read what is sent, and answer otherwise."""

    def action(handler):
        handler.rfile.read(int(handler.headers.get("Content-Length", 0)))
        handler.answer(status, content, **headers)

    return action


def break_off(handler):
    """A failure: end the connection in the middle of what is sent."""
    handler.rfile.read(min(1000, int(handler.headers["Content-Length"])))
    handler.close_connection = True
    handler.connection.close()


def test_a_deposit_goes_to_zenodo_and_comes_back(tmp_path, deposit):
    with spawn(tmp_path / "zenodo") as address:
        status, output = upload(deposit, "--url", address, "--yes")
        assert status == 0, output
        number, page = re.search(r"/uploads/(\d+) is a draft", output)[1], f"{address}/api/deposit/depositions"
        token = {"Authorization": f"Bearer {TOKEN}"}
        requests.post(f"{page}/{number}/actions/publish", headers=token).raise_for_status()
        record = requests.get(f"{address}/api/records/{number}").json()
        assert {key: record["metadata"][key] for key in METADATA} == METADATA
        got = {file["key"]: requests.get(file["links"]["download"]).content for file in record["files"]}
        assert set(got) == SENT and got[f"{NAME}.zip"] == deposit.read_bytes()
        assert got["README.md"] == FILES["README.md"]


def test_a_draft_gets_metadata_and_files_but_is_not_published(server, deposit):
    status, output = upload(deposit.parent / NAME, "--url", server.address, "--yes")  # the folder
    assert status == 0 and f"{server.address}/uploads/77 is a draft" in output and not server.published
    assert server.files == {name: FILES[name] for name in SENT - {deposit.name}} | {deposit.name: deposit.read_bytes()}
    assert server.metadata == METADATA
    assert {token for _, _, token in server.requests} == {f"Bearer {TOKEN}"}
    server.files["README.md"] = b"of another version"
    assert upload(deposit, "--url", server.address, "--draft", "77", "--yes")[0] == 0
    assert server.files["README.md"] == FILES["README.md"]
    server.published = True
    status, output = upload(deposit, "--url", server.address, "--draft", "77", "--yes")
    assert status == 1 and "77 is already published" in output


def test_nothing_is_sent_without_consent(server, deposit, monkeypatch):
    status, output = upload(deposit, "--url", server.address)
    assert status == 2 and "nothing was sent. Use --yes" in output
    for text in ("A campaign", "1.0.0", "Carberry, Josiah; The team", "cc-by-4.0", "contact", server.address, *SENT):
        assert text in output
    assert f"({deposit.stat().st_size:,} bytes)" in output
    monkeypatch.setattr(deposits, "confirm", lambda question: False)
    monkeypatch.setattr(deposits, "sys", SimpleNamespace(stdin=SimpleNamespace(isatty=lambda: True)))
    assert upload(deposit, "--url", server.address)[0] == 1 and server.requests == []


def test_what_cannot_be_sent_is_refused_before_anything_is_asked(server, deposit, tmp_path):
    def refused(*arguments, **how):
        status, output = upload(*arguments, "--yes", **how)
        assert status == 2, output
        return output

    url = ("--url", server.address)
    assert "ZENODO_TOKEN is not set" in refused(deposit, *url, token="")
    assert "is not a token" in refused(deposit, *url, token="two words")
    assert "no such file" in refused(tmp_path / "none.zip", *url)
    refused(deposit, "--draft", "mine", *url)
    assert "with http" in refused(deposit, "--url", "http://zenodo.org")
    (tmp_path / "reserved").mkdir()
    reserved = make_deposit(tmp_path / "reserved", doi="10.5281/zenodo.5")
    assert "use --draft 5" in refused(reserved, *url)
    assert "use --draft 5" in refused(reserved, "--draft", "77", *url)
    with zipfile.ZipFile(deposit, "a") as archive:
        archive.writestr(f"{NAME}/README.md.orig", "one too many")
    assert "the deposit is damaged" in refused(deposit, *url)
    deposit.unlink()
    assert "mine-1.0.0.zip: no such file" in refused(tmp_path / NAME, *url)
    assert server.requests == []


def test_addresses():
    assert server_address("https://zenodo.org/") == "https://zenodo.org"
    assert server_address("sandbox.zenodo.org/api") == "https://sandbox.zenodo.org"
    assert server_address("http://127.0.0.1:80") == "http://127.0.0.1:80"
    assert server_address("http://[::1]:8000") == "http://[::1]:8000"
    for wrong in ("http://zenodo.org", "http://127.0.0.1.example.org", "ftp://zenodo.org", "https://zenodo.org/records/1",
                  "https://", "https://me:secret@zenodo.org", ""):  # fmt: skip
        with pytest.raises(ValueError, match="expected"):
            server_address(wrong)


VALIDATION = {
    "message": "Validation error.",
    "errors": [{"field": "metadata.creators", "message": "Missing data for required field."}],
}
ELSEWHERE = "https://elsewhere.org/"
POST, PUT, ZIP = ("POST", "depositions"), ("PUT", "depositions"), ("PUT", ".zip")


@pytest.mark.parametrize(
    "request_, action, message",
    [
        (POST, refuse(401, {"message": "Unauthorized"}), "Unauthorized"),
        (POST, refuse(403, {"message": f"no, {TOKEN}"}), "(403): "),
        (POST, refuse(302, Location=ELSEWHERE), f"redirects to {ELSEWHERE}"),
        (POST, refuse(200, {"id": 1, "links": {"bucket": ELSEWHERE}}), "another server"),
        (POST, refuse(200, [1]), "does not answer like Zenodo"),
        (POST, refuse(200, {"id": 1, "links": None}), "does not answer like Zenodo"),
        (POST, refuse(200, {"id": 1, "links": {"bucket": 3}}), "does not answer like Zenodo"),
        (POST, refuse(400, {"errors": 1}), "(400)"),
        (POST, refuse(503, {"message": "busy"}), "busy"),
        (POST, break_off, "closed the connection"),
        (PUT, refuse(200, "done"), "does not answer like Zenodo"),
        (PUT, refuse(400, VALIDATION), "Missing data for required field."),
        (ZIP, refuse(413), "(413)"),
        (ZIP, refuse(201, {"checksum": "md5:" + 32 * "0"}), "was damaged in the upload"),
    ],
)
def test_refusals_of_a_server_are_shown(server, deposit, request_, action, message):
    server.failures.append((*request_, action))
    status, output = upload(deposit, "--url", server.address, "--yes")
    assert status == 1 and message in output, output
    # Nothing that makes something is tried twice, and a draft that is left behind can be continued.
    assert [method for method, _, _ in server.requests].count("POST") == 1
    if request_[0] == "PUT":
        command = re.search(r"icha upload \S+ (--url \S+ --draft \S+)", output)[1]
        assert upload(deposit, *command.split(), "--yes")[0] == 0
        assert set(server.files) == SENT
    else:
        assert "--draft" not in output


def test_no_netrc_takes_the_place_of_the_token(server, tmp_path, monkeypatch):
    (tmp_path / "netrc").write_text("machine 127.0.0.1 login me password other\n")
    monkeypatch.setenv("NETRC", str(tmp_path / "netrc"))
    Zenodo(server.address, TOKEN).draft(77)
    assert {token for _, _, token in server.requests} == {f"Bearer {TOKEN}"}
    server.shutdown()
    server.server_close()
    with pytest.raises(ZenodoError, match="cannot be reached"):
        Zenodo(server.address, TOKEN).create()
