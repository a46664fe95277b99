"""A client for Zenodo's deposit API (https://developers.zenodo.org), and for others that speak it."""

import hashlib
import ipaddress
import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote, urlsplit

import requests
from requests.adapters import HTTPAdapter
from urllib3 import Retry

ZENODO = "https://zenodo.org"
SANDBOX = "https://sandbox.zenodo.org"
# For the connection, and for an answer: checksums of large files take the server its time, in s.
_TIMEOUT = (20, 900)
_BUSY = (429, 503)
_FAILING = (*_BUSY, 500, 502, 504)
_SCOPES = "deposit:write and deposit:actions"


class ZenodoError(Exception):
    """What the server refuses, or that it cannot be reached; the message says what to do."""


class Uploaded(NamedTuple):
    """A file of a draft; `md5` is empty if the server does not tell."""

    identifier: str
    name: str
    md5: str


class Draft(NamedTuple):
    """A record that is not published yet: its number, its page, where its files go, the DOI reserved for it."""

    number: str
    page: str
    bucket: str
    doi: str
    files: tuple[Uploaded, ...]


class Published(NamedTuple):
    """A published record."""

    page: str
    doi: str


class _Patience(Retry):
    """Tries again what failed for the moment: what changes nothing twice always, the rest only if it was put off."""

    def is_retry(self, method, status_code, has_retry_after=False):
        put_off = method == "POST" and status_code in _BUSY and bool(self.total)
        return put_off or super().is_retry(method, status_code, has_retry_after)


# Waits 0, 2, 4, 8, 16 s, or as long as the server asks for, up to five minutes.
_PATIENCE = _Patience(
    total=5, backoff_factor=1, status_forcelist=_FAILING, redirect=0, raise_on_status=False, retry_after_max=300
)


class _Bearer(requests.auth.AuthBase):
    """The token, in its header and nowhere else; given this way, no `.netrc` takes its place."""

    def __init__(self, token: str):
        self._token = token

    def __call__(self, request):
        request.headers["Authorization"] = f"Bearer {self._token}"
        return request


def server_address(address: str) -> str:
    """The address of a server without a path.

    Raises
    ------
    ValueError
        If it is none, or if what is sent could be read on the way: http is for servers on this machine.
    """
    parts = urlsplit(address if "//" in address else f"https://{address}")
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.username or parts.query or parts.fragment:
        raise ValueError(f"{address!r} is no address of a server; allowed: one such as {ZENODO}")
    if parts.path.rstrip("/") not in ("", "/api"):
        raise ValueError(f"{address!r} has a path; allowed: the server alone, such as {ZENODO}")
    if parts.scheme == "http" and not _is_loopback(parts.hostname):
        raise ValueError(f"{address!r}: over http the token could be read on the way; allowed: https")
    return f"{parts.scheme}://{parts.netloc}"


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def md5_of(path: str | os.PathLike) -> str:
    """The MD5 of a file, the checksum that Zenodo keeps."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.md5(usedforsecurity=False)).hexdigest()


class Zenodo:
    """A server and who speaks to it. Every method raises `ZenodoError` if the server refuses or is not there."""

    def __init__(self, address: str, token: str, patience: Retry | None = None):
        """Keep the address, as `server_address` takes it, and the token; nothing is sent yet."""
        self.address = server_address(address)
        self._token = token
        self._session = requests.Session()
        self._session.auth = _Bearer(token)
        for scheme in ("https://", "http://"):
            self._session.mount(scheme, HTTPAdapter(max_retries=patience or _PATIENCE))

    def create(self) -> Draft:
        """Make an empty draft."""
        return self._draft(self._call("POST", "/api/deposit/depositions", json={}))

    def draft(self, number: str) -> Draft:
        """A draft that is there already."""
        content = self._call("GET", f"/api/deposit/depositions/{quote(number, safe='')}")
        if content.get("submitted") is True or content.get("state") == "done":
            raise ZenodoError(
                f"{number} is published already; a new version of it is made with --new-version-of {number}"
            )
        return self._draft(content)

    def new_version(self, number: str) -> Draft:
        """Make a draft of a new version of a published record; it begins with the files of the one before."""
        content = self._call("POST", f"/api/deposit/depositions/{quote(number, safe='')}/actions/newversion")
        address = _text(_mapping(content, "links"), "latest_draft")
        if not address:
            raise ZenodoError(f"{self.address} does not say where the draft of the new version of {number} is")
        found = address.rstrip("/").rpartition("/")[2]
        if found == number:
            raise ZenodoError(
                f"{self.address} gives no draft of a new version of {number}; if there is one already, continue it "
                "with --draft"
            )
        return self.draft(found)

    def describe(self, draft: Draft, metadata: Mapping) -> None:
        """Set the metadata of a draft, as https://developers.zenodo.org/#representation lists them."""
        self._call("PUT", f"/api/deposit/depositions/{draft.number}", json={"metadata": dict(metadata)})

    def upload(self, draft: Draft, path: str | os.PathLike, md5: str) -> bool:
        """Send a file, in pieces as it is read; `md5` is its checksum.

        Returns
        -------
        Whether the server has confirmed the checksum; False if it tells none.
        """
        name = Path(path).name
        with open(path, "rb") as file:
            answer = self._call("PUT", f"{draft.bucket}/{quote(name)}", data=file)
        received = _plain_md5(answer)
        if received and received != md5:
            raise ZenodoError(f"{name} has not arrived as it was sent: its MD5 is {md5}, that of the server {received}")
        return bool(received)

    def remove(self, draft: Draft, file: Uploaded) -> None:
        """Remove a file of a draft; that it is not there (any more) is as good."""
        path = f"/api/deposit/depositions/{draft.number}/files/{quote(file.identifier, safe='')}"
        try:
            self._call("DELETE", path, also=(404, 410))
        except ZenodoError:
            # Zenodo has been seen to remove files, and to say that it failed (zenodo/zenodo#2561).
            if any(each.name == file.name for each in self.draft(draft.number).files):
                raise

    def publish(self, draft: Draft) -> Published:
        """Publish a draft, for good."""
        content = self._call("POST", f"/api/deposit/depositions/{draft.number}/actions/publish")
        links = _mapping(content, "links")
        page = _text(links, "record_html") or _text(links, "html") or f"{self.address}/records/{draft.number}"
        return Published(page, _text(content, "doi") or draft.doi)

    def _draft(self, content: Mapping) -> Draft:
        links, metadata = _mapping(content, "links"), _mapping(content, "metadata")
        number, bucket = _text(content, "id"), _text(links, "bucket")
        if not number or not bucket:
            raise ZenodoError(f"{self.address} does not answer as Zenodo does: a draft without number or bucket")
        if not bucket.startswith(f"{self.address}/"):
            # The token goes to nobody else.
            raise ZenodoError(f"{self.address} wants the files to be sent to another server: {bucket}")
        files = tuple(
            Uploaded(_text(file, "id"), _text(file, "filename") or _text(file, "key"), _plain_md5(file))
            for file in _list(content, "files")
            if isinstance(file, dict)
        )
        doi = _text(_mapping(metadata, "prereserve_doi"), "doi") or _text(metadata, "doi")
        page = _text(links, "html") or f"{self.address}/uploads/{number}"
        return Draft(number, page, bucket.removeprefix(self.address).rstrip("/"), doi, files)

    def _call(self, method: str, path: str, also: tuple[int, ...] = (), **content) -> dict:
        """Send a request; return its JSON, or {} where there is none."""
        try:
            answer = self._session.request(
                method, f"{self.address}{path}", timeout=_TIMEOUT, allow_redirects=False, **content
            )
        except requests.RequestException as error:
            raise ZenodoError(self._unreachable(error)) from None
        if answer.ok and not answer.is_redirect:
            try:
                said = answer.json() if answer.content else {}
            except (ValueError, RecursionError):
                raise ZenodoError(f"{self.address} does not answer as Zenodo does: no JSON from {path}") from None
            if not isinstance(said, dict):
                raise ZenodoError(f"{self.address} does not answer as Zenodo does: no mapping from {path}")
            return said
        if answer.status_code in also:
            return {}
        raise ZenodoError(self._refusal(method, path, answer))

    def _unreachable(self, error) -> str:
        reason = error.args[0] if error.args else error
        cause = getattr(reason, "reason", reason)
        if isinstance(error, requests.exceptions.SSLError):
            return f"{self.address}: no secure connection: {self._plain(cause)}"
        if isinstance(error, requests.Timeout):
            return f"{self.address} does not answer"
        return f"{self.address} cannot be reached, or has broken off the connection: {self._plain(cause)}"

    def _refusal(self, method, path, answer) -> str:
        status, said = answer.status_code, self._said(answer)
        if status == 401:
            return (
                f"{self.address} does not know the token (401{said}); make one at "
                f"{self.address}/account/settings/applications/tokens/new/ with the scopes {_SCOPES}. The sandbox has "
                "tokens of its own"
            )
        if status == 403:
            return (
                f"{self.address} does not allow it (403{said}); needed: a token with the scopes {_SCOPES}, and a draft "
                "or record of your own"
            )
        if status in (404, 410):
            return f"{self.address} has no {path.removeprefix('/api/')} ({status}{said}); is its number right?"
        if status == 413:
            return f"{self.address}: the file is too large (413{said}); Zenodo takes 50 GB a record"
        if answer.is_redirect:
            return f"{self.address} sends us on to {self._plain(answer.headers.get('Location'))}; give that server"
        if status in _BUSY:
            return f"{self.address} is busy ({status}{said}); try again in a while"
        if status >= 500:
            return f"{self.address} has failed ({status}{said}); try again in a while"
        if path.endswith("/newversion"):
            said += "; if there is a draft of a new version already, continue it with --draft"
        return f"{self.address} refuses it ({status}{said})"

    def _said(self, answer) -> str:
        """What the server says of it: its message, and what is wrong with which field."""
        try:
            content = answer.json()
        except (ValueError, RecursionError):
            return f": {self._plain(answer.reason)}" if answer.reason else ""
        if not isinstance(content, dict):
            return ""
        lines = [self._plain(content.get("message", ""))]
        for error in _list(content, "errors"):
            if isinstance(error, dict):
                told = error.get("message") or ", ".join(map(str, _list(error, "messages")))
                lines.append(f"{error.get('field', '')}: {told}")
            else:
                lines.append(str(error))
        text = "\n    ".join(self._plain(line) for line in lines if line)
        return f": {text}" if text else ""

    def _plain(self, text) -> str:
        """Text of the server's, short and without the token, should it send that back."""
        text = " ".join(str(text if text is not None else "").split()).replace(self._token, "…")
        return text if len(text) <= 300 else f"{text[:299]}…"


def _mapping(content: Mapping, key: str) -> Mapping:
    """A mapping in an answer; empty if there is none."""
    value = content.get(key)
    return value if isinstance(value, dict) else {}


def _list(content: Mapping, key: str) -> list:
    """A list in an answer; empty if there is none."""
    value = content.get(key)
    return value if isinstance(value, list) else []


def _text(content: Mapping, key: str) -> str:
    """A text or number in an answer, as text; empty if there is none."""
    value = content.get(key)
    return str(value) if isinstance(value, str | int) else ""


def _plain_md5(content: Mapping) -> str:
    """The checksum that the server tells of a file, in either of the forms that it has for it."""
    text = str(content.get("checksum") or "")
    kind, _, digits = text.rpartition(":")
    return digits.lower() if kind in ("", "md5") else ""
