"""The validators of others, in their own environment: `make validators-environment`.

Tests that need them are skipped without it, and fail with `ICHA_REQUIRE_VALIDATORS=1`.
"""

import hashlib
import os
import subprocess
from pathlib import Path

import pytest

from icha.deposit.verify import DamagedDeposit, whole_deposit

REPOSITORY = Path(__file__).parents[1]
PYTHON = REPOSITORY / ".venv-validators/bin/python"


def lock(**versions):
    """A lock file with ICHA and with packages of these versions."""
    package = '[[package]]\nname = "{}"\nversion = "{}"\nsource = {{ registry = "https://pypi.org/simple" }}\n'
    own = 'version = 1\n[[package]]\nname = "icha"\nsource = { editable = "." }\n'
    return own + "".join(package.format(*each) for each in versions.items())


def sealed(folder):
    """A folder with the checksums of all its files, as a deposit has them."""
    sums = folder / "SHA256SUMS"
    sums.unlink(missing_ok=True)
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    digests = {file.relative_to(folder).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
    sums.write_text("".join(f"{digest}  {name}\n" for name, digest in digests.items()))
    return folder


def problems_with(deposit):
    """The problems of a deposit; none if it is whole."""
    try:
        with whole_deposit(deposit):
            return []
    except DamagedDeposit as damaged:
        return list(damaged.args)


def validated(deposit, *names):
    """Put a deposit to the validators of these names, or to all; return the finished process."""
    if not PYTHON.exists():
        reason = "the validators are not installed: make validators-environment"
        (pytest.fail if os.environ.get("ICHA_REQUIRE_VALIDATORS") == "1" else pytest.skip)(reason)
    return subprocess.run(
        [PYTHON, REPOSITORY / "tests/validators/validate.py", deposit, *names],
        capture_output=True,
        text=True,
        timeout=600,
    )
