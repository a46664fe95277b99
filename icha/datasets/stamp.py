"""Stamp of a computed file: global attributes that state the settings and the program of which the file is the result.

A file is valid if its stamp is the expected one. Nothing else decides it: neither times nor records of other programs.
The stamps that a campaign expects are in `icha.planning.results.expected_stamps`.
"""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping

from icha.contact.models import MODELS
from icha.support.atomic_files import whole_file
from icha.support.fingerprint import fingerprint
from icha.support.input_files import text

# Attributes of a stamp. `config_sha256` is the checksum of the settings and of files of the user; `program_sha256` is
# the fingerprint of the modules that compute the file; `id` contains the names of campaign, study and run.
NAMES = ("id", "license", "config_sha256", "program_sha256")
Stamp = Mapping[str, str]

# Reasons why a file is outdated.
DAMAGED = "it cannot be read"
OTHER_SETTINGS = "it was computed with other settings"
OTHER_PROGRAM = "it was computed by another version of the program"
# Not a reason to compute a file again; `state_licence` is enough.
OTHER_LICENCE = "it states another licence"

# Largest number of files in a message.
_MOST_NAMES = 20
_SURFACE, _RUN, _THEORIES = "icha.tasks.surface", "icha.tasks.run", "icha.tasks.theories"


def program_of_surfaces() -> str:
    """Return the fingerprint of the program that makes surfaces."""
    return fingerprint(_SURFACE)


def program_of_runs(model: str) -> str:
    """Return the fingerprint of the program that computes runs with a model, and the surfaces of these runs."""
    return fingerprint(_SURFACE, _RUN, MODELS[model].module)


def program_of_theories() -> str:
    """Return the fingerprint of the program that computes the theories of a surface, and the surface."""
    return fingerprint(_SURFACE, _THEORIES)


def read_stamp(file: str | os.PathLike, further: Iterable[str] = ()) -> dict[str, str] | None:
    """Return the stamp of a file, or None if the file cannot be read, for example because it is cut off.

    `further` are names of other global attributes to read.

    Raises
    ------
    OSError
        If the file does not exist, or this process may not read it.
    """
    import h5py  # imported here because the import is slow

    try:
        # The low-level interface takes a fifth of the time of the usual interface.
        data = h5py.h5f.open(os.fsencode(file), h5py.h5f.ACC_RDONLY)
        try:
            return {
                name: _read(data, name.encode()) for name in (*NAMES, *further) if h5py.h5a.exists(data, name.encode())
            }
        finally:
            data.close()
    except OSError as error:
        if error.errno is not None:  # the file cannot be opened, for example without permission
            raise
        return None  # not a complete HDF5 file
    except (RuntimeError, ValueError):
        return None


def _read(data, name: bytes) -> str:
    from h5py import h5a
    from numpy import empty

    attribute = h5a.open(data, name)
    value = empty(attribute.shape, attribute.dtype)
    attribute.read(value)
    return text(value.item())


def why_outdated(file: str | os.PathLike, stamp: Stamp) -> str:
    """Return why an existing file is not the result that `stamp` describes; "" if it is."""
    return difference(read_stamp(file), stamp)


def difference(found: Stamp | None, stamp: Stamp) -> str:
    """Return why a file with the stamp `found` is not the result that `stamp` describes; "" if it is."""
    if found is None:
        return DAMAGED
    differing = [name for name in NAMES if found.get(name) != stamp[name]]
    other = {(): "", ("program_sha256",): OTHER_PROGRAM, ("license",): OTHER_LICENCE}
    return other.get(tuple(differing), OTHER_SETTINGS)


def outdated(expected: Mapping[str, Stamp]) -> Iterator[tuple[str, str]]:
    """Yield path and reason of each existing file with another stamp than expected; `expected` has stamps by path."""
    for path, stamp in expected.items():
        if os.path.exists(path) and (reason := why_outdated(path, stamp)):
            yield path, reason


def state_licence(file: str | os.PathLike, licence: str) -> None:
    """Replace the licence that a file states; the values of the file stay."""
    import netCDF4  # imported here because the import is slow

    with whole_file(file) as temporary:
        shutil.copyfile(file, temporary)
        with netCDF4.Dataset(temporary, "a") as data:
            data.license = licence


def refuse_outdated(expected: Mapping[str, Stamp]) -> None:
    """Raise ValueError if an existing file does not have the expected stamp; `expected` has stamps by path."""
    wrong = [f"  {path}: {reason}" for path, reason in outdated(expected)]
    if wrong:
        more = [f"  and {len(wrong) - _MOST_NAMES} more"] if len(wrong) > _MOST_NAMES else []
        listed = "\n".join([*wrong[:_MOST_NAMES], *more])
        raise ValueError(
            f"these files are not results of the present settings and program. Repeat the command, which computes the "
            f"files again:\n{listed}"
        )
