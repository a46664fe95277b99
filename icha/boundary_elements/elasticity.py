"""Pressures of a contact whose front stands still: displacement given in contact, bonds at its front, none outside."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from icha.boundary_elements.front import COMPLIANCE, Front, neighbours
from icha.boundary_elements.kernel import HalfSpace, Whole
from icha.boundary_elements.nearby import Tiles
from icha.boundary_elements.regions import among, around, beside, merged
from icha.contact.failures import FullContact, NotConverged
from icha.support.parallel import blocks, on_cores

# Compliance of a lone cell, h/E*, for the conditioning of bonds; and that of the shortest waves, 2/q, the least.
_CELL = 1.12
_LEAST_COMPLIANCE = np.sqrt(2) / np.pi
_MAX_ITERATIONS = 300
# Displacements in single precision are off by so much of the largest.
_ROUNDING = 5e-7
# What a correction in single precision leaves of the error, at best and at worst; and how far below what is asked.
_GAIN, _LEAST_GAIN, _MARGIN = 1e-4, 0.5, 0.5
_MAX_CHANGES = 200
# A fraction of a cell that is no contact: what its bond carries is lost in the rounding of all others.
NOTHING = 1e-9
# What is left of the error while cells still come and go.
_WHILE_CHANGING = 0.1
# Rows of a field that one core works on.
_ROWS = 1024


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
        """The same with these cells, (m,), wholly in contact."""
        together = np.union1d(self.cells, cells)
        fraction, pressure = np.zeros(len(together)), np.zeros(len(together))
        old = np.searchsorted(together, self.cells)
        fraction[old], pressure[old] = self.fraction, self.pressure
        fraction[np.searchsorted(together, cells)] = 1.0
        return Contact(together, fraction, pressure)

    def changed(self, fraction: np.ndarray, pressure: np.ndarray) -> Contact:
        """The same after changes of fraction and pressure, (k,), without cells that are next to out of contact."""
        fraction = np.clip(self.fraction + fraction, 0.0, 1.0)
        touching = fraction > NOTHING
        return Contact(self.cells[touching], fraction[touching], (self.pressure + pressure)[touching])


@dataclass(frozen=True, eq=False)
class Held(Contact):
    """A contact in elastic equilibrium.

    gap: at the nodes, (n, n). off: by how much the displacement may be, in contact. energy: elastic, of the half-space
    and the bonds, in E* cells^3; unsure: by how much it may be larger. around: mean fraction around each of its cells,
    (k,). rim: the cells beside, rising, (m,), and around_rim: the same there.
    """

    gap: np.ndarray = field(repr=False)
    off: float
    energy: float
    unsure: float
    around: np.ndarray = field(repr=False)
    rim: np.ndarray = field(repr=False)
    around_rim: np.ndarray = field(repr=False)


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
        return _ROUNDING * self.largest

    def gap(self, displaced: np.ndarray, separation: float, cells: np.ndarray, known: np.ndarray) -> np.ndarray:
        """The gap at a separation, in the place and precision of the displacements, a field.

        known: gap on cells in contact, (k,), where it is known better than from a difference of displacements.
        """
        heights, level = self.single if displaced.dtype == np.float32 else self.double, displaced.dtype.type(separation)

        def less_heights(rows):
            displaced[rows] -= heights[rows]
            displaced[rows] += level

        on_cores(less_heights, blocks(len(heights), _ROWS))
        displaced.ravel()[cells] = known
        return displaced

    def gap_at(self, places: np.ndarray, space: HalfSpace, contact: Contact, separation: float) -> np.ndarray:
        """The gap at a separation at places, (m,), rising, of a contact with its pressures; to single precision."""
        displaced = space.displacement(contact.cells, contact.pressure.astype(np.float32), places)
        return displaced - (self.double.ravel()[places] - separation)

    def gap_under(
        self,
        space: HalfSpace,
        cells: np.ndarray,
        pressure: np.ndarray,
        separation: float,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """The gap at a separation under pressures in E* on cells, (k,), in their precision, a field; in that of `out`."""
        displaced = space.displacement(cells, pressure, out=out)
        known = displaced.ravel()[cells] - (self.double.ravel()[cells] - separation)
        return self.gap(displaced, separation, cells, known)


def overlapping(gap: np.ndarray, cells: np.ndarray, tolerance: float) -> np.ndarray:
    """The cells, rising, at which surfaces overlap by more than a tolerance and that are none of those in contact."""

    def below(rows):
        return rows.start * gap[0].size + np.flatnonzero(gap[rows] < -tolerance)

    found = np.concatenate(on_cores(below, blocks(len(gap), _ROWS)))
    return found[~among(found, cells)[0]]


def solve_bonds(
    space: HalfSpace,
    cells: np.ndarray,
    bonds: np.ndarray,
    wanted: np.ndarray,
    pressure: np.ndarray,
    tolerance: float,
    kind: type = float,
    *,
    gain: float = 0.0,
    balanced: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures p with (K + bonds) p = wanted on cells, zero elsewhere; and what is left of `wanted`.

    Corrections are computed in single precision, the remaining error in double precision.

    Parameters
    ----------
    cells : (k,), counted through. bonds, wanted : (k,), compliances and displacements. pressure : (k,), to start from.
    tolerance : of the displacement, in cells. kind : np.float32 for displacements, (n, n), in single precision. gain :
    in single precision, what may be left of the error at the start. balanced : the sum of the pressures does not
    change, and `wanted` is met up to a constant.

    Raises
    ------
    NotConverged
        If that is not reached.
    """
    p, before, near = pressure, np.inf, None
    while True:
        r = wanted - space.displacement(cells, p.astype(kind), cells) - bonds * p
        if balanced:
            r -= np.mean(r)
        error = np.abs(r).max(initial=0.0)
        if error <= tolerance:
            return p, r
        if not error <= _LEAST_GAIN * before:
            raise NotConverged(f"pressures at a given contact were not found (displacement off by {error:.1e} cells)")
        before, near = error, near or (space.nearly(cells) if kind is float else Whole(space, cells))
        accuracy = max(gain if kind == np.float32 else _GAIN, near.error, _MARGIN * tolerance / error)
        change, left = _correction(near, bonds, r / error, accuracy, balanced)
        p = p + error * change
        if kind == np.float32:
            if np.abs(left).max() > accuracy:
                raise NotConverged(f"pressures at a given contact were not found (to {accuracy:.1e})")
            return p, error * left


def _correction(near, bonds, wanted, accuracy, balanced=False):
    """The pressure p with (K + bonds) p = wanted on cells, (k,), to an accuracy of that; and what is left.

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


@dataclass(frozen=True, eq=False)
class _Touching(Contact):
    """A contact on its way to equilibrium; `given`, (k,): cells that it began with."""

    given: np.ndarray

    @property
    def bonds(self):
        """Compliance of every cell's bond."""
        return COMPLIANCE * (1 / self.fraction - 1)

    def left(self, gap):
        """By how much the displacement in contact is off, (k,)."""
        return -gap.ravel()[self.cells] - self.bonds * self.pressure

    def off(self, gap):
        """The largest of these errors."""
        return np.abs(self.left(gap)).max(initial=0.0)

    def corrected(self, near, gap, tolerance, gain):
        """The same with pressures that leave so much of the error, or the tolerance."""
        left, error = self.left(gap), self.off(gap)
        accuracy = max(near.error or gain, _MARGIN * tolerance / error)
        change, _ = _correction(near, self.bonds, left / error, accuracy)
        return replace(self, pressure=self.pressure + error * change)

    def after_changes(self, joining):
        """The same after cells under pressure have closed, those that would pull have gone, and others, (m,), have come.

        None if nothing changes. What it began with stays.
        """
        closing = (self.pressure > 0) & (self.fraction < 1)
        staying = self.given | (self.pressure >= 0)
        if not closing.any() and staying.all() and not len(joining):
            return None
        fraction = np.where(closing, 1.0, self.fraction)
        return _Touching(
            *merged(
                self.cells[staying],
                joining,
                (fraction[staying], 1.0),
                (self.pressure[staying], 0.0),
                (self.given[staying], False),
            )
        )


@dataclass(frozen=True, eq=False)
class _Whole:
    """All of the surface, in which contact settles."""

    space: HalfSpace
    topography: Topography
    separation: float
    tolerance: float
    kind: type

    @property
    def size(self):
        return self.space.size

    def gap(self, touching, out=None):
        """The gap everywhere."""
        pressure = touching.pressure.astype(self.kind)
        return self.topography.gap_under(self.space, touching.cells, pressure, self.separation, out)

    def corrected(self, touching, gap):
        """The contact with better pressures, given the gap; of few cells on a large grid, as it settles among these."""
        nearby = _Nearby.of(self, touching, touching, gap) if self.kind == np.float32 else None
        if nearby is not None:
            return nearby.settled(touching)
        gain = _GAIN if self.kind is float else _WHILE_CHANGING
        return touching.corrected(self.space.nearly(touching.cells), gap, self.tolerance, gain)


@dataclass(frozen=True, eq=False)
class _Nearby:
    """Cells around a contact on a large grid, (s,), in which it settles, with changes of displacement by tiles.

    places: of these cells. gap_before, pressure_before: there, where it begins. Cells are counted through these.
    """

    places: np.ndarray
    tiles: Tiles
    gap_before: np.ndarray
    pressure_before: np.ndarray
    tolerance: float

    @classmethod
    def of(cls, whole, touching, since, gap):
        """The cells around a contact, given another with its gap everywhere or None; None if tiles are no short way."""
        space = whole.space
        if not len(touching.cells) or not isinstance(space.nearly(touching.cells), Tiles):
            return None
        places = around(np.union1d(touching.cells, since.cells), space.grid)
        tiles = space.nearly(places)
        if not isinstance(tiles, Tiles):
            return None
        if gap is None:
            gap = whole.topography.gap_at(places, space, since, whole.separation)
        else:
            gap = gap.ravel()[places].astype(float)
        pressure = np.zeros(len(places))
        pressure[np.searchsorted(places, since.cells)] = since.pressure
        return cls(places, tiles, gap, pressure, whole.tolerance)

    @property
    def size(self):
        return len(self.places)

    def settled(self, touching):
        """The contact in equilibrium, as far as is known here; as it is if it goes beyond."""
        own = replace(touching, cells=np.searchsorted(self.places, touching.cells))
        try:
            found, _, _ = _settled(self, own)
        except FullContact:
            return touching
        return replace(found, cells=self.places[found.cells])

    def gap(self, touching, out=None):
        """The gap here."""
        change = -self.pressure_before
        change[touching.cells] += touching.pressure
        return self.gap_before + self.tiles.displacement(change.astype(np.float32))

    def corrected(self, touching, gap):
        """The contact with better pressures, given the gap here."""
        return touching.corrected(_Part(self.tiles, touching.cells, self.size), gap, self.tolerance, _WHILE_CHANGING)


@dataclass(frozen=True, eq=False)
class _Part:
    """Some of the cells of tiles, (k,) of so many, as `Whole`."""

    tiles: Tiles
    cells: np.ndarray
    size: int

    error = 0.0

    def displacement(self, pressure):
        return self.tiles.displacement(self._everywhere(pressure))[self.cells]

    def inverse(self, displacement):
        return self.tiles.inverse(self._everywhere(displacement))[self.cells]

    def _everywhere(self, values):
        field = np.zeros(self.size, values.dtype)
        field[self.cells] = values
        return field


def _settled(where, touching):
    """The contact in elastic equilibrium, the gap where it settles, and what is left of the error in contact."""
    gap, tolerance = None, where.tolerance
    for _ in range(_MAX_CHANGES):
        if len(touching.cells) == where.size:
            raise FullContact("the contact runs over the whole surface")
        if gap is None:
            gap = where.gap(touching)
        error = off = touching.off(gap)
        if not off <= tolerance:
            touching = where.corrected(touching, gap)
            gap = where.gap(touching, gap)
            off = touching.off(gap)
        joining = overlapping(gap, touching.cells, max(tolerance, off))
        after = touching.after_changes(joining)
        if after is None:
            if off <= tolerance:
                return touching, gap, touching.left(gap)
            if not off <= _LEAST_GAIN * error:
                raise NotConverged(f"pressures at a given contact were not found (displacement off by {off:.1e} cells)")
            continue
        if len(after.cells) < len(touching.cells) + len(joining):
            gap = None
        touching = after
    raise NotConverged("the contact under pressure did not settle")


def held(
    space: HalfSpace,
    topography: Topography,
    separation: float,
    contact: Contact,
    tolerance: float,
    *,
    beyond: np.ndarray | None = None,
    since: Held | None = None,
) -> Held:
    """The elastic equilibrium of given fractions of contact.

    Bonds only pull: cells that are partly in contact and come under pressure close. Where the surfaces would overlap,
    they touch under pressure; the front decides whether they also stick.

    Parameters
    ----------
    contact : with pressures to start from. tolerance : as of `solve_bonds`.
    beyond : what contact outside of these cells adds to the mean fraction around every one, (n, n).
    since : another contact in equilibrium at this separation, which is not far away.

    Raises
    ------
    FullContact
        If there is contact everywhere.
    NotConverged
        If pressures or the contact under pressure are not found.
    """
    kind = np.float32 if tolerance > topography.rounding else float
    touching = _Touching(contact.cells, contact.fraction, contact.pressure, np.ones(len(contact.cells), dtype=bool))
    whole = _Whole(space, topography, separation, tolerance, kind)
    if kind == np.float32:
        # Most of what changes does so where the contact is.
        nearby = _Nearby.of(whole, touching, since or touching, since and since.gap)
        touching = touching if nearby is None else nearby.settled(touching)
    touching, gap, left = _settled(whole, touching)
    cells, fraction, pressure = touching.cells, touching.fraction, touching.pressure
    bonds, overlap = touching.bonds, topography.double.ravel()[cells] - separation
    # The functional whose largest value is the energy: an error of the pressure counts only squared.
    energy = 0.5 * float(np.sum(pressure * (overlap + left)))
    unsure = 0.5 * float(np.sum(left**2 / (_LEAST_COMPLIANCE + bonds)))
    if kind == np.float32:
        unsure += 0.2 * _ROUNDING * float(np.sum(np.abs(pressure * overlap)))
    rim = beside(cells, space.shape)
    near, order = merged(cells, rim, (np.arange(len(cells)), len(cells) + np.arange(len(rim))))
    around = np.empty(len(near))
    around[order] = neighbours(space, cells, fraction.astype(kind), near)
    if beyond is not None:
        around += beyond.ravel()[np.concatenate([cells, rim])]
    around, around_rim = around[: len(cells)], around[len(cells) :]
    return Held(cells, fraction, pressure, gap, tolerance, energy, unsure, around, rim, around_rim)


def intensity(front: Front, state: Held) -> tuple[np.ndarray, np.ndarray]:
    """sqrt(G/dgamma): of cells in contact, (k,), which open above 1, and of those beside, (m,), which close below."""
    inside = -state.pressure / (state.fraction * front.strengths(state.around))
    return inside, state.gap.ravel()[state.rim] / (COMPLIANCE * front.strengths(state.around_rim))
