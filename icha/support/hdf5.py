"""Attributes of HDF5 files, which netCDF-4 files are."""

from collections.abc import Iterable


def text(attribute: bytes | str | Iterable[bytes | str]) -> str:
    """A text, however the library that wrote it keeps texts; that of netCDF puts those beyond ASCII into arrays."""
    if not isinstance(attribute, bytes | str):
        (attribute,) = attribute
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)
