"""Patches: connected regions of contact, what is in each, and what becomes of them from one state to the next."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

# Nodes along an edge overestimate an area by so much of the edges of cells (Yastrebov, Anciaux & Molinari, Tribol. Int.
# 114 (2017) 161, eq. 9).
BEYOND_EDGES = (np.pi - 1 + np.log(2)) / 24


def labelled(touching: np.ndarray) -> tuple[np.ndarray, int]:
    """Number of the patch of every cell, (n, n), 0 outside, and how many there are; cells that share an edge belong
    together, over the edges of the period too.
    """
    labels, count = label(touching)
    pairs = [
        np.stack([one, other], axis=1)[(one > 0) & (other > 0)]
        for one, other in ((labels[0], labels[-1]), (labels[:, 0], labels[:, -1]))
    ]
    rows, columns = np.concatenate(pairs).T
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1))
    _, component = connected_components(graph, directed=False)
    # Numbered in the order of their first cells; 0 stays outside.
    return component[labels], int(component.max())


def edges(touching: np.ndarray) -> np.ndarray:
    """Edges between contact and no contact of every cell, (n, n); none of a cell that does not touch."""
    return sum((touching & ~np.roll(touching, way, axis)).astype(float) for axis in (0, 1) for way in (-1, 1))


def centres(labels: np.ndarray, count: int, weight: np.ndarray) -> np.ndarray:
    """Centres (count, 2) of the patches, (x, y) in cells, of a weight (n, n); across the edges of the period too."""
    n = len(labels)
    turn = np.exp(2j * np.pi * np.arange(n) / n)
    inside = np.flatnonzero(labels)
    own, weights = labels.ravel()[inside], weight.ravel()[inside]
    result = np.empty((count, 2))
    for axis, at in enumerate((inside % n, inside // n)):
        phase = turn[at]
        mean = np.bincount(own, weights * phase.real, count + 1) + 1j * np.bincount(
            own, weights * phase.imag, count + 1
        )
        result[:, axis] = np.angle(mean[1:]) * n / (2 * np.pi) % n
    return result
