"""How far a path has come, to show its progress and to say why it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from icha.contact.model import ContactModel, NotConverged, State
from icha.path.bracketing import InsideJump
from icha.path.stops import Queue, Stop
from icha.path.targets import Target

# A step that does not converge is halved down to this fraction of the longest one.
_SMALLEST_STEP = 2.0**-14
# So many equilibria within a longest step, without a stop, and a path makes no progress.
_MOST_EQUILIBRIA = 2000


@dataclass(frozen=True, eq=False)
class Course:
    """Stops met so far, of how many; those that were missed, as they lie inside jumps.

    longest: step of the separation, m. idle: equilibria since the last stop or since the separation `mark`, m, from
    which the path has not come a longest step yet.
    """

    contact: ContactModel
    total: int
    longest: float
    progress: Callable[[str], None] | None = None
    reached: int = 0
    missed: tuple[InsideJump, ...] = ()
    mark: float = np.inf
    idle: int = 0

    def after(self, state: State, loading: bool) -> Course:
        """After one more equilibrium; refuses to go on where the path makes no progress."""
        if abs(state.separation - self.mark) >= self.longest:
            return replace(self, mark=state.separation, idle=0)
        if self.idle == _MOST_EQUILIBRIA:
            within = f"{self.longest / self.contact.rms_height:.3g} h_rms"
            raise self.ended(state, loading, NotConverged(f"no progress: {self.idle} equilibria within {within}"))
        return replace(self, idle=self.idle + 1)

    def met(self, target: Target, state: State) -> Course:
        """After one more stop."""
        after = replace(self, reached=self.reached + 1, idle=0)
        after.tell(f"stop {after.reached} of {self.total}: {target.named(6)}", state)
        return after

    def without(self, jump: InsideJump) -> Course:
        """After a stop that is left out."""
        return replace(self, missed=(*self.missed, jump))

    def tell(self, name: str, state: State) -> None:
        """Tell where the path is."""
        if self.progress is not None:
            contact = self.contact
            self.progress(
                f"{name}, separation {state.separation / contact.rms_height:.4f} h_rms, "
                f"A/A0 {contact.area_fraction(state):.4e}, {contact.spot_count(state)} spots"
            )

    def require_covered(self, before: State, after: State, stop: Stop | None, waiting: Queue, loading: bool) -> None:
        """Refuse a state that the model does not cover, at a stop or before stops that are still to come."""
        contact = self.contact
        what = (stop or waiting.foremost[0]).target.named() if stop or waiting else "separation"
        area = contact.area_fraction(after)
        if area > contact.largest_area_fraction:
            reason = f"the contact area runs to {area:.2f} of the nominal one, beyond what the model covers,"
            raise self.ended(before, loading, NotConverged(f"{reason} before {what}"))
        if stop is None and contact.mean_gap(after) <= 0:
            reason = f"the mean planes met before {what}, beyond what the model covers"
            raise self.ended(after, loading, NotConverged(reason))

    def ended(self, state: State, loading: bool, *failures: NotConverged) -> NotConverged:
        """Where the path ended and why; says so if the surfaces stick together by themselves."""
        contact, failures = self.contact, (*self.missed, *failures)
        sticky = ""
        # Without a load, adhesion alone has spread the contact, or the very first one does not come to rest.
        lone = contact.spot_count(state) == 0 and not any(isinstance(failure, InsideJump) for failure in failures)
        if contact.adhesive and loading and (contact.pressure(state) < 0 or lone):
            sticky = (
                "; the load is not yet compressive: the surface is sticky, adhesion is pulling it towards full contact"
            )
        return NotConverged(
            f"at a mean separation of {state.separation / contact.rms_height:.4f} h_rms, "
            f"A/A0 = {contact.area_fraction(state):.3g}, after {self.reached} of {self.total} stops: "
            f"{'; '.join(map(str, failures))}{sticky}"
        )


def halved(step: float, longest: float, failure: NotConverged) -> float:
    """Half the step, after an equilibrium was not found; raises the failure where no shorter step helps."""
    if step / 2 < _SMALLEST_STEP * longest:
        raise failure
    return step / 2
