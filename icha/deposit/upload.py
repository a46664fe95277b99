"""Send deposits as drafts to Zenodo, or to another server with the same API (https://developers.zenodo.org)."""

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote, urlsplit

import requests

ZENODO = "https://zenodo.org"
# Longest times in s to wait: for the connection, then for an answer. The answer to a large upload takes long.
_TIMEOUT = (20, 900)
# Largest number of characters of a text from the server in a message.
_LONGEST = 300


class ZenodoError(Exception):
    """The server refuses a request or cannot be reached; the message gives the reason."""


class Draft(NamedTuple):
    """A draft: a record on Zenodo that is not published yet.

    Attributes
    ----------
    number : number of the draft.
    page : web address of the draft.
    bucket : path on the server to which files are sent.
    """

    number: str
    page: str
    bucket: str


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


class Zenodo:
    """A client of a Zenodo server. Every method raises `ZenodoError` if the server refuses a request or fails."""

    def __init__(self, address: str, token: str):
        """Store the address of the server (see `server_address`) and the token; no request is sent."""
        self.address = server_address(address)
        self._token = token

    def create(self) -> Draft:
        """Make an empty draft on the server and return it."""
        return self._draft(self._call("POST", "/api/deposit/depositions", json={}))

    def draft(self, number: int) -> Draft:
        """Return the existing draft with this number."""
        content = self._call("GET", f"/api/deposit/depositions/{number}")
        if content.get("submitted") is True:
            raise ZenodoError(
                f"record {number} is already published. Make a draft of a new version on the page of the record, and "
                "upload with --draft"
            )
        return self._draft(content)

    def describe(self, draft: Draft, metadata: Mapping) -> None:
        """Set the metadata of a draft; https://developers.zenodo.org/#representation describes the keys."""
        self._call("PUT", f"/api/deposit/depositions/{quote(draft.number)}", json={"metadata": dict(metadata)})

    def upload(self, draft: Draft, path: str | os.PathLike) -> bool:
        """Send a file to a draft, where it replaces a file with the same name; return whether the server sent its MD5.

        Raise `ZenodoError` if the MD5 differs from that of the file.
        """
        with open(path, "rb") as file:
            md5 = hashlib.file_digest(file, lambda: hashlib.md5(usedforsecurity=False)).hexdigest()
            file.seek(0)
            content = self._call("PUT", f"{draft.bucket}/{quote(Path(path).name)}", data=file)
        received = str(content.get("checksum", "")).removeprefix("md5:").lower()
        if received and received != md5:
            raise ZenodoError(
                f"{Path(path).name} was damaged in the upload: the MD5 is {md5} here, {self._plain(received)} on the "
                "server. Upload it again"
            )
        return bool(received)

    def _draft(self, content: dict) -> Draft:
        try:
            number, bucket = str(content["id"]), urlsplit(content["links"]["bucket"])
            draft = Draft(number, f"{self.address}/uploads/{quote(number)}", bucket.path)
        except (KeyError, TypeError, AttributeError, ValueError):
            raise ZenodoError(f"{self.address} does not answer like Zenodo: the draft is incomplete") from None
        if f"{bucket.scheme}://{bucket.netloc}" != self.address:
            # The token must not reach another server.
            raise ZenodoError(f"{self.address} asks to send files to another server: {self._plain(bucket.geturl())}")
        return draft

    def _authorize(self, request: requests.PreparedRequest) -> requests.PreparedRequest:
        """Add the token to a request. Because this is a function, the token has priority over a file `.netrc`."""
        request.headers["Authorization"] = f"Bearer {self._token}"
        return request

    def _call(self, method: str, path: str, **content) -> dict:
        """Send a request and return the JSON object of the answer."""
        try:
            answer = requests.request(
                method,
                f"{self.address}{path}",
                auth=self._authorize,
                timeout=_TIMEOUT,
                allow_redirects=False,
                **content,
            )
        except requests.RequestException as error:
            raise ZenodoError(
                f"{self.address} cannot be reached, or has closed the connection: {self._plain(error)}"
            ) from None
        if answer.is_redirect:
            target = self._plain(answer.headers["Location"])
            raise ZenodoError(f"{self.address} redirects to {target}. Use that address")
        if not answer.ok:
            reason = self._plain(answer.text or answer.reason)
            raise ZenodoError(f"{self.address} refuses {path} ({answer.status_code}): {reason}")
        try:
            found = answer.json()
        except (ValueError, RecursionError):
            found = None
        if not isinstance(found, dict):
            raise ZenodoError(f"{self.address} does not answer like Zenodo: the answer to {path} is not a JSON object")
        return found

    def _plain(self, text: object) -> str:
        """Return text from the server, shortened, and without the token."""
        plain = " ".join(str(text).split()).replace(self._token, "…")
        return plain if len(plain) <= _LONGEST else f"{plain[: _LONGEST - 1]}…"
