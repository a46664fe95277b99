"""Upload deposits to Zenodo, or to another server with the same API (https://developers.zenodo.org)."""

import contextlib
import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote, urlsplit

import requests
from requests.adapters import HTTPAdapter
from urllib3 import Retry

ZENODO = "https://zenodo.org"
# Longest times in s to wait: for the connection, then for an answer. The answer to a large upload takes long.
_TIMEOUT = (20, 900)
# HTTP statuses of a server that is busy or has failed.
_FAILING = (429, 500, 502, 503, 504)
# Largest number of characters of a text from the server in a message.
_LONGEST = 300
_SCOPES = "deposit:write and deposit:actions"
# Advice to users by HTTP status; the address of the server replaces the braces.
_ADVICE = {
    401: f"make a token at {{}}/account/settings/applications/tokens/new/ with the scopes {_SCOPES}; the sandbox has "
    "its own tokens",
    403: f"use a token with the scopes {_SCOPES}, and a draft or record that belongs to you",
    404: "check the number of the draft or record",
    413: "the file is too large; Zenodo accepts 50 GB per record",
}


class ZenodoError(Exception):
    """The server refuses a request or cannot be reached; the message gives reason and advice."""


class Draft(NamedTuple):
    """A draft: a record on Zenodo that is not published yet.

    Attributes
    ----------
    number : number of the draft.
    page : web address of the draft.
    bucket : path on the server to which files are sent.
    doi : DOI that is reserved for the draft.
    files : identifier and MD5 of each file, by name; the MD5 is "" if the server does not report it.
    """

    number: str
    page: str
    bucket: str
    doi: str
    files: dict[str, tuple[str, str]]


# Failed requests that can be repeated are sent again after 0, 2, 4, 8 and 16 s. If the server states another time (at
# most 300 s), requests are sent again after this time.
_PATIENCE = Retry(
    total=5, backoff_factor=1, status_forcelist=_FAILING, redirect=0, raise_on_status=False, retry_after_max=300
)


def server_address(address: str) -> str:
    """Return the address of a server without a path.

    Raises
    ------
    ValueError
        If `address` is not the address of a server; or if it begins with http, because others could then read the
        token. A server on this machine may have an address with http.
    """
    parts = urlsplit(address if "//" in address else f"https://{address}")
    plain = not (parts.username or parts.query or parts.fragment) and parts.path.rstrip("/") in ("", "/api")
    if parts.scheme not in ("http", "https") or not parts.hostname or not plain:
        raise ValueError(f"{address!r} is not the address of a server; expected an address such as {ZENODO}")
    if parts.scheme == "http" and parts.hostname not in ("localhost", "127.0.0.1", "::1"):
        raise ValueError(f"{address!r}: with http, others could read the token; expected https")
    return f"{parts.scheme}://{parts.netloc}"


def md5_of(path: str | os.PathLike) -> str:
    """Return the MD5 of a file, the checksum that Zenodo uses."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.md5(usedforsecurity=False)).hexdigest()


class Zenodo:
    """A client of a Zenodo server. Every method raises `ZenodoError` if the server refuses a request or fails."""

    def __init__(self, address: str, token: str, patience: Retry | None = None):
        """Store the address of the server (see `server_address`) and the token; no request is sent."""
        self.address = server_address(address)
        self._token = token
        self._session = requests.Session()
        self._session.auth = self._authorize
        for scheme in ("https://", "http://"):
            self._session.mount(scheme, HTTPAdapter(max_retries=patience or _PATIENCE))

    def _authorize(self, request: requests.PreparedRequest) -> requests.PreparedRequest:
        """Add the token to a request. The session calls this function, so that the token has priority over `.netrc`."""
        request.headers["Authorization"] = f"Bearer {self._token}"
        return request

    def create(self) -> Draft:
        """Make an empty draft on the server and return it."""
        return self._draft(self._call("POST", "/api/deposit/depositions", json={}))

    def draft(self, number: str) -> Draft:
        """Return the existing draft with this number."""
        content = self._call("GET", f"/api/deposit/depositions/{quote(number, safe='')}")
        if content.get("submitted") is True or content.get("state") == "done":
            raise ZenodoError(
                f"record {number} is already published. Make a draft of a new version on the page of the record, and "
                "upload with --draft"
            )
        return self._draft(content)

    def describe(self, draft: Draft, metadata: Mapping) -> None:
        """Set the metadata of a draft; https://developers.zenodo.org/#representation describes the keys."""
        self._call("PUT", f"/api/deposit/depositions/{draft.number}", json={"metadata": dict(metadata)})

    def upload(self, draft: Draft, path: str | os.PathLike, md5: str) -> bool:
        """Send a file to a draft; return True if the server has confirmed the checksum `md5` of the file."""
        name = Path(path).name
        with open(path, "rb") as file:
            received = _md5(self._call("PUT", f"/{draft.bucket}/{quote(name)}", data=file))
        if received and received != md5:
            raise ZenodoError(
                f"{name} was damaged in the upload: the MD5 is {md5} here and {received} on the server. Upload it again"
            )
        return bool(received)

    def remove(self, draft: Draft, name: str) -> None:
        """Remove a file from a draft on the server."""
        identifier, _ = draft.files[name]
        self._call("DELETE", f"/api/deposit/depositions/{draft.number}/files/{quote(identifier, safe='')}")

    def _draft(self, content: dict) -> Draft:
        try:
            links, metadata, number = content["links"], content.get("metadata", {}), str(content["id"])
            draft = Draft(
                number,
                page=links.get("html", f"{self.address}/uploads/{number}"),
                bucket=links["bucket"].removeprefix(f"{self.address}/"),
                doi=metadata.get("prereserve_doi", metadata).get("doi", ""),
                files={file["filename"]: (file["id"], _md5(file)) for file in content.get("files", [])},
            )
        except (KeyError, TypeError, AttributeError):
            raise ZenodoError(f"{self.address} does not answer like Zenodo: the draft is incomplete") from None
        if draft.bucket == links["bucket"]:
            # The token must not reach another server.
            raise ZenodoError(f"{self.address} asks to send the files to another server: {self._plain(draft.bucket)}")
        return draft

    def _call(self, method: str, path: str, **content) -> dict:
        """Send a request; return the JSON of the answer, or {} if the answer is empty."""
        try:
            answer = self._session.request(
                method, f"{self.address}{path}", timeout=_TIMEOUT, allow_redirects=False, **content
            )
        except requests.RequestException as error:
            raise ZenodoError(
                f"{self.address} cannot be reached, or has closed the connection: {self._plain(error)}"
            ) from None
        if answer.is_redirect:
            raise ZenodoError(
                f"{self.address} redirects to {self._plain(answer.headers['Location'])}. Use that address"
            )
        if not answer.ok:
            raise ZenodoError(self._refusal(path, answer))
        with contextlib.suppress(ValueError, RecursionError):
            if isinstance(found := answer.json() if answer.content else {}, dict):
                return found
        raise ZenodoError(f"{self.address} does not answer like Zenodo: the answer to {path} is not a JSON object")

    def _refusal(self, path: str, answer: requests.Response) -> str:
        """Describe why the server refused a request, with the message of the server and advice."""
        advice = _ADVICE.get(answer.status_code, "").format(self.address)
        if answer.status_code in _FAILING:
            advice = "it is busy or has failed; try again in a while"
        reason = self._plain(answer.text or answer.reason)
        return f"{self.address} refuses {path} ({answer.status_code}): {'; '.join(filter(None, (reason, advice)))}"

    def _plain(self, text: object) -> str:
        """Return text from the server, shortened, and without the token."""
        plain = " ".join(str(text).split()).replace(self._token, "…")
        return plain if len(plain) <= _LONGEST else f"{plain[: _LONGEST - 1]}…"


def _md5(content: dict) -> str:
    """Return the checksum that the server reports for a file, with or without the prefix `md5:`."""
    return str(content.get("checksum", "")).removeprefix("md5:").lower()
