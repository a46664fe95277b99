"""The interface of a contact model: what a path needs to follow it, and what a run keeps of its states."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

if TYPE_CHECKING:
    from icha.contact.models import PathAccuracy
    from icha.surfaces.summits import Asperities
    from icha.surfaces.surface import Surface

# Quantities that a solve can hold.
PRESSURE, AREA_FRACTION = "pressure", "area_fraction"


@dataclass(frozen=True)
class Control:
    """A quantity to hold in the place of the mean separation: PRESSURE (nominal, Pa) or AREA_FRACTION, its target."""

    quantity: str
    target: float


class NotConverged(Exception):
    """An equilibrium was not found; the message says what happened."""


class FullContact(NotConverged):
    """The contact spread over the whole surface."""


# Kinds of events, and their names.
JUMP_IN, JUMP_OFF, COALESCENCE, SPLIT = range(4)
EVENT_KINDS = ("jump_in", "jump_off", "coalescence", "split")


@dataclass(frozen=True, eq=False)
class Events:
    """Events between two equilibria. Arrays of length k.

    kind: JUMP_IN, JUMP_OFF (a spot, single or united, lets go), COALESCENCE (two spots unite) or SPLIT (a union is
    undone, and what it was made of stays in contact). position (k, 2), m. members: how many first contacts are united
    in the spot concerned. energy: J that a jump would set free if the spot were alone; zero for unions and splits.
    """

    kind: np.ndarray
    position: np.ndarray
    members: np.ndarray
    energy: np.ndarray

    def __len__(self) -> int:
        """Number of events."""
        return len(self.kind)

    def count(self, kind: int) -> int:
        """Number of events of a kind."""
        return int(np.count_nonzero(self.kind == kind))

    @classmethod
    def joined(cls, parts) -> Events:
        """Several, one after the other."""
        parts = [cls(np.empty(0, np.int8), np.empty((0, 2)), np.empty(0, int), np.empty(0)), *parts]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__match_args__))


class State(Protocol):
    """An equilibrium, immutable; all else that it holds is its model's own."""

    @property
    def separation(self) -> float:
        """Mean separation u, m."""


S = TypeVar("S", bound=State)
S_in = TypeVar("S_in", bound=State, contravariant=True)


class ContactModel(Protocol[S]):
    """A contact problem, immutable, whose equilibria follow from each other along a path. Nominal area: A0."""

    @property
    def adhesive(self) -> bool:
        """Whether contact forms and breaks in jumps."""

    @property
    def contact_modulus(self) -> float:
        """E*, the unit of relative loads, Pa."""

    @property
    def pressure_unit(self) -> float:
        """E* h'_rms, the unit of reduced pressures, Pa."""

    @property
    def rms_height(self) -> float:
        """Rms height h_rms of the surface, the unit of separations, m."""

    @property
    def area(self) -> float:
        """Nominal contact area A0, m^2."""

    @property
    def largest_area_fraction(self) -> float:
        """Contact area over nominal area beyond which the model covers no state."""

    @property
    def path_accuracy(self) -> PathAccuracy:
        """Accuracy to which a path resolves its events."""

    def untouched(self) -> S:
        """The state at which contact is about to be made first."""

    def equilibrium(self, state: S, separation: float, control: Control | None = None, *, let_go: int = 0) -> S:
        """Bring the contact from one state to another mean separation (m), or to a given load or area.

        Parameters
        ----------
        separation : a first guess if there is a `control`.
        control : a load or an area to hold instead of the separation.
        let_go : so many spots break contact at once, those that would reach jump-off first.

        Raises
        ------
        NotConverged
            If the equilibrium is not found.
        FullContact
            If the contact spreads over the whole surface.
        """

    def pressure(self, state: S) -> float:
        """Force over nominal area, Pa; negative in tension."""

    def area_fraction(self, state: S) -> float:
        """Contact area over nominal area."""

    def mean_gap(self, state: S) -> float:
        """Mean gap over the nominal area, m; of a periodic surface the mean separation."""

    def spot_count(self, state: S) -> int:
        """Number of contact spots."""

    def stiffness(self, state: S) -> float:
        """Contact stiffness -dp/du of the present spots, Pa/m."""

    def slope(self, quantity: str, state: S) -> float:
        """Derivative of a quantity that can be held with respect to the mean separation, at unchanged contacts."""

    def stored_energy(self, state: S) -> float:
        """Elastic energy less that of adhesion over nominal area, J/m^2; zero out of contact."""

    def is_unstable(self, state: S) -> bool:
        """Whether a spot would come closer as the surfaces part, which it does on an unstable branch only."""

    def events_between(self, before: S, after: S) -> Events:
        """The events on the path from one state to a later one."""

    def observables(self, surface: Surface) -> Observables[S]:
        """What a run keeps of the states on the surface that is pressed."""


class Observables(Protocol[S_in]):
    """Observables of a contact, by the names of a run's variables (`icha.datasets.variables.run`)."""

    def of_contact(self) -> dict[str, Any]:
        """What holds for all states."""

    def of_step(self, state: S_in) -> dict[str, Any]:
        """What a run keeps of every state."""

    def of_snapshot(self, state: S_in) -> dict[str, Any]:
        """Distributions of gap and pressure, and the spots."""

    def reasons_against(self, separations: Iterable[float], pressed: S_in | None) -> list[str]:
        """Reasons why the model does not stand for the surface in its first loading.

        Parameters
        ----------
        separations : mean separations that were reached, m.
        pressed : the state with the largest contact area; None if there is none.
        """

    @property
    def largest_tension(self) -> float:
        """Tension of all summits pulling their most at once, 3/2 pi dgamma sum(R)/A0, Pa."""


def summit_counts(asperities: Asperities) -> dict[str, int]:
    """Numbers of the summits of a surface, by the names of their variables."""
    return {"asperity_count": len(asperities), "unsupported_summit_count": len(asperities.unsupported_height)}


def largest_tension(asperities: Asperities, surface_energy: float, area: float) -> float:
    """Tension of all summits pulling their most at once, 3/2 pi dgamma sum(R)/A0, Pa."""
    return 1.5 * np.pi * surface_energy * float(np.sum(asperities.radius_of_curvature)) / area


# Bins in which gaps and pressures are counted, the same for every model.
#
# Of the gap in units of h_rms: one from zero, then 20 per decade. Of the pressure in units of E* h'_rms: linear in the
# bulk, 20 per decade in the tails. JKR pressures tend to minus infinity at the edge of a spot as |p|^-3, hence the long
# tail. What lies beyond the last bin is counted in it, so that nothing is lost.
GAPS_PER_DECADE = 20
GAP_BINS = np.concatenate([[0.0], np.logspace(-4, 1.5, 111)])
PRESSURE_BINS = np.concatenate([-np.logspace(8, 0, 161)[:-1], np.linspace(-1, 5, 301), 5 * np.logspace(0, 2, 41)[1:]])


def gap_bins(surface: Surface) -> np.ndarray:
    """Edges of the bins of the gap on a surface, m.

    The last bin reaches to the largest gap that there is when the surface just touches, its height from the deepest
    pit to the highest peak, if that is more than 31.6 h_rms. By Chebyshev's inequality less than 0.2 % of a surface
    lies so deep, so that this one bin is enough for it.
    """
    edges = GAP_BINS * surface.rms_height
    edges[-1] = max(edges[-1], np.ptp(surface.heights))
    return edges
