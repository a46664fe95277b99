"""Send deposits as drafts to Zenodo, or to another server with the same API (https://developers.zenodo.org)."""

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote, urlsplit

import requests

ZENODO = "https://zenodo.org"
# Longest times in s to wait: for the connection, then for an answer. The answer to a large upload takes long.
_TIMEOUT = (20, 900)
# Largest number of characters of a text from the server in a message.
_LONGEST = 300


class ZenodoError(Exception):
    """The server refuses a request or cannot be reached; the message gives the reason."""


def server_address(address: str) -> str:
    """Return the address of a server without a path; raise ValueError for other texts.

    With http, others could read the token. So only a server on this machine may have an address with http.
    """
    parts = urlsplit(address if "//" in address else f"https://{address}")
    plain = not (parts.username or parts.query or parts.fragment) and parts.path.rstrip("/") in ("", "/api")
    if parts.scheme not in ("http", "https") or not parts.hostname or not plain:
        raise ValueError(f"{address!r} is not the address of a server; expected an address such as {ZENODO}")
    if parts.scheme == "http" and parts.hostname not in ("localhost", "127.0.0.1", "::1"):
        raise ValueError(f"{address!r}: with http, others could read the token; expected https")
    return f"{parts.scheme}://{parts.netloc}"


class Draft:
    """A draft on a Zenodo server: a record that is not published yet.

    Every method raises `ZenodoError` if the server refuses a request or fails.

    Attributes
    ----------
    number, page : number and web address of the draft.
    """

    def __init__(self, address: str, token: str, number: int | None = None):
        """Make an empty draft, or find the draft with a number, on the server at `address` (see `server_address`)."""
        self.address, self._token, path = address, token, "/api/deposit/depositions"
        content = self._call("GET", f"{path}/{number}") if number else self._call("POST", path, json={})
        if content.get("submitted") is True:
            raise ZenodoError(
                f"record {number} is already published. Make a draft of a new version on the page of the record, and "
                "upload with --draft"
            )
        try:
            self.number, bucket = int(content["id"]), urlsplit(content["links"]["bucket"])
        except (KeyError, TypeError, AttributeError, ValueError):
            raise ZenodoError(f"{address} does not answer like Zenodo: the draft is incomplete") from None
        if f"{bucket.scheme}://{bucket.netloc}" != address:
            # The token must not reach another server.
            raise ZenodoError(f"{address} asks to send files to another server: {self._plain(bucket.geturl())}")
        self.page, self._bucket, self._path = f"{address}/uploads/{self.number}", bucket.path, f"{path}/{self.number}"

    def describe(self, metadata: Mapping) -> None:
        """Set the metadata of the draft; https://developers.zenodo.org/#representation describes the keys."""
        self._call("PUT", self._path, json={"metadata": dict(metadata)})

    def upload(self, path: str | os.PathLike) -> bool:
        """Send a file to the draft, where it replaces a file with the same name.

        Return whether the server sent an MD5 of the file; raise `ZenodoError` if this MD5 is wrong.
        """
        with open(path, "rb") as file:
            md5 = hashlib.file_digest(file, lambda: hashlib.md5(usedforsecurity=False)).hexdigest()
            file.seek(0)
            content = self._call("PUT", f"{self._bucket}/{quote(Path(path).name)}", data=file)
        received = str(content.get("checksum", "")).removeprefix("md5:").lower()
        if received and received != md5:
            raise ZenodoError(
                f"{Path(path).name} was damaged in the upload: the MD5 is {md5} here, {self._plain(received)} on the "
                "server. Upload it again"
            )
        return bool(received)

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
