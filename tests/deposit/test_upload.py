"""`icha upload` against servers on this machine: requests, confirmation, and failures of servers."""

import hashlib
import json
import re
import zipfile
from types import SimpleNamespace

import pytest
import requests
from typer.testing import CliRunner
from zenodo_mock.testing import spawn

from icha.cli import app, deposits
from icha.deposit.upload import server_address

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


@pytest.fixture
def deposit(pack):
    """The zip of a deposit, beside its folder, with just what an upload looks at."""
    return pack(FILES | {".zenodo.json": json.dumps(METADATA)}, NAME).with_name(f"{NAME}.zip")


def upload(*arguments, token=TOKEN):
    """The exit status and all that was printed; the token is never among it."""
    done = CliRunner().invoke(app, ["upload", *map(str, arguments)], env={"ZENODO_TOKEN": token})
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    assert not token or token not in done.output
    return done.exit_code, done.output


def answer(status, content=None, **headers):
    """An answer of a server."""
    made = requests.Response()
    made.status_code, made._content = status, json.dumps(content).encode()
    made.headers.update(headers)
    return made


class Server:
    """Stands in for `requests.request`: answers as Zenodo does, records requests, and fails once on demand.

    `failure` is the method and a part of the path of the request that fails, and its answer or its error.
    """

    address = "https://zenodo.test"

    def __init__(self):
        self.requests, self.failure, self.files, self.metadata, self.published = [], None, {}, {}, False

    def __call__(self, method, url, *, auth, timeout, allow_redirects, json=None, data=None):
        token = auth(requests.Request(method, url).prepare()).headers["Authorization"]
        self.requests.append((method, url, token))
        assert url.startswith(self.address) and timeout and not allow_redirects
        if self.failure and self.failure[0] == method and self.failure[1] in url:
            (_, _, failure), self.failure = self.failure, None
            if isinstance(failure, Exception):
                raise failure
            return failure
        if "/files/" in url:
            content = self.files[url.rpartition("/")[2]] = data.read()
            return answer(201, {"checksum": f"md5:{hashlib.md5(content).hexdigest()}"})
        if method == "PUT":
            self.metadata = json["metadata"]
        links = {"bucket": f"{self.address}/api/files/b-77"}
        return answer(200, {"id": 77, "submitted": self.published, "links": links})


@pytest.fixture
def server(monkeypatch):
    each = Server()
    monkeypatch.setattr(requests, "request", each)
    return each


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


def test_what_cannot_be_sent_is_refused_before_anything_is_asked(server, deposit, pack, tmp_path):
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
    metadata = METADATA | {"doi": "10.5281/zenodo.5"}
    reserved = pack(FILES | {".zenodo.json": json.dumps(metadata)}, "reserved").with_name("reserved.zip")
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
    "request_, failure, message",
    [
        (POST, answer(401, {"message": "Unauthorized"}), "Unauthorized"),
        (POST, answer(403, {"message": f"no, {TOKEN}"}), "(403): "),
        (POST, answer(302, Location=ELSEWHERE), f"redirects to {ELSEWHERE}"),
        (POST, answer(200, {"id": 1, "links": {"bucket": ELSEWHERE}}), "another server"),
        (POST, answer(200, {"id": 1, "links": None}), "does not answer like Zenodo"),
        (POST, answer(200, [1]), "does not answer like Zenodo"),
        (POST, requests.ConnectionError(f"reset {TOKEN}"), "cannot be reached, or has closed the connection"),
        (PUT, answer(400, VALIDATION), "Missing data for required field."),
        (ZIP, answer(201, {"checksum": "md5:" + 32 * "0"}), "was damaged in the upload"),
    ],
)
def test_refusals_of_a_server_are_shown(server, deposit, request_, failure, message):
    server.failure = *request_, failure
    status, output = upload(deposit, "--url", server.address, "--yes")
    assert status == 1 and message in output, output
    # A draft that is left behind can be continued.
    if request_[0] == "PUT":
        command = re.search(r"icha upload \S+ (--url \S+ --draft \S+)", output)[1]
        assert upload(deposit, *command.split(), "--yes")[0] == 0
        assert set(server.files) == SENT
    else:
        assert "--draft" not in output and len(server.requests) == 1
