"""Equilibrium of all contact spots at a given mean separation, load or contact area.

The unknowns are the local approaches delta_i of the spots in contact:

    delta_i + w_i(a(delta)) = h_i - u,        a_i = a_JKR(delta_i),

with w_i the displacement by all other spots and all images (eq. 4) and u the mean separation. On a free half-space
there are no images, and u is the separation of the surface's mean plane and the half-space far away from it, which
falls below zero as the loaded part sinks in; the mean gap is u plus the mean of w over the square. Below the jump-off
approach a spot keeps its jump-off radius while the equations are solved (zero for Hertz's law), so that they are
defined everywhere and, without adhesion, smooth.

Newton's method with an inexact Krylov solver runs over sites: the spots and, without adhesion, the asperities that may
come into contact; there a negative approach exerts nothing, and who is in contact comes out of the iteration. With
adhesion contact forms and breaks in jumps. As soon as the iteration is close to an equilibrium, all jumps and unions
that apply happen at once, and it goes on from there.

Unions are undone when the surfaces part: as the contact says, where a united spot detaches, which then falls back into
its asperities (those that a stable JKR state holds stay in contact), or before, where the two spots that it was made of
would no longer overlap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from icha.asperity.coalescence import covering_spot, disjoint_pairs, equivalent_spots, overlapping_pairs
from icha.contact.events import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Events
from icha.contact.failures import FullContact, NotConverged
from icha.contact.model import PRESSURE, Control
from icha.contact.unions import OVERLAP
from icha.equilibrium.control import gradient_by_radius, held_value, radius_response
from icha.equilibrium.problem import Problem
from icha.equilibrium.states import CONTACT, GONE, TRIAL, ContactState, Union
from icha.half_space.interaction import Interaction, displacement_at
from icha.surfaces.square import periodic_difference

# Largest equilibrium error in units of h_rms at which an equilibrium counts as found.
RESIDUAL_TOLERANCE = 1e-9
# Relative error of a load or an area that was asked for.
TARGET_TOLERANCE = 1e-11
# Of what a load is made up of, the part below which it counts as none when its error is measured.
_SMALLEST_LOAD = 1e-4
# One weighs as much as the other in a solve.
_MISS_WEIGHT = RESIDUAL_TOLERANCE / TARGET_TOLERANCE
# Error in h_rms below which jumps and unions happen; one that hangs by less than ten times the error waits.
_EVENT_TOLERANCE = 3e-4
_EVENT_MARGIN = 10.0
# Newton steps between two events.
_MAX_NEWTON_STEPS = 60
_MAX_HALVINGS = 8
# Relative errors of the linear solves: of most, and of those repeated with the exact operator.
_LINEAR_TOLERANCE = 3e-3
_EXACT_TOLERANCE = 1e-6
_RESPONSE_TOLERANCE = 1e-6
# Largest dimension of a Krylov space.
_KRYLOV = 50
# Free asperities are looked at that can have come into contact since they were last looked at: their approach grows by
# at most so many times the fall of the separation; and, as spots jump, by so much at once, in h_rms and in the largest
# jump-off approach: on the way to an equilibrium that is a guess, at the equilibrium a bound.
_FASTEST_APPROACH = 3.0
_PROBABLE_APPROACH = 1.2
_SUDDEN_GUESS = 0.02, 2.0
_SUDDEN_BOUND = 1.0, 10.0
# Sites are arranged anew when they have grown by this factor, or so large a part of them is gone.
_GROWTH = 1.5
_GONE_PART = 0.25
# Contact area fraction at which the spots have lost all meaning.
_FULL_CONTACT = 0.5

# Below so many jump-off radii a Newton step back is one of the radius.
_NEAR_JUMP_OFF = 1.5
# So large a part of a step that leads back over jump-off may be lost by ending there.
_NEXT_TO_JUMP_OFF = 0.2

# Spots whose distances from jump-off differ by this part are equal.
_SAME_STRENGTH = 1e-3


def equilibrium(
    contact: Problem, state: ContactState, separation: float, control: Control | None = None, *, let_go: int = 0
) -> ContactState:
    """Bring the contact from one state to another mean separation, or to a given load or area.

    Spots past jump-off are dropped, free asperities beyond jump-in join, asperities under a spot are taken into it
    and overlapping spots coalesce, all that apply at once, until nothing changes. That ends: without adhesion spots
    are only added or united (one of radius zero is harmless and is removed at the end); with adhesion an asperity
    that has broken contact here may not make it again at this separation (`pending` counts those that would, and
    without adhesion those left by a united spot that let go).

    Parameters
    ----------
    separation : m; a first guess if there is a `control`.
    control : a load or an area to hold instead of the separation.
    let_go : so many spots break contact at once, those that would reach jump-off first.

    Raises
    ------
    NotConverged
        If the equilibrium is not found.
    FullContact
        If the contact spreads over the whole surface.
    """
    search = _Search(contact, state, separation, control)
    if let_go:
        search.let_go(state, let_go)
    return search.run()


class _Search:
    """The iteration from one state to the next."""

    def __init__(self, contact, state, separation, control):
        self.contact, self.control, self.separation = contact, control, separation
        self.law, self.adhesive = contact.law, contact.adhesive
        self.sites, self.height = state.sites, state.sites.height.copy()
        self.status, self.holder = state.status.copy(), state.holder.copy()
        self.approach = state.approach + state.response * (separation - state.separation)
        self.response = state.response
        self.seen, self.seen_at = state.seen.copy(), state.seen_at.copy()
        self.jump_ins, self.jump_offs = state.jump_ins, state.jump_offs
        self.coalescences, self.splits = state.coalescences, state.splits
        self.history, self.log = state.history, []
        self.parting = contact.united_until == OVERLAP and separation > state.separation
        self.pending = 0
        self.fallen = np.full(len(contact.asperities), -1)  # the united spot that an asperity has just fallen out of
        self.split = np.zeros(len(contact.asperities), dtype=bool)  # whether it has fallen out of one before
        self.locked = np.zeros(len(contact.asperities), dtype=bool)
        self.known = state.status == CONTACT  # spots that were there before
        self.fresh = np.empty(0, dtype=int)  # united spots whose heights follow from the next evaluation
        self.interaction = None
        self.is_site = np.zeros(len(contact.asperities), dtype=bool)
        single = (self.sites.asperity >= 0) & (self.status != GONE)
        self.is_site[self.sites.asperity[single]] = True
        largest_jump = -self.law.jump_off_approach(np.max(contact.asperities.radius_of_curvature))
        self.sudden_guess, self.sudden_bound = (
            heights * contact.rms_height + jumps * largest_jump for heights, jumps in (_SUDDEN_GUESS, _SUDDEN_BOUND)
        )
        self._arrange_if_needed()
        if not self.adhesive:
            fall = self.seen_at - separation
            hopeful = self.seen + _PROBABLE_APPROACH * fall + self.sudden_guess > 0
            trial = np.flatnonzero(hopeful & self._free())
            # Where contact was lost the approach is not known, but small.
            expected = np.where(np.isfinite(fall), self.seen + fall, 0.0)
            self._admit(trial, TRIAL, expected[trial])

    # --- the sites ------------------------------------------------------------------------------------------

    def _free(self):
        """Whether an asperity is neither a site nor part of one (asperities,)."""
        return (self.holder < 0) & ~self.is_site

    def _admit(self, asperity, status, approach):
        """Make sites of free asperities (k,) with approaches (k,), m."""
        if not len(asperity):
            return
        asperities = self.contact.asperities
        self.is_site[asperity] = True
        if status == CONTACT:
            self.holder[asperity] = len(self.sites) + np.arange(len(asperity))
        self._append(
            position=asperities.position[asperity],
            height=asperities.height[asperity],
            radius_of_curvature=asperities.radius_of_curvature[asperity],
            asperity=asperity,
            members=np.ones(len(asperity), dtype=int),
            parts=np.full(len(asperity), None),
            status=status,
            approach=approach,
            known=False,
        )

    def _append(self, *, status, approach, known, parted=-1, **more):
        count = len(approach)
        more["parted"] = np.full(count, parted)
        self.sites = self.sites.extended(**more, jump_off=self.law.jump_off_approach(more["radius_of_curvature"]))
        self.height = np.concatenate([self.height, more["height"]])
        self.status = np.concatenate([self.status, np.full(count, status, dtype=np.int8)])
        self.approach = np.concatenate([self.approach, approach])
        self.response = np.concatenate([self.response, np.full(count, -1.0)])
        self.known = np.concatenate([self.known, np.full(count, known)])
        self.interaction = None

    def _arrange_if_needed(self):
        """Forget sites that are gone when they are many; choose the near field for the number of the others."""
        gone = self.status == GONE
        if len(gone) <= _GROWTH * self.sites.arranged and np.count_nonzero(gone) <= _GONE_PART * len(gone):
            return
        stay = np.flatnonzero(~gone)
        index = np.full(len(gone) + 1, -1)
        index[stay] = np.arange(len(stay))
        self.holder = index[self.holder]  # -1 looks up the last
        self.sites = self.sites.taken(stay)
        self.height, self.status, self.known = self.height[stay], self.status[stay], self.known[stay]
        self.approach, self.response = self.approach[stay], self.response[stay]

    # --- what happens ---------------------------------------------------------------------------------------

    def _note(self, kind, position, members, energy=0.0, asperity=-1):
        """Keep events in mind: positions (k, 2), and what else there is of them, each (k,) or one for all."""
        others = (np.broadcast_to(each, len(position)) for each in (members, energy, asperity))
        self.log += [(kind, *row) for row in zip(position, *others, strict=True)]

    def _forget_jumps_in(self, asperity):
        """Take jumps into contact of asperities back; how many there were."""
        taken_back = set(asperity.tolist())
        kept = [row for row in self.log if row[0] != JUMP_IN or row[4] not in taken_back]
        gone = len(self.log) - len(kept)
        self.log = kept
        return gone

    def _events_so_far(self):
        if not self.log:
            return self.history
        kind, position, members, energy, _ = zip(*self.log, strict=True)
        events = Events(np.array(kind, np.int8), np.array(position), np.array(members, int), np.array(energy, float))
        return (*self.history, events)

    # --- the equations --------------------------------------------------------------------------------------

    def _evaluate(self, approach, separation):
        """The equations at given approaches (n,) and separation, m."""
        part, R = self.status != GONE, self.sites.radius_of_curvature
        a = np.zeros(len(self.sites))
        a[part] = self.law.contact_radius(approach[part], R[part])
        if self.interaction is None or np.any(a > self.interaction.pairs.largest_radius):
            ahead = np.where(part, approach + 0.02 * self.contact.rms_height, 0.0)
            largest = np.where(part, 1.2 * self.law.contact_radius(ahead, R), 0.0)
            self.interaction = Interaction.between(self.law, self.sites.half_space, R, largest)
        w = self.interaction.displacement(a)
        if len(self.fresh):
            self.height[self.fresh] = approach[self.fresh] + w[self.fresh] + separation
            self.fresh = np.empty(0, dtype=int)
        error = np.where(part, approach + w + separation - self.height, 0.0)
        miss = gross = 0.0
        if self.control is not None:
            miss = held_value(self.contact, self.control.quantity, a[part], R[part]) - self.control.target
            if self.control.quantity == PRESSURE:
                gross = float(np.sum(self.law.repulsive_force(a[part], R[part]))) / self.contact.area
        return _Point(approach, separation, a, error, miss, gross)

    def _size(self, point, miss_weight=_MISS_WEIGHT):
        """Largest error in units of h_rms, the control's relative miss with its weight."""
        size = float(np.max(np.abs(point.error), initial=0.0)) / self.contact.rms_height
        if self.control is None:
            return size
        # A load that is next to nothing beside the attraction and repulsion that make it up is met as well as they are.
        unit = max(abs(self.control.target), _SMALLEST_LOAD * point.gross)
        return max(size, abs(point.miss) / unit * miss_weight)

    def _linearised(self, point):
        """Where the unknowns are, da/d(delta) there, and the products of W' da/d(delta), exact and approximate."""
        part = np.flatnonzero(self.status != GONE)
        a, R = point.a[part], self.sites.radius_of_curvature[part]
        off, approach = self.sites.jump_off[part], point.approach[part]
        # Who is about to be drawn back over jump-off behaves as on the near side.
        approach = np.where(self._drawn_back(point)[part] & self.adhesive, off, approach)
        slope = radius_response(self.law, a, R, approach, off)
        tangent = self.interaction.tangent(point.a)

        def spread(x):
            full = np.zeros(len(self.sites))
            full[part] = slope * x
            return full

        return part, slope, lambda x: tangent(spread(x))[part], lambda x: tangent.nearly(spread(x))[part]

    def _newton_step(self, point, exact):
        """Change of the approaches (n,) and of the separation."""
        part, slope, *products = self._linearised(point)
        product, tolerance = (products[0], _EXACT_TOLERANCE) if exact else (products[1], _LINEAR_TOLERANCE)
        size = len(part)
        step, du = np.zeros(len(self.sites)), 0.0
        if self.control is None:
            step[part] = _solve(lambda x: x + product(x), -point.error[part], tolerance)
            return step, du
        # The separation is an unknown too; in terms of what the last response leaves, the bordered matrix is near one.
        response = self.response[part]
        gradient = slope * gradient_by_radius(
            self.contact, self.control.quantity, point.a[part], self.sites.radius_of_curvature[part]
        )
        rate = float(np.sum(gradient * response))
        if rate == 0:
            raise NotConverged(f"{self.control.quantity} does not depend on the separation")

        def bordered(x):
            y = x[:size] + x[size] * response
            return np.append(y + product(y) + x[size], np.sum(gradient * y) / rate)

        x = _solve(bordered, np.append(-point.error[part], -point.miss / rate), tolerance)
        longest = 0.2 * self.contact.rms_height
        du = float(np.clip(x[size], -longest, longest))
        step[part] = x[:size] + du * response
        return step, du

    def _descend(self, point, size):
        """A Newton step, shortened until the error falls; None if it does not."""
        for exact in (False, True):
            step, du = self._newton_step(point, exact)
            for halving in range(_MAX_HALVINGS):
                fraction = 0.5**halving
                new = self._evaluate(self._moved(point, fraction * step), point.separation + fraction * du)
                if self._size(new) < (1 - 0.1 * fraction) * size:
                    return new
        return None

    def _moved(self, point, step):
        """Approaches (n,) after a step of theirs.

        At jump-off the radius goes with the root of the approach that is left; in terms of the radius the equations
        are smooth there. So a step towards jump-off is taken as one of the radius, and one back over it ends there
        first, and then solves the quadratic equation that the radius obeys.
        """
        moved = point.approach + step
        if not self.adhesive:
            return moved
        sites, law, off = self.sites, self.law, self.sites.jump_off
        drawn_back = self._drawn_back(point)
        moved = np.where((point.approach < off) & ~drawn_back, np.minimum(moved, off), moved)
        part = np.flatnonzero((self.status != GONE) & ((step < 0) & (point.approach > off) | drawn_back))
        R, a = sites.radius_of_curvature[part], point.a[part]
        lowest = law.jump_off_radius(R)
        near = a < _NEAR_JUMP_OFF * lowest
        part, R, a, lowest = part[near], R[near], a[near], lowest[near]
        change = radius_response(law, a, R, np.maximum(point.approach, off)[part], off[part]) * step[part]
        # Where the radius ends, what is left of the error is made up by the approach alone.
        left = 1 - np.minimum((lowest - a) / np.where(change < 0, change, -1.0), 1.0)
        reached = law.approach(np.maximum(a + change, lowest), R)
        moved[part] = reached + np.where(change < 0, left * np.minimum(step, -point.error)[part], 0.0)
        back = drawn_back[part]
        part, far = part[back], np.maximum(reached[back] - off[part[back]], 1e-300)
        lacking = point.approach[part] - point.error[part] - off[part]
        slope = lacking / np.sqrt(far)
        moved[part] = off[part] + (0.5 * (np.sqrt(slope**2 + 4 * lacking) - slope)) ** 2
        return moved

    def _drawn_back(self, point):
        """Whether a spot is next to jump-off, on the far side, and drawn back over it (n,)."""
        gap = self.sites.jump_off - point.approach
        return (self.status == CONTACT) & (gap >= 0) & (gap < -_NEXT_TO_JUMP_OFF * point.error)

    # --- the iteration --------------------------------------------------------------------------------------

    def run(self) -> ContactState:
        """Iterate to the new equilibrium."""
        point = self._evaluate(self.approach, self.separation)
        steps, quiet = 0, False
        while True:
            if self._swallow(point):
                point = self._evaluate(self.approach, point.separation)
            size = self._size(point)
            # A missed load is one of the separation, about the same part of h_rms.
            closeness = self._size(point, 1.0)
            margin = _EVENT_MARGIN * closeness * self.contact.rms_height
            changed = False
            if size <= RESIDUAL_TOLERANCE:
                changed = self._events(point, 0.0)
                if not changed:
                    return self._finish(point)
            elif closeness <= _EVENT_TOLERANCE and not quiet:
                changed = self._events(point, margin)
                quiet = not changed  # what hangs by less waits for the equilibrium
            if not changed:
                if steps == _MAX_NEWTON_STEPS:
                    raise NotConverged(f"equilibrium error {size:.2e} h_rms after {steps} Newton steps")
                nearer = self._descend(point, size)
                if nearer is not None:
                    point = nearer
                    steps += 1
                    continue
                # Where one spot's edge runs through another the equations are singular: they must unite first.
                self.approach = point.approach
                windows = self.interaction.pairs
                if not self._unite(point.a, windows, margin) and not self._unite(point.a, windows, deep=True):
                    raise NotConverged(
                        f"no descent from an equilibrium error of {size:.2e} h_rms with "
                        f"{np.count_nonzero(point.a)} spots"
                    )
            point = self._evaluate(self.approach, point.separation)
            steps, quiet = 0, False

    def _events(self, point, margin):
        """All jumps and unions that hang by more than the margin (m); whether there were any."""
        covered = float(np.sum(np.pi * point.a**2)) / self.contact.area
        if covered > _FULL_CONTACT:
            raise FullContact(f"the contact area reached {covered:.2f} of the nominal one")
        self.approach = point.approach
        off = self.status == CONTACT
        if self.adhesive:
            off &= point.approach < self.sites.jump_off - margin
        else:  # a single asperity out of contact is harmless
            off &= (point.approach <= 0) & (self.sites.asperity < 0) & (margin == 0)
        changed = bool(off.any())
        if changed:
            self._jump_off(off)
        windows = self.interaction.pairs
        # Without adhesion only who was not expected is missing, which may wait for the equilibrium.
        if self.adhesive or margin == 0:
            changed |= self._join(point, margin)
        changed |= self._unite(point.a, windows, margin=margin)
        return (self.parting and self._part(point.a)) or changed

    def _jump_off(self, off):
        """Break the contact of spots (n,). Asperities of united ones fall back, if they have not done so here before;
        the others may not come back at this separation."""
        sites, spots = self.sites, np.flatnonzero(off)
        self.jump_offs += len(spots)
        R = sites.radius_of_curvature[spots]
        energy = self.law.energy(self.law.jump_off_radius(R), R)
        self._note(JUMP_OFF, sites.position[spots], sites.members[spots], energy)
        before, united = self.holder.copy(), np.append(off & (sites.asperity < 0), False)
        freed = self._let_go(off)
        falls = united[before] & ~self.split  # a holder -1 looks up the last
        self.fallen[falls] = before[falls]
        self.split |= falls
        self.locked |= freed & ~falls

    def let_go(self, state, count):
        """Break the contact of `count` spots of the state from which the search starts, and of their equals."""
        here = self.approach - self.response * (self.separation - state.separation)
        rate = np.maximum(-self.response, 1e-3)
        left = np.where(self.status == CONTACT, (here - self.sites.jump_off) / rate, np.inf)
        last = np.partition(left, count - 1)[count - 1]
        self.approach = here
        self._jump_off(left <= last * (1 + _SAME_STRENGTH))

    def _part(self, a):
        """Undo unions whose two spots would no longer overlap; whether there were any."""
        sites, n = self.sites, len(a)
        touching = np.array([0.0 if union is None else union.touching for union in sites.parts[:n]])
        apart = np.flatnonzero((self.status[:n] == CONTACT) & (a < touching))
        for site in apart.tolist():
            union = sites.parts[site]
            shrunk = union.contact_radius * (a[site] / np.hypot(*union.contact_radius))
            held = self.holder == site
            self.holder[held] = -1
            self.seen_at[held] = np.inf  # who lay under the spot is looked at anew
            self.status[site] = GONE
            self.splits += 1
            self._note(SPLIT, sites.position[[site]], sites.members[[site]])
            for k, asperities in enumerate(union.asperities()):
                self.holder[asperities] = len(self.sites) + k
            single = union.asperity[union.asperity >= 0]
            self.is_site[single] = True
            self._append(
                position=union.position,
                height=union.height,
                radius_of_curvature=union.radius_of_curvature,
                asperity=union.asperity,
                members=union.members,
                parts=union.parts,
                status=CONTACT,
                approach=self.law.approach(shrunk, union.radius_of_curvature),
                known=True,
                parted=self.splits,
            )
        return bool(len(apart))

    def _let_go(self, off):
        """Free the asperities of spots (n,), and say whose (asperities,)."""
        freed = np.append(off, False)[self.holder]  # -1 looks up the last
        self.holder[freed] = -1
        self.is_site[freed] = False
        self.seen_at[freed] = np.inf  # their approach is not known
        self.status[off] = GONE
        return freed

    def _join(self, point, margin):
        """Make sites of the free asperities that are in contact; whether there were any."""
        contact, asperities = self.contact, self.contact.asperities
        reach = self.seen + _FASTEST_APPROACH * np.abs(self.seen_at - point.separation)
        reach += self.sudden_guess if margin > 0 else self.sudden_bound
        looked_at = np.flatnonzero((reach >= contact.jump_in) & self._free())
        spots = np.flatnonzero((point.a > 0) & (self.status != GONE))
        a, R, there = point.a[spots], self.sites.radius_of_curvature[spots], self.sites.position[spots]
        w = displacement_at(
            self.law, asperities.period, asperities.position[looked_at], there, a, R, self.sites.half_space.ewald.once
        )
        self.seen[looked_at] = asperities.height[looked_at] - point.separation - w
        self.seen_at[looked_at] = point.separation
        # What has just fallen out of a united spot was in contact, and stays so wherever there is a stable state.
        fell = self.fallen[looked_at] >= 0
        lowest = self.law.jump_off_approach(asperities.radius_of_curvature[looked_at[fell]])
        needed = contact.jump_in[looked_at] + margin
        needed[fell] = lowest
        ready = self.seen[looked_at] >= needed
        if not self.adhesive:
            ready &= self.seen[looked_at] > 0
        self.locked[looked_at[fell & ~ready]] = True
        ready = looked_at[ready]
        locked = self.locked[ready]
        self.pending = int(np.count_nonzero(locked))
        ready = ready[~locked]
        under = covering_spot(asperities.position[ready], there, a, asperities.cell)
        self.holder[ready[under >= 0]] = spots[under[under >= 0]]
        ready = self._first_of_each_group(ready[under < 0])
        source = self.fallen[ready]
        self.fallen[:] = -1
        if not len(ready):
            return False
        stay, joining = np.unique(source[source >= 0]), ready[source < 0]
        self.splits += len(stay)
        self._note(SPLIT, self.sites.position[stay], self.sites.members[stay])
        if self.adhesive:
            self.jump_ins += len(joining)
            R = asperities.radius_of_curvature[joining]
            energy = -self.law.energy(self.law.contact_radius(self.seen[joining], R), R)
            self._note(JUMP_IN, asperities.position[joining], 1, energy, joining)
        self._admit(ready, CONTACT if self.adhesive else TRIAL, self.seen[ready])
        return True

    def _first_of_each_group(self, joining):
        """Of asperities (k,) that would lie in each other's contacts, the largest; the others have to wait."""
        asperities = self.contact.asperities
        if len(joining) < 2:
            return joining
        position = asperities.position[joining]
        a = self.law.contact_radius(self.seen[joining], asperities.radius_of_curvature[joining])
        under = covering_spot(position, position, a, asperities.cell, larger_than=a)
        return joining[under < 0]

    def _swallow(self, point):
        """Take new contacts back that lie in another's contact area: they are under it; whether there were any.

        The equations are singular where one spot's edge runs through another's centre.
        """
        a, windows, known = point.a, self.interaction.pairs, self.known
        i, j = windows.target, windows.source
        inside = np.flatnonzero((windows.r < a[j]) & (a[i] > 0) & ~known[i])
        inside = inside[known[j[inside]] | (a[i[inside]] < a[j[inside]])]
        if not len(inside):
            return False
        inside = inside[np.argsort((a[j] - windows.r)[inside], kind="stable")]
        i, j = i[inside], j[inside]
        self.jump_ins -= self._forget_jumps_in(self.sites.asperity[np.unique(i)])
        self.holder[self.sites.asperity[i]] = i
        self.is_site[self.sites.asperity[i]] = False
        self.status[i] = GONE
        index = np.append(np.arange(len(self.sites)), -1)
        index[i] = j  # the deepest comes last and stays
        while np.any(index[index] != index):  # who takes one in may be taken in itself, by a larger one
            index = index[index]
        self.holder = index[self.holder]  # -1 looks up the last
        self.approach = point.approach
        return True

    def _unite(self, a, windows, margin=0.0, deep=False):
        """Replace overlapping spots by their equivalents; whether there were any.

        margin : error of the approaches in m, beyond whose effect they have to overlap.
        deep : only those of which one covers the other's centre.
        """
        sites, period = self.sites, self.contact.asperities.cell
        first, second = windows.source, windows.target
        depth = a[first] + a[second] - windows.r
        part = (a > 0) & (self.status[: len(a)] != GONE)
        touch = (depth > 0) & part[first] & part[second]
        if self.parting and not deep:
            # Two spots that have just come apart would unite again and again, as they settle.
            touch &= (sites.parted[first] < 0) | (sites.parted[first] != sites.parted[second])
        touch = np.flatnonzero(touch)
        if margin > 0 and len(touch):
            # An error of the approach is one of the radius, about R/(2a) times as large.
            i, j = first[touch], second[touch]
            touch = touch[
                depth[touch]
                > margin * 0.5 * (sites.radius_of_curvature[i] / a[i] + sites.radius_of_curvature[j] / a[j])
            ]
        if deep:
            touch = touch[windows.r[touch] < np.maximum(a[first[touch]], a[second[touch]])]
        if not len(touch):
            return False
        pairs = overlapping_pairs(sites.position, a, first[touch], second[touch], windows.r[touch])
        pairs = disjoint_pairs(pairs)
        i, j = pairs.T
        centre, radius, R = equivalent_spots(
            self.law,
            sites.position[i],
            a[i],
            sites.radius_of_curvature[i],
            sites.position[j],
            a[j],
            sites.radius_of_curvature[j],
            period,
        )
        parts = np.full(len(pairs), None)
        if self.contact.united_until == OVERLAP:
            shrink = np.linalg.norm(periodic_difference(sites.position[j], sites.position[i], period), axis=1)
            touching = radius * np.minimum(shrink / (a[i] + a[j]), 1.0)
            for k, pair in enumerate(pairs):
                own = (
                    getattr(sites, name)[pair]
                    for name in ("position", "radius_of_curvature", "asperity", "members", "parts")
                )
                position, curvature, asperity, members, inner = own
                parts[k] = Union(touching[k], position, self.height[pair], curvature, a[pair], asperity, members, inner)
        # Without adhesion a site may have come into contact only now.
        arrived = pairs[self.status[pairs] == TRIAL]
        self.jump_ins += len(arrived)
        self._note(JUMP_IN, sites.position[arrived], 1, 0.0, sites.asperity[arrived])
        self.holder[sites.asperity[arrived]] = arrived
        single = sites.asperity[pairs]
        self.is_site[single[single >= 0]] = False
        self.status[pairs] = GONE
        index = np.append(np.arange(len(sites)), -1)
        index[pairs] = len(sites) + np.arange(len(pairs))[:, None]
        self.holder = index[self.holder]  # -1 looks up the last
        self.coalescences += len(pairs)
        self._note(COALESCENCE, centre, sites.members[i] + sites.members[j])
        self.fresh = len(sites) + np.arange(len(pairs))
        self._append(
            position=centre,
            height=np.zeros(len(pairs)),
            radius_of_curvature=R,
            asperity=np.full(len(pairs), -1),
            members=sites.members[i] + sites.members[j],
            parts=parts,
            status=CONTACT,
            approach=self.law.approach(radius, R),
            known=True,
        )
        return True

    def _finish(self, point) -> ContactState:
        approach, sites = point.approach, self.sites
        response = self._response(point)
        if not self.adhesive:
            made = np.flatnonzero((self.status == TRIAL) & (approach > 0))
            self.status[made] = CONTACT
            self.holder[sites.asperity[made]] = made
            self.jump_ins += len(made)
            self._note(JUMP_IN, sites.position[made], 1, 0.0, sites.asperity[made])
            idle = np.flatnonzero((self.status == CONTACT) & (approach <= 0))  # of single asperities
            self.jump_offs += len(idle)
            self._note(JUMP_OFF, sites.position[idle], 1)
            self.status[idle] = TRIAL
            self.holder[sites.asperity[idle]] = -1
        return ContactState(
            separation=point.separation,
            sites=replace(sites, height=self.height),
            approach=approach,
            contact_radius=np.where(self.status == CONTACT, point.a, 0.0),
            status=self.status,
            response=response,
            holder=self.holder,
            seen=self.seen,
            seen_at=self.seen_at,
            residual=float(np.max(np.abs(point.error), initial=0.0)) / self.contact.rms_height,
            jump_ins=self.jump_ins,
            jump_offs=self.jump_offs,
            coalescences=self.coalescences,
            splits=self.splits,
            pending=self.pending,
            history=self._events_so_far(),
        )

    def _response(self, point):
        """d(delta)/du of every site (n,): the solution of (1 + W' da/d(delta)) x = -1."""
        response = np.full(len(self.sites), -1.0)
        part, _, exact, product = self._linearised(point)
        if not len(part):
            return response
        x = self.response[part]
        for attempt in range(12):
            defect = -1.0 - x - exact(x)
            if np.max(np.abs(defect)) <= _RESPONSE_TOLERANCE:
                response[part] = x
                return response
            operator, tolerance = (product, _LINEAR_TOLERANCE) if attempt < 8 else (exact, _EXACT_TOLERANCE)
            x = x + _solve(lambda y, operator=operator: y + operator(y), defect, tolerance)
        raise NotConverged(f"the response of {len(part)} spots to the separation was not found")


@dataclass(frozen=True, eq=False)
class _Point:
    """One evaluation of the equations: approaches, radii and errors (n,) in m, the separation, and the control's miss.

    gross: pressure by the repulsive parts of the forces alone, Pa.
    """

    approach: np.ndarray
    separation: float
    a: np.ndarray
    error: np.ndarray
    miss: float
    gross: float


def _solve(apply, b, tolerance):
    """Solve apply(x) = b roughly; the caller sees how good the answer is by what becomes of the equations."""
    size = len(b)
    operator = LinearOperator((size, size), matvec=apply, dtype=float)
    x, _ = gmres(operator, b, rtol=tolerance, atol=0.0, restart=min(size, _KRYLOV), maxiter=2)
    if not np.all(np.isfinite(x)):
        raise NotConverged(f"the linear equations of {size} unknowns have no finite solution")
    return x
