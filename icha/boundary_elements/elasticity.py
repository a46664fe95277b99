"""Contacts, topographies, and the pressures that displace cells in contact as wanted while there are none outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.boundary_elements.kernel import HalfSpace, Nearly, Whole
from icha.boundary_elements.patches import among, merged
from icha.contact.model import NotConverged
from icha.support.parallel import blocks, on_cores

# Compliance, h/E*, from which on that of a bond counts in the preconditioner: with it conjugate gradients are quickest.
_CELL = 2.5
_MAX_ITERATIONS = 300
# Displacements in single precision are off by so much of the largest.
ROUNDING = 5e-7
# What a correction in single precision leaves of the error, at best and at worst; and how far below what is asked.
GAIN, LEAST_GAIN, MARGIN = 1e-4, 0.5, 0.5
# A fraction of a cell that is no contact: what its bond carries is lost in the rounding of all others.
NOTHING = 1e-9
# Rows of a field that one core works on.
ROWS = 1024


@dataclass(frozen=True, eq=False)
class Contact:
    """The k cells in contact. Lengths in cells, pressures in E*.

    cells: counted through, rising. fraction: of contact, (k,), positive. pressure: mean of a cell, (k,), negative in
    tension.
    """

    cells: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray

    def with_closed(self, cells: np.ndarray) -> Contact:
        """The same with these cells, (m,), rising, wholly in contact."""
        there, at = among(cells, self.cells)
        fraction = self.fraction.copy()
        fraction[at] = 1.0
        return Contact(*merged(self.cells, cells[~there], (fraction, 1.0), (self.pressure, 0.0)))

    def changed(self, fraction: np.ndarray, pressure: np.ndarray) -> Contact:
        """The same after changes of fraction and pressure, (k,), without cells that are next to out of contact."""
        fraction = np.clip(self.fraction + fraction, 0.0, 1.0)
        touching = fraction > NOTHING
        return Contact(self.cells[touching], fraction[touching], (self.pressure + pressure)[touching])


@dataclass(frozen=True, eq=False)
class Topography:
    """Heights of a surface, (n, n) or (t, n, n), in cells, in both precisions that gaps are computed in.

    largest: height, up or down.
    """

    double: np.ndarray
    single: np.ndarray
    largest: float

    @classmethod
    def of(cls, heights: np.ndarray) -> Topography:
        """The topography of heights in double precision."""
        return cls(heights, heights.astype(np.float32), float(max(heights.max(), -heights.min())))

    @property
    def rounding(self) -> float:
        """By how much displacements in single precision are off, in cells."""
        return ROUNDING * self.largest

    def gap(self, displaced: np.ndarray, separation: float, cells: np.ndarray, known: np.ndarray) -> np.ndarray:
        """The gap at a separation, in the place and precision of the displacements, a field.

        known: gap on cells in contact, (k,), where it is known better than from a difference of displacements.
        """
        heights, level = self.single if displaced.dtype == np.float32 else self.double, displaced.dtype.type(separation)

        def less_heights(rows):
            displaced[rows] -= heights[rows]
            displaced[rows] += level

        on_cores(less_heights, blocks(len(heights), ROWS))
        displaced.ravel()[cells] = known
        return displaced


def pressures_for(
    space: HalfSpace,
    cells: np.ndarray,
    wanted: np.ndarray,
    pressure: np.ndarray,
    tolerance: float,
    kind: type = float,
    *,
    gain: float = 0.0,
    balanced: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures on cells, zero elsewhere, under which these are displaced as `wanted`; and what is left of `wanted`.

    Corrections are computed in single precision, the remaining error in double precision.

    Parameters
    ----------
    cells : (k,), counted through. wanted : (k,), displacements, in cells. pressure : (k,), to start from.
    tolerance : of the displacement, in cells. kind : np.float32 for displacements, (n, n), in single precision. gain :
    in single precision, what may be left of the error at the start. balanced : the sum of the pressures does not
    change, and `wanted` is met up to a constant.

    Raises
    ------
    NotConverged
        If that is not reached.
    """
    p, before, near, without_bonds = pressure, np.inf, None, np.zeros(len(cells))
    while True:
        r = wanted - space.displacement(cells, p.astype(kind), cells)
        if balanced:
            r -= np.mean(r)
        error = np.abs(r).max(initial=0.0)
        if error <= tolerance:
            return p, r
        if not error <= LEAST_GAIN * before:
            raise NotConverged(f"pressures at a given contact were not found (displacement off by {error:.1e} cells)")
        before, near = error, near or (space.nearly(cells) if kind is float else Whole(space, cells))
        accuracy = max(gain if kind == np.float32 else GAIN, near.error, MARGIN * tolerance / error)
        change, left = correction(near, without_bonds, r / error, accuracy, balanced)
        p = p + error * change
        if kind == np.float32:
            if np.abs(left).max() > accuracy:
                raise NotConverged(f"pressures at a given contact were not found (to {accuracy:.1e})")
            return p, error * left


def correction(
    near: Nearly, bonds: np.ndarray, wanted: np.ndarray, accuracy: float, balanced: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """The pressure p with (K + bonds) p = wanted on cells, (k,), to an accuracy in cells, or nearly; and what is left.

    near: the half-space for the cells. Conjugate gradients, with its approximate inverse as preconditioner. Single
    precision.
    """
    scale, bonds = np.sqrt(_CELL / (_CELL + bonds)).astype(np.float32), bonds.astype(np.float32)
    r = wanted.astype(np.float32)
    p, way, rho = np.zeros_like(r), np.zeros_like(r), np.float32(1.0)
    for count in range(_MAX_ITERATIONS):
        if np.abs(r).max() <= accuracy:
            break
        z = scale * near.inverse(scale * r)
        if balanced:
            z -= np.mean(z)
        new = np.vdot(r, z)
        way = z + (new / rho) * way if count else z
        rho = new
        image = near.displacement(way) + bonds * way
        step = rho / np.vdot(way, image)
        p += step * way
        r -= step * image
        if balanced:
            r -= np.mean(r)
    return p, r
