"""Section `materials`."""

from pydantic import (
    ConfigDict,
    Field,
)

from icha.support.values import (
    Length,
    Modulus,
    Section,
    SurfaceEnergy,
)


class MaterialSection(Section):
    """Elastic half-space and interface."""

    model_config = ConfigDict(title="Material")

    contact_modulus: Modulus = Field(description="Composite elastic modulus E*.")
    surface_energy: SurfaceEnergy = Field(description="Energy of adhesion Δγ per area; `0 J/m^2` is adhesionless.")
    interaction_range: Length = Field(
        description="Range ε of the attraction, which sets the separation at which asperities jump into contact. It "
        "gives a surface of rms curvature 1/R the Tabor parameter μ = (RΔγ²/E*²)^(1/3)/ε."
    )
