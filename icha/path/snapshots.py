"""Snapshots in a configuration: states of a path whose distributions are saved."""

from typing import Literal

from pydantic import Field, model_validator

from icha.path.targets import QUANTITIES, UNLOADING
from icha.support.rules import INDENTATIONS, NUMBER
from icha.support.values import Force, Length, Pressure, Section, exactly_one, number, quantity

ReducedPressure = number(QUANTITIES["reduced_pressure"].rule)
AreaFraction = number(QUANTITIES["area_fraction"].rule)
Indentation = quantity(INDENTATIONS, "1 um")


class PathState(Section):
    """A state of a path. Exactly one key must be given. Tensile loads are negative."""

    reduced_pressure: ReducedPressure | None = Field(  # type: ignore[valid-type]
        default=None, description="Reduced pressure of the state, in the unit of targets."
    )
    relative_load: number(NUMBER) | None = Field(  # type: ignore[valid-type]
        default=None, description="Relative load p/E* = F/(E* A0) of the state, independent of the surface slope."
    )
    area_fraction: AreaFraction | None = Field(  # type: ignore[valid-type]
        default=None, description="Contact area fraction A/A0 of the state."
    )
    mean_separation: Length | None = Field(default=None, description="Mean separation of the state, with its unit.")
    pressure: Pressure | None = Field(default=None, description="Nominal pressure F/A0 of the state, such as `10 kPa`.")
    force: Force | None = Field(default=None, description="Normal force of the state, such as `1 mN`.")
    indentation: Indentation | None = Field(  # type: ignore[valid-type]
        default=None,
        description="Indentation of the state, such as `1 um`: the negative separation. A negative indentation means "
        "that the undeformed surfaces do not touch.",
    )
    contact_radius: Length | None = Field(
        default=None, description="Contact radius √(A/π) of the state, with its unit; A is the contact area."
    )

    _check = model_validator(mode="after")(exactly_one)

    @property
    def kind_and_value(self) -> tuple[str, float]:
        """Key and value (SI units) that define the state."""
        ((kind, value),) = self.model_dump(exclude_none=True, exclude={"branch"}).items()
        return kind, value


class Snapshot(PathState):
    """A state whose spots and distributions are saved. One key besides `branch` must be given; tension is negative."""

    branch: Literal["loading", "unloading"] = Field(
        default="loading",
        description="Branch of the state: `loading` is the first loading, `unloading` is the last unloading of a study "
        "with `unload: true`.",
    )

    @property
    def kind_and_value(self) -> tuple[str, float]:
        """Kind and value of the state; the kind of a state on unloading begins with UNLOADING."""
        kind, value = super().kind_and_value
        return (kind if self.branch == "loading" else f"{UNLOADING}{kind}"), value
