"""HDF5 files, which netCDF-4 files are: attributes, and data that lie elsewhere."""

import os
from collections.abc import Iterable


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
    import h5py

    if not h5py.is_hdf5(path):
        return
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


def _lies_elsewhere(properties):
    import h5py

    return properties.get_layout() == h5py.h5d.VIRTUAL or (
        properties.get_layout() == h5py.h5d.CONTIGUOUS and properties.get_external_count() > 0
    )


def _shown(name):
    return repr(name.decode("utf-8", "replace"))
