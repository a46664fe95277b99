"""Single square on a free half-space: removal of the images from a periodic sum.

The square lies in a periodic cell of twice its side. The nearest image of a point is at least one side of the square
away, so that the displacement by images is smooth. Lagrange polynomials through n Chebyshev nodes along each side
interpolate the smooth displacement; the error falls as 5.8^-n. The periodic sum minus the displacement by images is the
plain sum of 1/r.
"""

from functools import lru_cache

import numpy as np
from scipy.special import erfc

from icha.half_space.split import MOMENTS, short_mean, smooth_half, smooth_mode

# Number of Chebyshev nodes along a side; the relative error of the displacement by images is 2e-14.
_NODES = 18
# Ewald sum in `_image_potential`: parameter alpha, in 1/cell; cut-off of the short-ranged half, in cells; and highest
# mode of the smooth half. The omitted terms are below 2e-17.
_ALPHA = 3.0
_REACH = 3
_HIGHEST = 6


def basis(x, cell: float) -> np.ndarray:
    """Return the values of the Lagrange polynomials of the Chebyshev nodes at coordinates x: (n, nodes) array.

    x : (n,) array, m, in [0, cell/2]; cell : period of the sum, m.
    """
    nodes, weight, _ = _chebyshev()
    distance = np.asarray(x)[:, None] / cell - nodes
    on_node = distance == 0
    terms = weight / np.where(on_node, 1.0, distance)
    values = terms / np.sum(terms, axis=1, keepdims=True)
    hit = on_node.any(axis=1)
    values[hit] = on_node[hit]
    return values


def image_field(by, bx, moments, cell: float, contact_modulus: float) -> np.ndarray:
    """Return the displacement (m) at the Chebyshev nodes of y and x by all images of m spots: (nodes, nodes) array.

    The result includes the uniform displacement that makes the mean of the periodic sum zero.

    Parameters
    ----------
    by, bx : (m, nodes) float, `basis` of the y and x coordinates of the spots.
    moments : (m,) arrays for k = 0, 1, …: integrals of p s^(2k) / (4^k k!^2), s the distance from a centre, N m^(2k).
    cell : period of the sum, m.
    """
    _, _, second = _chebyshev()
    field = np.zeros((_NODES, _NODES))
    # The k-th moment is multiplied by the k-th power of the Laplacian. Horner's rule sums all moments.
    for k, moment in enumerate(reversed(moments)):
        if k:
            field = (second @ field + field @ second.T) / cell**2
        collected = by.T @ (moment[:, None] * bx)
        field = field + (_image_potential_matrix() @ collected.ravel()).reshape(field.shape)
    return field / (np.pi * contact_modulus * cell)


@lru_cache(maxsize=1)
def _chebyshev():
    """Return the Chebyshev nodes in [0, 1/2], their barycentric weights, and the matrix of the second derivative."""
    k = np.arange(_NODES)
    nodes = 0.25 * (1 - np.cos(np.pi * k / (_NODES - 1)))
    weight = (-1.0) ** k
    weight[[0, -1]] *= 0.5
    distance = nodes[:, None] - nodes + np.eye(_NODES)
    first = weight / weight[:, None] / distance
    np.fill_diagonal(first, 0.0)
    np.fill_diagonal(first, -np.sum(first, axis=1))
    return nodes, weight, first @ first


@lru_cache(maxsize=1)
def _image_potential_matrix():
    """Return the potential at node i by the images of a unit source at node j: shape (nodes^2, nodes^2)."""
    nodes, _, _ = _chebyshev()
    distance, index = np.unique(np.round(np.abs(nodes[:, None] - nodes), 15), return_inverse=True)
    potential = _image_potential(distance)
    return potential[index[:, None, :, None], index[None, :, None, :]].reshape(_NODES**2, _NODES**2)


def _image_potential(distance):
    """Return the sum of 1/r over all images of a point, minus a uniform background, in a cell of side 1.

    distance : (k,) float, distances from the point along y, and along x; the result is a (k, k) array.
    """
    near, modes = np.arange(-_REACH, _REACH + 1), np.arange(-_HIGHEST, _HIGHEST + 1)
    to_images = distance[:, None] - near
    r = np.hypot(to_images[:, None, :, None], to_images[None, :, None, :])
    q = 2 * np.pi * np.hypot(modes[:, None], modes)
    # The point itself and the mean do not count.
    r[:, :, _REACH, _REACH] = q[_HIGHEST, _HIGHEST] = np.inf
    waves = np.cos(2 * np.pi * distance[:, None] * modes)
    x2 = _ALPHA**2 * np.add.outer(distance**2, distance**2)
    own = _ALPHA * smooth_half(x2.ravel(), np.eye(1, MOMENTS)).reshape(x2.shape)
    potential = waves @ smooth_mode(q, _ALPHA, 1 / np.pi, 1) @ waves.T - short_mean(_ALPHA, 1 / np.pi, 1)
    return potential + np.sum(erfc(_ALPHA * r) / r, axis=(2, 3)) - own


def mean_displacement(side: float, contact_modulus: float, position, force) -> float:
    """Return the mean displacement (m) of a square on a free half-space by n point forces at given positions.

    By reciprocity, the mean displacement by a force at a point equals the displacement at this point by the same force,
    spread over the square. Each of the four rectangles at the point contributes x asinh(y/x) + y asinh(x/y).
    """
    x, y = ([distance, side - distance] for distance in np.clip(position.T, 0.0, side))
    potential = sum(_corner_potential(width, height) for width in x for height in y)
    return float(np.sum(force * potential)) / (np.pi * contact_modulus * side**2)


def _corner_potential(x, y):
    """Return the integral of 1/r over a rectangle of sides x, y; r is the distance from a corner of the rectangle."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(x > 0, x * np.arcsinh(y / x), 0.0) + np.where(y > 0, y * np.arcsinh(x / y), 0.0)
