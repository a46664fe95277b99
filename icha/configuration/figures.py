"""Section `figures`: one key for every figure of ICHA, and figures of the user's own.

A request is the section of one figure. It names the input files and the arguments with which `icha.figures.registry`
draws the figure, so that reading a configuration imports no figure. The docstring of a class and the description of its
key are in the schema.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import ConfigDict, Field

from icha.configuration.studies import is_unread
from icha.contact.models import MODELS, REFERENCE_MODEL, first_model
from icha.datasets import results
from icha.datasets.labels import RunLabels
from icha.path.snapshots import Snapshot
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS
from icha.support.scripts import caption_in, modules_of
from icha.support.values import File, Label, Name, Names, Positive, Problem, Section, Seed, list_names, unknown

if TYPE_CHECKING:
    from icha.configuration.campaign import Campaign
    from icha.configuration.measurements import Measurement
    from icha.configuration.studies import Study

# Keys that name one study or several.
_STUDY_KEYS = ("study", "boundary_elements", "load_studies", "studies")
_UNLOADED = "is not unloaded; expected a study with `unload: true`"
_COMPARED = "expected a study with both `models` and targets `reduced_pressures`"
_KIND = "has no snapshot of kind {kind}; expected a study with such a snapshot".format
# Conditions on a study, each with the problem of a study that does not meet it; `{models}` stands for its models.
_CONDITIONS: dict[str, tuple[Callable[[Study], Any], str]] = {
    "unloads completely": (lambda study: study.unload, _UNLOADED),
    "unloads": (lambda study: study.unload or study.turning_points, _UNLOADED),
    "boundary elements": (
        lambda study: REFERENCE_MODEL in study.models,
        f"has no runs with boundary elements; expected a study with {REFERENCE_MODEL!r} among its `models`",
    ),
    "both models": (lambda study: len(study.models) == len(MODELS), f"has only runs with {{models}}; {_COMPARED}"),
    "reduced pressures": (
        lambda study: study.targets.reduced_pressures,
        f"has no targets `reduced_pressures`, at which both models have the same load; {_COMPARED}",
    ),
    "snapshots": (lambda s: s.saved_states != [], "has no snapshot to draw; expected a study with `snapshots`"),
    "relative load": (lambda s: "relative_load" in dict(s.saved_states or ()), _KIND(kind="relative_load")),
    "area fraction": (lambda s: "area_fraction" in dict(s.saved_states or ()), _KIND(kind="area_fraction")),
    "sample": (lambda study: study.sample, "has no sampled cases; expected a study with `sample`"),
}


class FigureRequest(Section):
    """A figure."""

    # True if drawing needs memory for all heights of the surface.
    holds_topography: ClassVar[bool] = False
    # Conditions on the studies in a key, in addition to those of the base classes.
    needs: ClassVar[dict[str, tuple[str, ...]]] = {}

    def studies_by_key(self) -> Iterator[tuple[tuple, str]]:
        """Yield the location (keys) and the name of each study whose runs the figure shows."""
        for key in _STUDY_KEYS:
            value = getattr(self, key, None) or ()
            yield from [((key,), value)] if isinstance(value, str) else (((key, k), x) for k, x in enumerate(value))

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """Yield a problem for each option that does not fit the campaign, such as the name of an unknown study."""
        for location, name in self.studies_by_key():
            yield from unknown(location, name, campaign.studies)
            if (study := campaign.studies.get(name)) is None:
                continue
            if location == ("study",):
                yield from self._option_problems(campaign, study)
            needs = [vars(base).get("needs", {}).get(location[0], ()) for base in type(self).__mro__]
            for is_met, problem in (_CONDITIONS[each] for each in itertools.chain(*needs)):
                if not is_met(study):
                    yield location, name, problem.format(models=list_names(study.models))

    def _option_problems(self, campaign: Campaign, study: Study) -> Iterator[Problem]:
        """Yield a problem for each option that does not fit the study `study`."""
        yield from ()

    def _inputs(self, campaign: Campaign, files: results.ResultFiles) -> dict[str, str | list[str]]:
        """Return the path or the paths of input files, by argument of the function that draws."""
        return {"campaign": files.path(results.DATASET)}

    def arguments(self, campaign: Campaign) -> dict[str, Any]:
        """Return the keyword arguments of the function that draws, except the data."""
        return self.model_dump(exclude_none=True)


class JKRFigure(FigureRequest):
    """A figure of force and contact radius of one asperity against approach."""

    tabor_parameter: Positive = Field(default=3.0, description="Tabor parameter, which sets the jump-in distance.")

    def _inputs(self, campaign, files):
        return {}


class StudyFigure(FigureRequest):
    """A figure of all runs of a study."""

    study: Name = Field(description="Name of the study that is drawn.")

    def _option_problems(self, campaign, study):
        for key in ("surface", "seed", "material", "rms_slope"):
            value, present = getattr(self, key, None), getattr(study, f"{key}s")
            if value is not None and value not in present:
                yield (key,), value, f"is not in study {self.study!r}; expected one of {list_names(present)}"


class TheoryFigure(StudyFigure):
    """A figure of all runs of a study, with theories."""

    def _inputs(self, campaign, files):
        surface = campaign.studies[self.study].surfaces[0]
        theories = {"references": files.path(results.THEORIES, surface=surface)} if campaign.is_flat(surface) else {}
        return super()._inputs(campaign, files) | theories


class TruthFigure(StudyFigure):
    """A figure of all runs of a study, with boundary elements."""

    boundary_elements: Name | None = Field(
        default=None,
        description="Name of a study whose runs with boundary elements are also drawn, where it has the same surface, "
        "slope and material. Default: the study itself, if it has such runs.",
    )

    needs = {"boundary_elements": ("boundary elements",)}

    def _option_problems(self, campaign, study):
        yield from super()._option_problems(campaign, study)
        if (other := self.boundary_elements) not in campaign.studies:
            return
        own, others = (
            {(run.surface, run.rms_slope, run.material) for run in campaign.contacts(name)}
            for name in (self.study, other)
        )
        # Slopes of scans are compared once they are known.
        unknown = any(is_unread(slope) for _, slope, _ in own | others)
        if own.isdisjoint(others) and not unknown:
            expected = f"expected runs on the same surface, with the same slope and material as in study {self.study!r}"
            yield ("boundary_elements",), other, f"has no run to compare; {expected}"


class SnapshotFigure(StudyFigure):
    """A figure of one snapshot of a study."""

    snapshot: Snapshot | None = Field(default=None, description="Snapshot of the study. Default: the first one.")

    needs = {"study": ("snapshots",)}

    def _option_problems(self, campaign, study):
        yield from super()._option_problems(campaign, study)
        snapshots = study.saved_states or []
        if study.saved_states != [] and self.snapshot and self.snapshot.kind_and_value not in snapshots:
            kept = list_names(f"{kind} {value:g}" for kind, value in snapshots) or "none"
            kind, value = self.snapshot.kind_and_value
            problem = f"is not a snapshot of study {self.study!r}; expected one of: {kept}"
            yield ("snapshot",), f"{kind} {value:g}", problem

    def arguments(self, campaign):
        """Return the arguments with the `kind` and the `target` of the snapshot."""
        arguments = super().arguments(campaign)
        if arguments.pop("snapshot", None) is not None:
            arguments["kind"], arguments["target"] = self.snapshot.kind_and_value
        return arguments


class UnitsFigure(FigureRequest):
    """A figure in reduced or in physical units."""

    units: Literal["reduced", "physical"] = Field(
        default="reduced",
        description="`reduced`: loads in units of E* h'rms, separations in units of the rms height. `physical`: "
        "nominal pressures in Pa, and mean gaps (figure 13: mean separations) in m, with prefixes.",
    )


class TopographyFigure(StudyFigure):
    """A figure of one topography of a study."""

    surface: Label | None = Field(default=None, description="Surface to show. Default: the first surface of the study.")
    seed: Seed | None = Field(default=None, description="Seed to show. Default: the first seed of the study.")


class UnloadedFigure(StudyFigure):
    """A figure of the runs of a study in loading and unloading."""

    needs = {"study": ("unloads",)}


class RunFigure(TopographyFigure):
    """A figure of one run. ICHA draws the first run that fits the options, if possible a run with adhesion."""

    rms_slope: Positive | None = Field(default=None, description="Rms slope to show. Default: the study's first slope.")
    material: Label | None = Field(
        default=None, description="Material to show. Default: the first material with adhesion, if any."
    )
    holds_topography = True

    def _inputs(self, campaign, files):
        return super()._inputs(campaign, files) | {"surface": files.path(results.SURFACE, self.run(campaign))}

    def arguments(self, campaign):
        """Return the arguments with the labels of the run."""
        arguments = super().arguments(campaign)
        others = arguments.keys() - set(RunLabels._fields)
        return {name: arguments[name] for name in others} | {"run": tuple(self.run(campaign))}

    def run(self, campaign: Campaign) -> RunLabels:
        """Return the first run that fits the options; a run with adhesion is preferred."""
        wanted = self.model_dump(include=set(RunLabels._fields), exclude_none=True)
        wanted["model"] = first_model(campaign.studies[self.study].models)
        runs = [run for run in campaign.runs(self.study) if wanted.items() <= run._asdict().items()]
        return next((run for run in runs if campaign.materials[run.material].surface_energy > 0), runs[0])


class AreaAndGapFigure(UnitsFigure, TheoryFigure):
    """A figure of all runs of a study. In physical units, theories are shown if all runs have one modulus and slope."""


class MapFigure(SnapshotFigure, RunFigure):
    """A figure of one snapshot. ICHA draws the first run that fits the options, if possible a run with adhesion."""

    def _inputs(self, campaign, files):
        found, run = super()._inputs(campaign, files), self.run(campaign)
        if REFERENCE_MODEL in campaign.studies[self.study].models:
            found["truth"] = files.path(results.RUN, run._replace(model=REFERENCE_MODEL))
        return found


class MeasuredFigure(StudyFigure):
    """A figure of all runs of a study, with measurements."""

    # True if the figure shows measured values of indenters.
    of_indenters: ClassVar[bool] = False

    def _inputs(self, campaign, files):
        tables = [measurement.path for measurement in self.measurements(campaign)]
        return super()._inputs(campaign, files) | ({"tables": tables} if tables else {})

    def arguments(self, campaign):
        """Return the arguments with the `measurements`."""
        known = [self._known(campaign, each) for each in self.measurements(campaign)]
        return super().arguments(campaign) | ({"measurements": known} if known else {})

    def _known(self, campaign: Campaign, measurement: Measurement) -> dict[str, Any]:
        """Return the fields of `icha.figures.measured.Measured`, with columns and quantities instead of values."""
        known = {name: getattr(measurement, name) for name in ("label", "citation", "columns", "material", "rms_slope")}
        known["quantities"] = list(measurement.si_units)
        if material := campaign.materials.get(measurement.material):
            known["contact_modulus"] = material.contact_modulus if measurement.load_is_pressure else None
            known["works"] = material.surface_energy, material.receding_energy or material.surface_energy
        return known

    def measurements(self, campaign: Campaign) -> list[Measurement]:
        """Return the measurements that belong to the study and to the figure."""
        known = campaign.measurements.values()
        return [each for each in known if each.study == self.study and (each.load is None) == self.of_indenters]


class SlopesAndMaterialsFigure(MeasuredFigure, TruthFigure):
    """A figure of all runs of a study, with boundary elements and measurements."""


class SlopesFigure(TopographyFigure):
    """A figure of the spots of all slopes, at the same load and at the same area."""

    material: Label | None = Field(default=None, description="Material to show. Default: the study's first material.")

    needs = {"study": ("relative load", "area fraction")}


class ComparedFigure(StudyFigure):
    """A comparison with boundary elements. The study needs both models."""

    needs = {"study": ("both models", "reduced pressures")}

    def _inputs(self, campaign, files):
        return super()._inputs(campaign, files) | {"model_error": files.path(results.MODEL_ERROR)}


class LoopsFigure(UnitsFigure, TruthFigure, TopographyFigure, UnloadedFigure):
    """A figure of the runs of a study in loading and unloading, on one topography."""


class PullOffFigure(StudyFigure):
    """A figure of the pull-off pressure of all runs of some studies."""

    load_studies: Names | None = Field(
        default=None, description="Names of studies that differ in their largest load, for a second panel."
    )

    needs = dict.fromkeys(("study", "load_studies"), ("unloads completely",))


class LossFigure(FigureRequest):
    """A figure of the energy lost in a cycle of loading and unloading, for all runs of some studies."""

    studies: Names
    """Names of the studies that are drawn. Lines are fitted to runs that differ only in their largest load."""

    needs = {"studies": ("unloads completely",)}


class SnapMapFigure(RunFigure, UnloadedFigure):
    """A figure of jumps and unions in one run: the first run that fits the options, if possible with adhesion."""


class IndenterFigure(MeasuredFigure, UnloadedFigure):
    """A figure of the runs of a study with indenters, in loading and unloading, with measurements."""

    of_indenters = True

    def _option_problems(self, campaign, study):
        yield from super()._option_problems(campaign, study)
        if periodic := [name for name in study.surfaces if not campaign.is_free(name)]:
            expected = "expected surfaces with `shape` or `boundary: free`"
            yield ("study",), self.study, f"has the periodic surface {periodic[0]!r}; {expected}"


class PressureMapsFigure(RunFigure):
    """A figure of one run with boundary elements, with a map for each of its snapshots."""

    needs = {"study": ("boundary elements", "snapshots")}

    def _inputs(self, campaign, files):
        run = files.path(results.RUN, self.run(campaign))
        return {"campaign": files.path(results.DATASET), "maps": run}

    def run(self, campaign):
        """Return the first run with boundary elements that fits the options; a run with adhesion is preferred."""
        return super().run(campaign)._replace(model=REFERENCE_MODEL)


class SampleFigure(StudyFigure):
    """A figure of the sampled cases of a study."""

    target: int = Field(default=-1, ge=-1, description="Number of the target, from 0. Default (-1): the last target.")

    def _inputs(self, campaign, files):
        return {"sensitivity": files.path(results.SENSITIVITY)}

    needs = {"study": ("sample",)}

    def _option_problems(self, campaign, study):
        last = len(study.targets.states) - 1
        if self.target > last:
            yield ("target",), self.target, f"is not the number of a target; expected -1, 0, … {last}"


class ParametersFigure(SampleFigure):
    """A figure of one result of the sampled cases of a study."""

    quantity: Literal[(*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS)] = Field(
        default="contact_area_fraction", description="Result to show."
    )

    def _option_problems(self, campaign, study):
        yield from super()._option_problems(campaign, study)
        if self.quantity in ESTIMATED_OF_LOOPS and not study.unload:
            yield ("quantity",), self.quantity, "is a quantity of a loop; expected a study with `unload: true`"


class OwnFigure(StudyFigure):
    """A figure of your own. The key is the name of its files."""

    script: File = Field(
        description="Python file with a function `draw(study)`. The function receives the dataset of the study "
        "(xarray.Dataset), and returns a figure of matplotlib. Its docstring is the caption. The file may import "
        "modules in its folder. The path is relative to the configuration file."
    )

    def _inputs(self, campaign, files):
        return super()._inputs(campaign, files) | {"script": self.script}

    def arguments(self, campaign):
        """Return the name of the study; the script is an input."""
        return {"study": self.study}


class Figures(Section):
    """Figures of the campaign by name. ICHA draws only these figures. Other names are figures of your own."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[Name, OwnFigure]
    fig1_jkr: JKRFigure | None = None
    """Force and radius of one asperity against approach."""
    fig2_area_and_gap: AreaAndGapFigure | None = None
    """Contact area and mean separation against load, with theories, and differences between the models."""
    fig3_distributions: SnapshotFigure | None = None
    """Distributions of gap and pressure of every material, on the study's first surface."""
    fig4_contact_map: MapFigure | None = None
    """Contact spots over the topography."""
    fig5_multi_slope: SlopesAndMaterialsFigure | None = None
    """Contact area against load for all slopes and materials, with measurements."""
    fig6_spots_by_slope: SlopesFigure | None = None
    """Contact spots of all slopes at the same load and at the same area. The study needs snapshots of kinds
    relative_load and area_fraction."""
    fig7_stiffness: TheoryFigure | None = None
    """Contact stiffness against load, with a theory."""
    fig8_patch_sizes: SnapshotFigure | None = None
    """Sizes of the contact patches of every material, on the study's first surface."""
    fig9_tabor: SnapshotFigure | None = None
    """Contact area and mean separation against the Tabor parameter, for studies whose materials differ in
    `interaction_range`. For smooth spheres that are pulled off: pull-off force and loss."""
    fig10_model_error: ComparedFigure | None = None
    """Error of contact area and mean separation of the asperity model, relative to boundary elements."""
    fig11_distribution_error: ComparedFigure | None = None
    """Differences of distributions and contact maps between the asperity model and boundary elements."""
    fig13_loops: LoopsFigure | None = None
    """Pressure against mean separation and contact area against load, in loading and unloading."""
    fig14_pull_off: PullOffFigure | None = None
    """Pull-off pressure against rms slope, and against the largest load."""
    fig15_loss: LossFigure | None = None
    """Energy lost in a cycle against the largest contact area, and the causes of the loss."""
    fig16_snap_map: SnapMapFigure | None = None
    """Where and when spots of one run snap into and out of contact."""
    fig17_force_indentation: IndenterFigure | None = None
    """Force against indentation of indenters, in loading and unloading, with Hertz and JKR."""
    fig18_jkr_plot: IndenterFigure | None = None
    """Linearised JKR plot of spherical indenters, with fits to loading and unloading."""
    fig19_work_of_adhesion: IndenterFigure | None = None
    """Apparent work of adhesion of spherical indenters against the rms height of their roughness."""
    fig20_pressure_maps: PressureMapsFigure | None = None
    """Maps of the contact pressure of a run with boundary elements, at all its snapshots."""
    fig21_sensitivity: SampleFigure | None = None
    """Share of the variance of each result that each sampled parameter causes, alone and in all."""
    fig22_parameters: ParametersFigure | None = None
    """A result of the sampled cases against each sampled parameter, with its mean over the others."""

    def by_name(self) -> dict[str, FigureRequest]:
        """Return the request of each figure to draw, by the name of the figure."""
        drawn = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: request for name, request in drawn.items() if request is not None} | self.model_extra

    def script_problems(self) -> Iterator[Problem]:
        """Yield a problem for each script that cannot draw a figure."""
        for name, own in self.model_extra.items():
            try:
                caption_in(own.script)
                modules_of(own.script)
            except ValueError as error:
                yield ("figures", name, "script"), own.script, str(error)
            if results.figure_number(name):
                yield ("figures", name), name, "begins like the name of a figure of ICHA; expected another name"


def drawing(campaign: Campaign, name: str, files: results.ResultFiles) -> dict[str, Any]:
    """Return the arguments of `icha.figures.registry.draw_figure` for a figure, without the paths of its files."""
    request = campaign.figures.by_name()[name]
    studies = tuple(dict.fromkeys(study for _, study in request.studies_by_key()))
    data, arguments = request._inputs(campaign, files), request.arguments(campaign)
    return {"name": name, "inputs": data, "arguments": arguments, "studies": studies}
