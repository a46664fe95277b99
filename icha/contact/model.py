"""The interface of a model of contact: what a path needs to know of it to follow it."""

from dataclasses import dataclass
from typing import Protocol, TypeVar

from icha.contact.events import Events

# Quantities that a solve can hold.
PRESSURE, AREA_FRACTION = "pressure", "area_fraction"


@dataclass(frozen=True)
class Control:
    """A quantity to hold in the place of the mean separation: PRESSURE (nominal, Pa) or AREA_FRACTION, its target."""

    quantity: str
    target: float


class State(Protocol):
    """An equilibrium, immutable; all else that it holds is its model's own."""

    @property
    def separation(self) -> float:
        """Mean separation u, m."""


S = TypeVar("S", bound=State)


class ContactModel(Protocol[S]):
    """A contact problem, immutable, whose equilibria follow from each other along a path. Nominal area: A0."""

    @property
    def adhesive(self) -> bool:
        """Whether contact forms and breaks in jumps."""

    @property
    def contact_modulus(self) -> float:
        """E*, the unit of relative loads, Pa."""

    @property
    def rms_height(self) -> float:
        """Rms height h_rms of the surface, the unit of separations, m."""

    @property
    def area(self) -> float:
        """Nominal contact area A0, m^2."""

    @property
    def largest_area_fraction(self) -> float:
        """Contact area over nominal area beyond which the model covers no state."""

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
