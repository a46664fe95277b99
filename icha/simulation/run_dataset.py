"""Dataset of a run: values of surface, material, steps, snapshots, spots and events, with their descriptions."""

import math
from collections.abc import Sequence

import numpy as np

from icha.asperity.full_contact import full_contact_energy_ratio
from icha.asperity.material import Material
from icha.asperity.stickiness import stickiness
from icha.checks.applicability import asperity_applicability
from icha.contact.attraction import attraction_on
from icha.contact.model import GAP_BINS, PRESSURE_BINS, Events, gap_bins
from icha.contact.models import MODELS
from icha.datasets.attributes import COMPUTED, file_attributes
from icha.datasets.build import bin_values, build_dataset, concatenate_rows, get_values, stack_rows
from icha.datasets.variables.run import CYCLE, FURTHER, INDENTER, OF_SOME, RUN
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS, Table
from icha.half_space.layer import softness_of
from icha.path.targets import BETWEEN, UNITS, Path
from icha.references.indenter_runs import sphere_radius
from icha.references.limits import tabor_parameter_of
from icha.simulation.record import PULL_OFF, PathRecord
from icha.surfaces.moments import height_statistics, slope_anisotropy, spectral_moments
from icha.surfaces.resolution import shortest_wave
from icha.surfaces.surface import Surface

_STICKINESS_PAPER = "L. Pastewka and M. O. Robbins, PNAS 111 (2014) 3298-3303, doi:10.1073/pnas.1320846111 (stickiness)"


def run_dataset(surface, material, path, name, seed, record, summits, reasons, of_contact):
    """Build the dataset of a run from the record of its path, without the values of pull-off and hysteresis loss.

    name : name of the model.
    summits : summits of the surface.
    reasons : reasons why the model does not represent the surface.
    of_contact : values that are the same in all states.
    """
    table = RUN | FURTHER[name]
    nodes = np.arange(surface.grid) * surface.spacing
    values = {
        **{axis: nodes for axis in ("x", "y") if axis in table},
        **_path_values(table, path, record, surface.grid),
        **_indenter_values(surface, record.steps),
        **_surface_values(surface, material, seed),
        **of_contact,
        "asperity_count": len(summits),
        "unsupported_summit_count": len(summits.unsupported_height),
        **bin_values("gap", gap_bins(surface)),
        **bin_values("pressure", PRESSURE_BINS * (material.contact_modulus * surface.unit_slope)),
    }
    dataset = build_dataset(
        table | CYCLE | OF_SOME | _describe_targets(table, path), values, _attributes(surface, material, path, name)
    )
    if MODELS[name].by_summits:
        largest = max((step["contact_area_fraction"] for step in record.steps), default=0.0)
        gap = min((step["mean_gap"] for step in record.steps), default=math.inf) / surface.unit_height
        applicability = asperity_applicability(values["full_contact_energy_ratio"], reasons, largest, gap)
    else:
        applicability = f"{MODELS[name].words} not applicable: {'; '.join(reasons)}" if reasons else ""
    dataset.attrs["applicability"] = applicability
    if not record.failure:
        return dataset
    return dataset.assign_attrs({"beyond_model" if record.beyond_model else "incomplete": record.failure})


def _path_values(table: Table, path: Path, record: PathRecord, grid: int) -> dict:
    """Return the values of all steps, snapshots, spots and events as arrays, by variable name."""
    sizes = {"gap_bin": len(GAP_BINS) - 1, "pressure_bin": len(PRESSURE_BINS) - 1, "row": grid, "column": grid}
    values = {"control": path.control}
    values |= stack_rows(table, record.steps, "step") | stack_rows(table, record.snapshots, "snapshot", sizes)
    values |= concatenate_rows(table, record.snapshots, "spot", "snapshot")
    if not path.cyclic:
        return values
    counts, events = np.array([len(each) for each in record.events], int), Events.concatenate(record.events)
    return values | {
        **stack_rows(CYCLE, record.steps, "step"),
        "event_kind": events.kind,
        "event_step": np.repeat(np.arange(len(record.steps)), counts),
        "event_separation": np.repeat([step["mean_separation"] for step in record.steps], counts),
        "event_x": events.position[:, 0],
        "event_y": events.position[:, 1],
        "event_members": events.members,
    }


def _indenter_values(surface: Surface, steps: Sequence[dict]) -> dict:
    """Return the values of all steps as experiments have them, and the shape, by variable name; {} if periodic."""
    if not surface.free:
        return {}
    # Models leave out values that they do not have.
    names = [name for name, described in INDENTER.items() if described.dims and (not steps or name in steps[0])]
    values = stack_rows({name: INDENTER[name] for name in names}, steps, "step") if steps else {}
    if surface.shape is not None:
        values["shape"] = str(surface.shape)
    radius = sphere_radius(surface)
    return values if radius is None else values | {"shape_radius": radius}


def _describe_targets(table: Table, path: Path) -> Table:
    """Return the descriptions of `step_target` and `snapshot_target`; the units depend on the targets of the path."""
    steps = {target.kind for target in (*path.targets, *path.turning_points)} | ({BETWEEN} if path.cyclic else set())
    snapshots = {target.snapshot_kind for target in (*path.targets, *path.unloading_snapshots) if target.snapshot}
    snapshots |= {PULL_OFF} if path.unload else set()
    return {
        "step_target": table["step_target"]._replace(**_target_unit(steps, "step_kind")),
        "snapshot_target": table["snapshot_target"]._replace(**_target_unit(snapshots, "snapshot_kind")),
    }


def _target_unit(kinds: set[str], named_by: str) -> dict:
    """Return the unit of targets of these kinds; if units differ, add a comment that lists the kinds with a unit."""
    units = {UNITS.get(kind, "1") for kind in kinds}
    if len(units) <= 1:
        return {"units": units.pop() if units else "1"}
    parts = [
        f"in {unit} where {named_by} is {' or '.join(sorted(kind for kind in kinds if UNITS.get(kind) == unit))}"
        for unit in sorted(units - {"1"}, reverse=True)
    ]
    return {"units": "1", "further": {"comment": f"{', '.join(parts)}, else 1"}}


def _surface_values(surface: Surface, material: Material, seed: int) -> dict:
    """Return the values of the surface and the material, by variable name."""
    layer = {"layer_thickness": material.thickness, "layer_poisson_ratio": material.poisson_ratio}
    kind = {"adhesion_map_kind": material.adhesion_map.kind} if material.adhesion_map else {}
    moments, (skewness, kurtosis) = spectral_moments(surface), height_statistics(surface)
    wavelength, estimated = shortest_wave(surface)
    energy, complete = surface.full_contact(softness_of(material))
    complete *= material.contact_modulus
    return {
        **get_values(material, *MATERIAL, "flaw_radius"),
        **get_values(surface, *ROUGHNESS, "unit_height", "unit_slope", "period", "boundary", "grid"),
        "seed": seed,
        "short_wavelength": wavelength,
        "short_wavelength_estimated": int(estimated),
        "spectral_moment_0": moments.m0,
        "spectral_moment_2": moments.m2,
        "spectral_moment_4": moments.m4,
        "nayak_parameter": moments.nayak_parameter,
        "receding_energy": material.receding.surface_energy,
        "tabor_parameter": tabor_parameter_of(surface, material),
        "stickiness": stickiness(moments, material),
        "full_contact_energy_ratio": full_contact_energy_ratio(
            energy, material.contact_modulus, material.surface_energy
        ),
        "complete_contact_pressure": complete,
        "theoretical_strength": material.receding.theoretical_strength,
        "interface_strength": material.receding.interface_strength,
        "full_contact_opening_pressure": complete - material.receding.interface_strength,
        "height_skewness": skewness,
        "height_kurtosis": kurtosis,
        "slope_anisotropy": slope_anisotropy(surface),
        **(layer if material.layered else {}),
        **kind,
    }


def _attributes(surface, material, path, name):
    """Return the global attributes of a run of the model `name`."""
    model = MODELS[name]
    attributes = file_attributes(
        f"Rough contact {'with' if material.surface_energy > 0 else 'without'} adhesion, {model.title}",
        f"{'Loading and unloading' if path.cyclic else 'Loading sweep'} of a "
        f"{'periodic rough surface' if not surface.free else 'single square'} against an "
        f"elastic {'layer on a rigid base' if material.layered else 'half-space'} by {model.method}.",
        COMPUTED,
        references=f"{model.references}; {_STICKINESS_PAPER}",
    )
    if model.by_cells:
        attributes["attraction"] = attraction_on(material, surface.spacing)
    if material.adhesion_map:
        attributes["adhesion_map"] = repr(material.adhesion_map)
    # A campaign sets the attributes that are empty here.
    empty = ("campaign", "study", "config_sha256", "program_sha256", "license")
    return attributes | {"contact_model": name} | dict.fromkeys(empty, "")
