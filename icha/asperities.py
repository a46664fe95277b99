"""Summits of a surface: positions, heights and radii of curvature, found below the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage
from scipy.interpolate import NdBSpline

from icha.surface import Surface

# A quintic spline reproduces a parabola exactly, depends on far nodes only weakly (0.43 per cell), and at eight
# cells per wavelength has the second derivatives of a sine to 4e-4.
_DEGREE = 5


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


def grid_summits(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes not lower than their eight periodic neighbours, as (row, column) indices in row-major order.

    Of equal neighbours only the first in row-major order counts, so that a summit half-way between two nodes is
    found once.
    """
    summit = np.ones(heights.shape, dtype=bool)
    for axis_shift in ((-1, -1), (-1, 0), (-1, 1), (0, -1)):
        summit &= heights > np.roll(heights, tuple(-s for s in axis_shift), axis=(0, 1))
        summit &= heights >= np.roll(heights, axis_shift, axis=(0, 1))
    return np.nonzero(summit)


def find_summits(surface: Surface, newton_steps: int = 12) -> Asperities:
    """All summits of a surface, refined within their own grid cell.

    A summit is a node not lower than its eight periodic neighbours. Its position is moved by Newton's method on a
    quintic spline through the nodes; near-degenerate curvatures would throw it far away, so that it never leaves
    its own cell, and a move that does not raise the height is taken back. Summits without a negative-definite
    curvature are dropped.

    Returns
    -------
    Asperities, ordered as their nodes are.

    Raises
    ------
    ValueError
        If the surface has no summit with negative-definite curvature.
    """
    spacing = surface.spacing
    row, column = grid_summits(surface.heights)
    node = np.stack([row, column], axis=1).astype(float)
    spline = _periodic_spline(surface.heights)

    def derivatives(at):
        gradient = np.stack([spline(at, nu=(1, 0)), spline(at, nu=(0, 1))], axis=1)
        hessian = np.stack([spline(at, nu=nu) for nu in ((2, 0), (1, 1), (0, 2))], axis=1)
        return gradient, hessian

    at = node.copy()
    for _ in range(newton_steps):
        gradient, (hyy, hyx, hxx) = _unpack(derivatives(at))
        determinant = hyy * hxx - hyx**2
        concave = (determinant > 0) & (hyy + hxx < 0)
        safe = np.where(concave, determinant, 1.0)
        step = (
            np.stack(
                [hxx * gradient[:, 0] - hyx * gradient[:, 1], hyy * gradient[:, 1] - hyx * gradient[:, 0]],
                axis=1,
            )
            / -safe[:, None]
        )
        step[~concave] = 0.0
        moved = np.clip(at + step, node - 0.5, node + 0.5)
        if np.array_equal(moved, at):
            break
        at = moved
    # Where a clipped step went downhill, the node itself is the better summit.
    lower = spline(at) < spline(node)
    at[lower] = node[lower]

    _, (hyy, hyx, hxx) = _unpack(derivatives(at))
    determinant = hyy * hxx - hyx**2
    concave = (determinant > 0) & (hyy + hxx < 0)
    if not concave.any():
        raise ValueError("heights: the surface has no summit with negative-definite curvature")
    at = at[concave]
    position = np.mod(at[:, ::-1] * spacing, surface.period)
    position[position >= surface.period] = 0.0
    return Asperities(
        position=position,
        height=spline(at),
        radius=spacing**2 / np.sqrt(determinant[concave]),
        period=surface.period,
    )


def _unpack(derivatives):
    gradient, hessian = derivatives
    return gradient, hessian.T


def _periodic_spline(heights: np.ndarray) -> NdBSpline:
    """The quintic spline through periodic heights, as a function of (row, column), valid within half a cell around."""
    margin = _DEGREE
    coefficients = scipy.ndimage.spline_filter(heights, order=_DEGREE, output=np.float64, mode="grid-wrap")
    coefficients = np.pad(coefficients, margin, mode="wrap")
    # Coefficient i belongs to the basis function centred on node i - margin.
    knots = np.arange(coefficients.shape[0] + _DEGREE + 1, dtype=float) - margin - (_DEGREE + 1) / 2
    return NdBSpline((knots, knots), coefficients, _DEGREE)
