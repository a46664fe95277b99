"""Digest of a dataset, to compare datasets bit by bit, also between processes."""

import hashlib


def digest(dataset, without=()):
    """Return the SHA-256 of all values of a dataset, except those of some variables."""
    total = hashlib.sha256()
    for name, variable in sorted(dataset.drop_vars(without).variables.items()):
        values = variable.values
        total.update(name.encode() + (repr(values.tolist()).encode() if values.dtype == object else values.tobytes()))
    return total.hexdigest()
