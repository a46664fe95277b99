"""Contacts of given fractions in elastic equilibrium: where surfaces overlap they touch, and bonds only pull.

On large grids with little contact nearly all that changes does so around it, and is found by tiles
(`icha.boundary_elements.nearby`) from a gap that is known; then the gap everywhere, by a transform of the whole grid,
says whether this is all. Windows, and contacts on small grids, need transforms of the whole only.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from icha.boundary_elements.elasticity import (
    GAIN,
    LEAST_GAIN,
    MARGIN,
    ROUNDING,
    ROWS,
    Contact,
    Topography,
    correction,
)
from icha.boundary_elements.front import COMPLIANCE, Front, neighbours
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.nearby import Tiles
from icha.boundary_elements.patches import among, beside, merged, surroundings
from icha.contact.model import FullContact, NotConverged
from icha.support.parallel import blocks, on_cores

# Compliance of the shortest waves, 2/q, h/E*: the least.
_LEAST_COMPLIANCE = np.sqrt(2) / np.pi
_MAX_CHANGES = 200
# What is left of the error while cells still come and go.
_WHILE_CHANGING = 0.1


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
    contact : with pressures to start from. tolerance : of the displacement, in cells.
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
        unsure += 0.2 * ROUNDING * float(np.sum(np.abs(pressure * overlap)))
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
        left = self.left(gap)
        error = np.abs(left).max(initial=0.0)
        accuracy = max(near.error or gain, MARGIN * tolerance / error)
        change, _ = correction(near, self.bonds, left / error, accuracy)
        return replace(self, pressure=self.pressure + error * change)

    def after_changes(self, joining):
        """The same after cells under pressure closed, those that would pull went, and others, (m,), came.

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
        """The gap everywhere, in the place of `out`."""
        cells = touching.cells
        displaced = self.space.displacement(cells, touching.pressure.astype(self.kind), out=out)
        overlap = self.topography.double.ravel()[cells] - self.separation
        return self.topography.gap(displaced, self.separation, cells, displaced.ravel()[cells] - overlap)

    def gap_at(self, places, contact):
        """The gap at places, (m,), rising, of a contact; in single precision."""
        displaced = self.space.displacement(contact.cells, contact.pressure.astype(np.float32), places)
        return displaced - (self.topography.double.ravel()[places] - self.separation)

    def corrected(self, touching, gap):
        """The contact with better pressures, given the gap; of few cells on a large grid, as it settles among these."""
        nearby = _Nearby.of(self, touching, touching, gap) if self.kind == np.float32 else None
        if nearby is not None:
            return nearby.settled(touching)
        gain = GAIN if self.kind is float else _WHILE_CHANGING
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
        if not space.is_large or not len(touching.cells):
            return None
        places = surroundings(space.grid, touching.cells, since.cells)
        tiles = space.nearly(places)
        if not isinstance(tiles, Tiles):
            return None
        if gap is None:
            gap = whole.gap_at(places, since)
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
        joining = _overlapping(gap, touching.cells, max(tolerance, off))
        after = touching.after_changes(joining)
        if after is None:
            if off <= tolerance:
                return touching, gap, touching.left(gap)
            if not off <= LEAST_GAIN * error:
                raise NotConverged(f"pressures at a given contact were not found (displacement off by {off:.1e} cells)")
            continue
        if len(after.cells) < len(touching.cells) + len(joining):
            gap = None
        touching = after
    raise NotConverged("the contact under pressure did not settle")


def _overlapping(gap, cells, tolerance):
    """The cells, rising, at which surfaces overlap by more than a tolerance and that are none of those in contact."""

    def below(rows):
        return rows.start * gap[0].size + np.flatnonzero(gap[rows] < -tolerance)

    found = np.concatenate(on_cores(below, blocks(len(gap), ROWS)))
    return found[~among(found, cells)[0]]
