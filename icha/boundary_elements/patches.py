"""Patches: connected regions of contact, and what is in each."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from icha.boundary_elements.regions import adjacent, among, region

# Nodes along an edge overestimate an area by so much of the edges of cells (Yastrebov, Anciaux & Molinari, Tribol. Int.
# 114 (2017) 161, eq. 9).
BEYOND_EDGES = (np.pi - 1 + np.log(2)) / 24


def labelled(cells: np.ndarray, grid: int) -> tuple[np.ndarray, int]:
    """Number of the patch of every cell in contact, (k,), from 1 on, and how many there are.

    cells: counted through, rising. Cells that share an edge belong together, over the edges of the period too.
    """
    labels, count = label(region(cells, (grid, grid)))
    pairs = [
        np.stack([one, other], axis=1)[(one > 0) & (other > 0)]
        for one, other in ((labels[0], labels[-1]), (labels[:, 0], labels[:, -1]))
    ]
    rows, columns = np.concatenate(pairs).T
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1))
    _, component = connected_components(graph, directed=False)
    # Numbered in the order of their first cells; 0 is outside.
    return component[labels.ravel()[cells]], int(component.max())


def labels_at(places: np.ndarray, cells: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Number of the patch at some places, cells (m,) of any kind; 0 where there is none."""
    result = np.zeros(len(places), dtype=int)
    there, at = among(places, cells)
    result[there] = labels[at]
    return result


def edges(cells: np.ndarray, grid: int) -> np.ndarray:
    """Edges of every cell in contact, (k,), beyond which there is none."""
    touching = region(cells, (grid, grid)).ravel()
    return 4.0 - np.count_nonzero(touching[adjacent(cells, grid)], axis=0)


def centres(cells: np.ndarray, grid: int, labels: np.ndarray, count: int, weight: np.ndarray) -> np.ndarray:
    """Centres (count, 2) of the patches, (x, y) in cells, of a weight (k,); across the edges of the period too."""
    turn = np.exp(2j * np.pi * np.arange(grid) / grid)
    result = np.empty((count, 2))
    for axis, at in enumerate((cells % grid, cells // grid)):
        phase = turn[at]
        mean = np.bincount(labels, weight * phase.real, count + 1) + 1j * np.bincount(
            labels, weight * phase.imag, count + 1
        )
        result[:, axis] = np.angle(mean[1:]) * grid / (2 * np.pi) % grid
    return result
