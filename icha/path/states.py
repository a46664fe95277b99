"""States of a path as a configuration names them."""

from pydantic import Field, model_validator

from icha.path.targets import QUANTITIES
from icha.support.values import Length, Positive, Section, exactly_one, number

ReducedPressure = number(QUANTITIES["reduced_pressure"].rule)
AreaFraction = number(QUANTITIES["area_fraction"].rule)


class Snapshot(Section):
    """A state whose spots and distributions of gap and pressure are saved: exactly one of the four keys."""

    reduced_pressure: ReducedPressure | None = Field(  # type: ignore[valid-type]
        default=None, description="At this p/(E* h'rms)."
    )
    relative_load: Positive | None = Field(
        default=None, description="At this p/E* = F/(E* A0), the same load for surfaces of different slope."
    )
    area_fraction: AreaFraction | None = Field(  # type: ignore[valid-type]
        default=None, description="At this contact area fraction A/A0."
    )
    mean_separation: Length | None = Field(default=None, description="At this mean separation, with its unit.")

    _check = model_validator(mode="after")(exactly_one)

    @property
    def kind_and_value(self) -> tuple[str, float]:
        """Kind and value (SI units) of the state."""
        ((kind, value),) = self.model_dump(exclude_none=True).items()
        return kind, value
