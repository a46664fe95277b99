"""The interface of what a run keeps of the states of a model, beyond what a path needs to know of it."""

from collections.abc import Iterable
from typing import Any, Protocol

from icha.contact.model import ContactModel, S
from icha.surfaces.summits import Asperities


def summit_counts(asperities: Asperities) -> dict[str, int]:
    """Numbers of the summits of a surface, by the names of their variables."""
    return {"asperity_count": len(asperities), "unsupported_summit_count": len(asperities.unsupported_height)}


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

    def reasons_against(self, separations: Iterable[float]) -> list[str]:
        """Reasons why the model does not stand for the surface at these mean separations (m) of the first loading."""

    @property
    def largest_tension(self) -> float:
        """Tension of all summits pulling their most at once, 3/2 pi dgamma sum(R)/A0, Pa."""
