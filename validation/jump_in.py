"""Jump into contact of a paraboloid with an attraction of finite range: the exact counterpart of Wu's formula.

A paraboloid of radius R faces an elastic half-space. The traction between points at a gap h is that of Lennard and
Jones, 8 gamma/(3 epsilon) ((epsilon/h)^3 - (epsilon/h)^9). As the undeformed gap falls, the surfaces bulge towards each
other, down to a smallest gap, below which no equilibrium without contact exists: there the paraboloid jumps into
contact. Gaps are divided by epsilon and distances from the axis by sqrt(R epsilon); only the Tabor parameter remains.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.optimize import minimize_scalar

from icha.asperity.jkr import wu_gap

# Nodes along the radius, and of each of the two quadratures.
_NODES, _QUADRATURE = 60, 80
# Gaps at the axis, over Wu's distance, at which equilibria are solved until the undeformed gap increases. Gaps below
# the range are left out, because the traction is repulsive.
_GAPS = np.geomspace(3.0, 0.5, 60)
_TOLERANCE, _STEPS = 1e-8, 60


def jump_in_gap(tabor_parameter: float) -> float:
    """Return the undeformed gap, over the range of attraction, at which a paraboloid jumps into contact.

    Parameters
    ----------
    tabor_parameter : (gamma^2 R/E*^2)^(1/3)/epsilon.

    Raises
    ------
    ValueError
        If contact forms continuously, at Tabor parameters below about 0.69.
    """
    scale = wu_gap(tabor_parameter)
    problem = _Problem(tabor_parameter, scale)
    gaps, undeformed, state = scale * _GAPS[scale * _GAPS > 1], [], None
    for k, gap in enumerate(gaps):
        state = problem.equilibrium(gap, state)
        undeformed.append(state[-1])
        if k > 1 and undeformed[k] > undeformed[k - 1]:
            between = (gaps[k], gaps[k - 2])
            return minimize_scalar(
                lambda gap, near=state: problem.equilibrium(gap, near)[-1],
                bounds=between,
                method="bounded",
                options={"xatol": 1e-6 * scale},
            ).fun
    raise ValueError(f"tabor_parameter: {tabor_parameter!r}: contact forms without a jump; expected more than 0.69")


class _Problem:
    """Equilibria of one Tabor parameter; states: bulge of the gaps at the nodes (n,), then the undeformed gap."""

    def __init__(self, tabor_parameter, scale):
        self.compliance = 8 / 3 * tabor_parameter**1.5
        self.radius = np.sqrt(scale) * nodes()
        self.influence = np.sqrt(scale) * displacement_matrix()
        # Weights that extrapolate a function of r^2 from the nodes to the axis.
        x, weights = _chebyshev()
        to_axis = weights / (-1 - x)
        self.at_axis = to_axis / to_axis.sum()

    def equilibrium(self, gap, start):
        """Return the state with a given gap at the axis, by Newton's method."""
        paraboloid, n = self.radius**2 / 2, len(self.radius)
        if start is None:
            state = np.full(n + 1, gap)
        else:
            # The deformation hardly changes.
            state = start + (gap - self.at_axis @ start[:-1])
        jacobian = np.zeros((n + 1, n + 1))
        jacobian[:-1, -1] = -1
        jacobian[-1, :-1] = self.at_axis
        for _ in range(_STEPS):
            h = state[:-1] + paraboloid
            traction, slope = h**-3 - h**-9, -3 * h**-4 + 9 * h**-10
            bulge = self.compliance * (self.influence @ traction)
            residual = np.append(state[:-1] - state[-1] + bulge, self.at_axis @ state[:-1] - gap)
            jacobian[:-1, :-1] = np.eye(n) + self.compliance * self.influence * slope
            step = np.linalg.solve(jacobian, -residual)
            shortest = 1.0
            while (state[:-1] + shortest * step[:-1] + paraboloid < 0.3 * h).any():
                shortest /= 2
            state = state + shortest * step
            if np.abs(step).max() < _TOLERANCE * gap:
                return state
        raise RuntimeError(f"no convergence at a gap of {gap:g} in {_STEPS} steps of Newton's method")


def nodes() -> np.ndarray:
    """Return distances from the axis (n,), Chebyshev's nodes in (r^2 - 1)/(r^2 + 1)."""
    x, _ = _chebyshev()
    return np.sqrt((1 + x) / (1 - x))


def _chebyshev():
    """Return Chebyshev's nodes of the first kind (n,) and the weights (n,) of barycentric interpolation."""
    angle = np.pi * (np.arange(_NODES) + 0.5) / _NODES
    return np.cos(angle), (-1.0) ** np.arange(_NODES) * np.sin(angle)


@cache
def displacement_matrix() -> np.ndarray:
    """Return the displacement at the nodes (in 1/E*) by an axisymmetric traction that falls as 1/r^6, (n, n).

    Source: the two Abel transforms of an axisymmetric load, K. L. Johnson, Contact Mechanics (1985), section 3.8, with
    their singularities removed: u(r) = 4/(pi E*) int_0^(pi/2) int_0^inf p(sqrt(r^2 sin^2 theta + y^2)) dy dtheta.
    """
    x, weights = _chebyshev()
    places, quadrature = np.polynomial.legendre.leggauss(_QUADRATURE)
    angle, weight = (places + 1) * np.pi / 4, quadrature * np.pi / 4
    matrix = np.empty((_NODES, _NODES))
    for i, r in enumerate(nodes()):
        least = r * np.sin(angle)[:, None]
        scale = np.sqrt(least**2 + 1)
        squared = least**2 + (scale * np.tan(angle)) ** 2
        area = weight[:, None] * weight * scale / np.cos(angle) ** 2
        kernel = weights / (((squared - 1) / (squared + 1)).ravel()[:, None] - x)
        matrix[i] = area.ravel() @ (kernel / kernel.sum(1, keepdims=True))
    return 4 / np.pi * matrix
