"""Summits of a surface: positions, heights and radii of curvature, found below the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage
from scipy.interpolate import NdBSpline
from scipy.spatial import cKDTree

from icha.surface import Surface

# A quintic spline reproduces a parabola exactly, depends on far nodes only weakly (0.43 per cell), and at eight
# cells per wavelength has the second derivatives of a sine to 4e-4.
_DEGREE = 5
# Value, slope and curvature of the quintic spline at a node, from the coefficients of the five nodes around.
_VALUE = np.array([1.0, 26.0, 66.0, 26.0, 1.0]) / 120
_SLOPE = np.array([-1.0, -10.0, 0.0, 10.0, 1.0]) / 24
_CURVATURE = np.array([1.0, 2.0, -6.0, 2.0, 1.0]) / 6

_MAX_NEWTON_STEPS = 30
# In cells: the last step of a converged search, how far from its node it may end, and when two ends are the same.
_CONVERGED = 1e-9
_FARTHEST = 1.5
_SAME_SUMMIT = 1e-3
# Less curvature than this part of the surface's mean is rounding on a plateau.
_FLAT = 1e-6
# Rows of the grid examined at a time, which bounds the memory.
_ROWS = 512


@dataclass(frozen=True, eq=False)
class Asperities:
    """The summits of a periodic surface.

    position : (n, 2) array, (x, y) in [0, period), m.
    height : (n,) array, above the mean plane, m.
    radius : (n,) array, 1/sqrt(kappa1 kappa2), the geometric mean of the principal radii of curvature, m.
    period : m.
    """

    position: np.ndarray
    height: np.ndarray
    radius: np.ndarray
    period: float

    def __len__(self) -> int:
        """Number of asperities."""
        return len(self.height)


def find_summits(surface: Surface) -> Asperities:
    """All summits of a surface: the maxima, with negative-definite curvature, of a quintic spline through its nodes.

    Comparing every node with its neighbours misses and misplaces elongated summits: on a crest oblique to the grid
    the highest node can lie cells away from the summit, or there is none, and the contact area then depends on the
    grid by some per cent. Instead Newton's method starts from every node whose own parabola has its top in a cell
    next to it, and only a start that converges nearby counts, since near-degenerate curvatures throw the others far
    away.

    Returns
    -------
    Asperities, ordered as the nodes from which they were found.

    Raises
    ------
    ValueError
        If the surface has no summit with negative-definite curvature.
    """
    grid, spacing = surface.grid, surface.spacing
    coefficients = scipy.ndimage.spline_filter(surface.heights, order=_DEGREE, output=np.float64, mode="grid-wrap")
    node, flat = _nodes_near_summits(coefficients)
    spline = _periodic_spline(coefficients)

    at, converged = node.copy(), np.zeros(len(node), dtype=bool)
    moving = np.arange(len(node))
    for _ in range(_MAX_NEWTON_STEPS):
        here = np.mod(at[moving], grid)
        gradient = [spline(here, nu=nu) for nu in ((1, 0), (0, 1))]
        concave, _, step = _newton_step(*gradient, *_hessian(spline, here), flat)
        at[moving] += np.clip(step, -0.5, 0.5)
        near = concave & (np.max(np.abs(at[moving] - node[moving]), axis=1) <= _FARTHEST)
        small = np.max(np.abs(step), axis=1) <= _CONVERGED
        converged[moving] = near & small
        moving = moving[near & ~small]
    at = np.mod(at[converged], grid)
    at[at >= grid] = 0.0
    # Several nodes lead to one summit: the first stands for it.
    twice = np.sort(cKDTree(at, boxsize=grid).query_pairs(_SAME_SUMMIT, output_type="ndarray"), axis=1)
    at = np.delete(at, twice[:, 1], axis=0)
    hyy, hyx, hxx = _hessian(spline, at)
    curvature = hyy * hxx - hyx**2
    if not len(at):
        raise ValueError("heights: the surface has no summit with negative-definite curvature")
    position = at[:, ::-1] * spacing
    position[position >= surface.period] = 0.0
    return Asperities(
        position=position,
        height=spline(at),
        radius=spacing**2 / np.sqrt(curvature),
        period=surface.period,
    )


def _nodes_near_summits(coefficients):
    """Nodes (k, 2) from which Newton's step to a maximum is at most a cell, and the curvature that counts as flat.

    Curvatures are in metres per squared cell.
    """
    grid = len(coefficients)
    found, trace = [], 0.0
    for first in range(0, grid, _ROWS):
        rows = np.arange(first, min(first + _ROWS, grid))
        block = coefficients[np.arange(rows[0] - 2, rows[-1] + 3) % grid]

        def derivative(along_y, along_x, block=block):
            partial = scipy.ndimage.correlate1d(block, along_y, axis=0)[2:-2]
            return scipy.ndimage.correlate1d(partial, along_x, axis=1, mode="wrap")

        hessian = derivative(_CURVATURE, _VALUE), derivative(_SLOPE, _SLOPE), derivative(_VALUE, _CURVATURE)
        concave, determinant, step = _newton_step(derivative(_SLOPE, _VALUE), derivative(_VALUE, _SLOPE), *hessian, 0.0)
        trace += float(np.sum(np.abs(hessian[0] + hessian[2])))
        close = np.argwhere(concave & (np.max(np.abs(step), axis=-1) <= 1))
        found.append(np.column_stack([close + np.array([first, 0]), determinant[tuple(close.T)]]))
    found = np.concatenate(found)
    flat = _FLAT * trace / grid**2
    return found[found[:, 2] > flat**2, :2], flat


def _hessian(spline, at):
    """Second derivatives yy, yx and xx of the spline at points (n, 2)."""
    return [spline(at, nu=nu) for nu in ((2, 0), (1, 1), (0, 2))]


def _newton_step(gy, gx, hyy, hyx, hxx, flat):
    """Whether the Hessian is negative definite, its determinant, and Newton's step (..., 2), zero where it is not."""
    determinant = hyy * hxx - hyx**2
    concave = (determinant > flat**2) & (hyy + hxx < 0)
    safe = np.where(concave, -determinant, 1.0)
    step = np.stack([(hxx * gy - hyx * gx) / safe, (hyy * gx - hyx * gy) / safe], axis=-1)
    step[~concave] = 0.0
    return concave, determinant, step


def _periodic_spline(coefficients: np.ndarray) -> NdBSpline:
    """The quintic spline of given periodic coefficients, as a function of (row, column) in [0, n)."""
    margin = _DEGREE
    coefficients = np.pad(coefficients, margin, mode="wrap")
    # Coefficient i belongs to the basis function centred on node i - margin.
    knots = np.arange(coefficients.shape[0] + _DEGREE + 1, dtype=float) - margin - (_DEGREE + 1) / 2
    return NdBSpline((knots, knots), coefficients, _DEGREE)
