"""What a path yields: its equilibria, one after the other."""

from dataclasses import dataclass

from icha.contact.model import State
from icha.path.energy_balance import EnergyBalance
from icha.path.targets import BETWEEN, Target


@dataclass(frozen=True, eq=False)
class Waypoint:
    """An equilibrium on a path: what it was asked to reach, and on which leg (0 the first loading, 1 back, …).

    balance: of the energy, on a cyclic path.
    """

    target: Target
    state: State
    leg: int = 0
    balance: EnergyBalance | None = None

    @property
    def loading(self) -> bool:
        """Whether the surfaces are being pressed together."""
        return self.leg % 2 == 0


def between_stops(state: State, leg: int) -> Waypoint:
    """The waypoint of an equilibrium between the stops."""
    return Waypoint(Target(BETWEEN, state.separation), state, leg)
