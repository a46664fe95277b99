"""Interface of contact models: the methods that a path uses, and the values that a run records."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from icha.contact.models import PathAccuracy
    from icha.surfaces.shapes import Shape
    from icha.surfaces.summits import Asperities
    from icha.surfaces.surface import Surface

# Quantities that can be prescribed instead of the mean separation.
PRESSURE, AREA_FRACTION = "pressure", "area_fraction"


@dataclass(frozen=True)
class Control:
    """Quantity that is prescribed instead of the mean separation.

    Attributes
    ----------
    quantity : PRESSURE (nominal pressure, Pa) or AREA_FRACTION (contact area divided by nominal area).
    target : prescribed value of the quantity.
    """

    quantity: str
    target: float


class NotConverged(Exception):
    """Error: an equilibrium was not found."""


class BeyondModel(NotConverged):
    """Error: physics ends the path, or the next target is outside the range of the model. The path so far is valid."""


class FullContact(NotConverged):
    """Error: the contact has spread over the whole surface."""


# Kinds of events, and their names.
JUMP_IN, JUMP_OFF, COALESCENCE, SPLIT = range(4)
EVENT_KINDS = ("jump_in", "jump_off", "coalescence", "split")


@dataclass(frozen=True, eq=False)
class Events:
    """The k events (jumps, coalescences and splits) between two equilibria.

    Attributes
    ----------
    kind : (k,) int8, JUMP_IN: a spot forms. JUMP_OFF: a spot or a union breaks contact. COALESCENCE: two spots unite.
        SPLIT: a union becomes two spots again.
    position : (k, 2) float, m.
    members : (k,) int, number of asperities united in the spot; with boundary elements, number of summits in the spot.
    energy : (k,) float, energy that a jump would release if the spot were alone, J; zero for unions and splits.
    """

    kind: np.ndarray
    position: np.ndarray
    members: np.ndarray
    energy: np.ndarray

    def __len__(self) -> int:
        """Return the number of events."""
        return len(self.kind)

    def count(self, kind: int) -> int:
        """Return the number of events of a kind."""
        return int(np.count_nonzero(self.kind == kind))

    def counts(self) -> np.ndarray:
        """Return the numbers of events of all kinds, in the order of EVENT_KINDS."""
        return np.bincount(self.kind, minlength=len(EVENT_KINDS))

    @classmethod
    def concatenate(cls, parts) -> Events:
        """Join several `Events` into one, in the given order."""
        parts = [cls(np.empty(0, np.int8), np.empty((0, 2)), np.empty(0, int), np.empty(0)), *parts]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__match_args__))


class State(Protocol):
    """Equilibrium of a contact; each model adds further attributes. A state never changes.

    Attributes
    ----------
    separation : mean separation u, m.
    history : events of the path up to this state, one entry for each equilibrium with events.
    """

    separation: float
    history: tuple[Events, ...]


def events_between(before: State, after: State) -> Events:
    """Return the events on the path from one state to a later state."""
    return Events.concatenate(after.history[len(before.history) :])


class ContactModel(Protocol):
    """Contact of one surface and one material. A path computes each equilibrium from the previous one.

    Attributes
    ----------
    adhesive : whether there is adhesion.
    is_unique : whether each load has only one equilibrium, which does not depend on the path.
    spots_jump : whether a spot forms and breaks in a jump in which it loses energy; not at a finite range of
        attraction, where contact forms and breaks gradually.
    contact_modulus : E*, the unit of relative loads, Pa.
    pressure_unit : E* h'_rms, the unit of reduced pressures, Pa.
    rms_height : unit of separations, m: rms height of the surface, with a shape `Surface.unit_height`.
    shape : shape that carries the roughness; None for a nominally flat surface.
    asperities : summits of the surface; there may be none if the model does not need them.
    area : nominal contact area A0, m^2.
    largest_area_fraction : the model is not valid if contact area divided by nominal area exceeds this value.
    area_step : smallest change of the contact area divided by nominal area; 0 if the area is continuous.
    path_accuracy : accuracy with which a path resolves its events.
    """

    adhesive: bool
    is_unique: bool
    spots_jump: bool
    contact_modulus: float
    pressure_unit: float
    rms_height: float
    shape: Shape | None
    asperities: Asperities
    area: float
    largest_area_fraction: float
    area_step: float
    path_accuracy: PathAccuracy

    def untouched(self) -> State:
        """Return the state without contact at the separation of first contact."""

    def equilibrium(self, state: State, separation: float, control: Control | None = None, *, let_go: int = 0) -> State:
        """Find the equilibrium at another mean separation, load or area, starting from a state.

        Raise `NotConverged` if there is no equilibrium, and `FullContact` if contact spreads over the whole surface.

        Parameters
        ----------
        separation : mean separation, or its first guess if there is a `control`, m.
        control : load or area that is prescribed instead of the separation.
        let_go : number of spots that break contact before the search; they are the spots closest to jump-off.
        """

    def continue_from(self, state: State, before: State) -> State | None:
        """Return `state` as a continuation of the state `before`, or None if it must be computed again.

        Its history is the history of `before`, followed by the events between both states.
        """

    def pressure(self, state: State) -> float:
        """Return the force divided by the nominal area, Pa; negative in tension."""

    def area_fraction(self, state: State) -> float:
        """Return the contact area divided by the nominal area."""

    def mean_gap(self, state: State) -> float:
        """Return the mean gap over the nominal area, m; on a periodic surface, this is the mean separation."""

    def spot_count(self, state: State) -> int:
        """Return the number of contact spots."""

    def stiffness(self, state: State) -> float:
        """Return the contact stiffness -dp/du of the present spots, Pa/m."""

    def slope(self, quantity: str, state: State) -> float:
        """Return d(quantity)/d(mean separation) while no event occurs; `quantity` is PRESSURE or AREA_FRACTION."""

    def stored_energy(self, state: State) -> float:
        """Return elastic energy minus energy of adhesion per nominal area, J/m^2; zero without contact."""

    def front_dissipation(self, state: State) -> float:
        """Return what receding fronts have dissipated so far, J/m^2 of nominal area; 0 with one work of adhesion."""

    def is_unstable(self, state: State) -> bool:
        """Return whether a spot is unstable: the approach of the spot grows while the surfaces move apart."""

    def reason_beyond(self, state: State) -> str:
        """Return the reason why a state is outside the range of the model, for the user; empty inside the range."""

    def observables(self, surface: Surface) -> Observables:
        """Return the object that computes the values that a run records of its states."""


class Observables(Protocol):
    """Values that a run records of a contact. The keys are names of variables in `icha.datasets.variables.run`."""

    def of_contact(self) -> dict[str, Any]:
        """Return the values that are the same in all states."""

    def of_step(self, state: State) -> dict[str, Any]:
        """Return the values that a run records of every state."""

    def of_snapshot(self, state: State) -> dict[str, Any]:
        """Return the distributions of gap and pressure in a state, and the properties of its spots."""

    def reasons_against(self, separations: Iterable[float], pressed: State | None) -> list[str]:
        """Return reasons (sentences for the user) why the model does not represent the surface in the first loading.

        Parameters
        ----------
        separations : mean separations that the loading has reached, m.
        pressed : state with the largest contact area; None if there is no state.
        """


# Edges of the bins of gap and pressure, the same for every model. The last bin includes all larger values. Gaps are in
# h_rms: the first bin starts at zero, and then there are 20 bins per decade. Pressures are in E* h'_rms: the bins
# have equal width from -1 to 5, and there are 20 bins per decade in the tails, up to 500 in magnitude. The first bin
# includes all lower pressures: at the edge of a JKR spot the pressure is minus infinity, and the density falls as
# |p|^-3.
GAP_BINS = np.concatenate([[0.0], np.logspace(-4, 1.5, 111)])
PRESSURE_BINS = np.concatenate([-np.logspace(2.7, 0, 55)[:-1], np.linspace(-1, 5, 301), 5 * np.logspace(0, 2, 41)[1:]])


def gap_bins(surface: Surface) -> np.ndarray:
    """Return the edges of the gap bins for a surface, m.

    When the surfaces just touch, the largest gap is the height from the deepest pit to the highest peak. If this gap is
    more than 31.6 h_rms, the last bin ends at this gap. At separations up to 9 h_rms, the last bin contains less than
    0.2 % of the undeformed surface (Chebyshev's inequality).
    """
    edges, profile = GAP_BINS * surface.unit_height, surface.profile
    edges[-1] = max(edges[-1], np.ptp(profile[np.isfinite(profile)]))
    return edges
