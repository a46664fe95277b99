"""Digests of datasets and results, to compare them bit by bit, also between processes."""

import hashlib


def digest(dataset, without=()):
    """Return the SHA-256 of all values of a dataset, except those of some variables."""
    total = hashlib.sha256()
    for name, variable in sorted(dataset.drop_vars(without).variables.items()):
        values = variable.values
        total.update(name.encode() + (repr(values.tolist()).encode() if values.dtype == object else values.tobytes()))
    return total.hexdigest()


def results_of(project, campaign):
    """Return checksums of all results of a campaign, without files that contain measured times."""
    folder = project / "results" / campaign
    return {
        str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.relative_to(folder).parts[0] not in ("logs", "benchmarks")
    }
