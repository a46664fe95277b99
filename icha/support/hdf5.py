"""HDF5 files, which netCDF-4 files are: attributes, and data that lie elsewhere."""

import os
from collections.abc import Iterable

# https://support.hdfgroup.org/documentation/hdf5/latest/_f_m_t3.html, section II.A.
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Names in a file, and groups in one another: to go through more takes minutes.
_MOST_NAMES, _DEEPEST = 100_000, 50
_WHOLE = "allowed: files that hold all of their data"


def text(attribute: bytes | str | Iterable[bytes | str]) -> str:
    """A text, however the library that wrote it keeps texts; that of netCDF puts those beyond ASCII into arrays."""
    if not isinstance(attribute, bytes | str):
        (attribute,) = attribute
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)


def refuse_traps(path: str | os.PathLike) -> None:
    """Refuse a file whose names lead elsewhere or in circles, or are too many; what is no HDF5 file passes.

    Names and data that lie in other files could be any of this machine. Groups that are reached in two ways may lie in
    one another: the library of netCDF is torn apart by them. Links to data of the same file stay.

    Raises
    ------
    ValueError
        Naming the link, group or dataset.
    OSError
        If the file is damaged.
    """
    if not is_hdf5(path):
        return
    # Not for every text.
    import h5py

    with h5py.File(path, "r") as file:
        groups, count = {h5py.h5o.get_info(file.id).addr}, 0

        def trap(name, link):
            """What ends the visit, and is given by it."""
            nonlocal count
            count += 1
            if count > _MOST_NAMES or name.count(b"/") >= _DEEPEST:
                return f"it has more than {_MOST_NAMES:,} names, or {_DEEPEST} groups in one another; allowed: fewer"
            if link.type == h5py.h5l.TYPE_EXTERNAL:
                return f"{_shown(name)} is a link to another file; {_WHOLE}"
            try:
                node = h5py.h5o.open(file.id, name)
            except (KeyError, RuntimeError, SystemError):  # a link to nothing, or to itself
                return None
            if isinstance(node, h5py.h5d.DatasetID) and _lies_elsewhere(node.get_create_plist()):
                return f"{_shown(name)} has its data elsewhere; {_WHOLE}"
            if isinstance(node, h5py.h5g.GroupID):
                if (address := h5py.h5o.get_info(node).addr) in groups:
                    return f"{_shown(name)} is a group that has another name, too; allowed: one name for each"
                groups.add(address)
            return None

        if found := file.id.links.visit(trap, info=True):
            raise ValueError(found)


def is_hdf5(path):
    """Tell whether a file is HDF5.

    Its signature is at the beginning, or after a block of the user's own of 512, 1024, 2048, … bytes.
    """
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
