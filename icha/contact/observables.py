"""The interface of what a run keeps of the states of a model, beyond what a path needs to know of it."""

from typing import Any, Protocol

from icha.contact.model import ContactModel, S


class Observables(Protocol[S]):
    """Observables of a contact, by the names of a run's variables (`icha.datasets.variables.run`)."""

    @property
    def contact(self) -> ContactModel[S]:
        """The contact that they are of."""

    def of_contact(self) -> dict[str, Any]:
        """What holds for all states."""

    def of_step(self, state: S) -> dict[str, Any]:
        """What a run keeps of every state."""

    def of_snapshot(self, state: S) -> dict[str, Any]:
        """Distributions of gap and pressure, and the spots."""

    @property
    def largest_tension(self) -> float:
        """Tension of all summits pulling their most at once, 3/2 pi dgamma sum(R)/A0, Pa."""
