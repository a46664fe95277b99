"""The section of figures."""

from __future__ import annotations

from pydantic import Field

from icha.figures.options import (
    ComparedFigure,
    JKRFigure,
    LoopsFigure,
    LossFigure,
    MapFigure,
    PullOffFigure,
    SlopesFigure,
    SnapMapFigure,
    SnapshotFigure,
    SourcesFigure,
    StudyFigure,
    TaborFigure,
)
from icha.support.values import Section


class Figures(Section):
    """The figures of the campaign; those that are left out are not drawn."""

    fig1_jkr: JKRFigure | None = Field(default=None, description="Force and radius of one asperity against approach.")
    fig2_area_and_gap: StudyFigure | None = Field(
        default=None, description="Contact area and mean separation against load, with theories."
    )
    fig3_distributions: SnapshotFigure | None = Field(
        default=None, description="Distributions of gap and pressure of every material, on the study's first surface."
    )
    fig4_contact_map: MapFigure | None = Field(default=None, description="Contact spots over the topography.")
    fig5_multi_slope: StudyFigure | None = Field(
        default=None, description="Contact area against load for all slopes and materials, with measurements."
    )
    fig6_spots_by_slope: SlopesFigure | None = Field(
        default=None,
        description="Contact spots of all slopes at the same load and at the same area. The study needs snapshots of "
        "kinds relative_load and area_fraction.",
    )
    fig7_stiffness: StudyFigure | None = Field(default=None, description="Contact stiffness against load, with theory.")
    fig8_patch_sizes: SnapshotFigure | None = Field(
        default=None,
        description="Sizes of the contact patches of every material, on the study's first surface.",
    )
    fig9_tabor: TaborFigure | None = Field(
        default=None,
        description="Contact area and mean separation against the Tabor parameter. The study needs materials with "
        "adhesion that differ in their `interaction_range`.",
    )

    fig10_model_error: ComparedFigure | None = Field(
        default=None,
        description="Relative error of contact area and mean separation against boundary elements. The study needs "
        "`boundary_elements`.",
    )
    fig11_distribution_error: ComparedFigure | None = Field(
        default=None,
        description="How far distributions of pressure and gap and the contact map are from those of boundary "
        "elements. The study needs `boundary_elements`.",
    )

    fig12_error_sources: SourcesFigure | None = Field(
        default=None, description="From the model to boundary elements, one thing at a time."
    )

    fig13_loops: LoopsFigure | None = Field(
        default=None, description="Pressure and contact area against mean separation, both ways."
    )
    fig14_pull_off: PullOffFigure | None = Field(
        default=None, description="Pull-off against rms slope, and against the largest load."
    )
    fig15_loss: LossFigure | None = Field(
        default=None, description="Energy lost in a loop against contact area, and what it was lost in."
    )
    fig16_snap_map: SnapMapFigure | None = Field(
        default=None, description="Where and when spots of one run snap into and out of contact."
    )

    def drawn(self) -> dict[str, Section]:
        """The figures that are drawn, by name."""
        return {name: getattr(self, name) for name in type(self).model_fields if getattr(self, name) is not None}
