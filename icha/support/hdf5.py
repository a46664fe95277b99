"""HDF5 files, which netCDF-4 files are: attributes, and data that lie elsewhere."""

import os
from collections.abc import Iterable

# https://support.hdfgroup.org/documentation/hdf5/latest/_f_m_t3.html, section II.A.
_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def text(attribute: bytes | str | Iterable[bytes | str]) -> str:
    """A text, however the library that wrote it keeps texts; that of netCDF puts those beyond ASCII into arrays."""
    if not isinstance(attribute, bytes | str):
        (attribute,) = attribute
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)


def refuse_data_elsewhere(path: str | os.PathLike) -> None:
    """Refuse a file whose names or data lie in other files, which could be any of this machine.

    Soft links stay: they end in the same file. What is no HDF5 file passes.

    Raises
    ------
    ValueError
        Naming the link or dataset.
    OSError
        If the file is damaged.
    """
    if not _is_hdf5(path):
        return
    # Not for every text.
    import h5py

    with h5py.File(path, "r") as file:

        def elsewhere(name, link):
            """What ends the visit, and is given by it."""
            if link.type == h5py.h5l.TYPE_EXTERNAL:
                return f"{_shown(name)} is a link to another file"
            if link.type == h5py.h5l.TYPE_HARD:
                node = h5py.h5o.open(file.id, name)
                if isinstance(node, h5py.h5d.DatasetID) and _lies_elsewhere(node.get_create_plist()):
                    return f"{_shown(name)} has its data elsewhere"
            return None

        if found := file.id.links.visit(elsewhere, info=True):
            raise ValueError(f"{found}; allowed: files that hold all of their data")


def _is_hdf5(path):
    """Whether the signature is at the beginning, or after a block of the user's own of 512, 1024, 2048, … bytes."""
    with open(path, "rb") as file:
        size, place = os.fstat(file.fileno()).st_size, 0
        while place < size:
            file.seek(place)
            if file.read(len(_SIGNATURE)) == _SIGNATURE:
                return True
            place = max(512, 2 * place)
    return False


def _lies_elsewhere(properties):
    import h5py

    return properties.get_layout() == h5py.h5d.VIRTUAL or (
        properties.get_layout() == h5py.h5d.CONTIGUOUS and properties.get_external_count() > 0
    )


def _shown(name):
    return repr(name.decode("utf-8", "replace"))
