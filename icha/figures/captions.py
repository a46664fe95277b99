"""Sentences that captions of several figures have, and sentences that count missing runs and pale runs.

A caption states what is drawn and what no label shows. It does not repeat the legend.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence

import xarray as xr
from matplotlib.figure import Figure

from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE
from icha.datasets.variables.campaign import LOADED_RUNS
from icha.figures.select import has_layer, has_shape
from icha.uncertainty.grid_error import cells_of_loops, describe_loops
from icha.uncertainty.left_out import absent_materials, left_out_of_study
from icha.uncertainty.sensitivity import left_out_of_samples

_RANGES = {
    (SHORT_RANGE,): "Boundary elements are in the limit of a short range of attraction.",
    (FINITE_RANGE,): """Boundary elements with adhesion have the range of attraction of the material, which the grid
    resolves. Their contact area is the area of zero gap.""",
    (SHORT_RANGE, FINITE_RANGE): """Boundary elements at a finite range have the range of attraction of the material
    where the grid resolves it; their contact area is the area of zero gap. Other boundary elements with adhesion are
    in the limit of a short range.""",
}


def range_of_attraction(attractions: Iterable[str]) -> str:
    """Return a sentence on the range of attraction of boundary elements; "" if there are none."""
    found = set(attractions)
    return _RANGES.get(tuple(each for each in (SHORT_RANGE, FINITE_RANGE) if each in found), "")


def attractions_of(runs: Iterable[xr.Dataset]) -> set[str]:
    """Return the laws of attraction of runs; runs of the asperity model have none."""
    return {run.attrs.get("attraction", "") for run in runs}


def about_boundary_elements(runs: Iterable[xr.Dataset], seeds: Iterable[Sequence[int]] = ()) -> str:
    """Return the range of attraction of boundary elements, and the numbers of seeds of the means if these differ.

    `seeds` has the numbers of seeds of another model and of boundary elements, for each pair of curves.
    """
    words = range_of_attraction(attractions_of(runs))
    if differ := [pair for pair in seeds if pair[0] != pair[1]]:
        others, truths = (" or ".join(map(str, sorted(set(each)))) for each in zip(*differ, strict=True))
        words += f" Means of boundary elements are over {truths} of the topographies, "
        words += f"and those beside them over {others}, so they also differ by the seeds."
    return words


def of_other_study(boundary_elements: str | None) -> str:
    """Return which runs of another study are drawn as boundary elements; "" without such a study."""
    if not boundary_elements:
        return ""
    return f"Boundary elements are those of study {boundary_elements} on the same surfaces, slopes and materials."


def units_of_shapes(figure: Figure, studies: Sequence[xr.Dataset]) -> str:
    """Return a sentence on the reduced units of surfaces with a shape, if the labels of the figure have these units."""
    labels = [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel(), axes.get_title("right"))]
    if not any(r"\mathrm{rms}" in label for label in labels) or not any(map(has_shape, studies)):
        return ""
    return """On a surface with a shape, the units h_rms of gaps and h'rms of loads are not those of the roughness, but
    the rms height of the shape, and this height divided by the side of the square."""


def theories_of_flat_surfaces(study: xr.Dataset, *, drawn: bool = True) -> str:
    """Return why no theory is drawn, if the first surface has a shape, or for which runs theories do not hold.

    `drawn` is False if the figure draws no theory.
    """
    if not has_shape(study.isel(surface=0)):
        layers = "Theories are those of a half-space, and do not hold for runs on a layer."
        return layers if drawn and has_layer(study) else ""
    return """Theories of rough contact are for nominally flat surfaces. They do not hold under a shape, so none is
    drawn."""


def grid_of_loops(campaign: xr.DataTree, studies: Sequence[str]) -> str:
    """Return a sentence on the error of loops by boundary elements due to the grid; "" without such loops."""
    loops = cells_of_loops(campaign, studies)
    return f"Grid: {describe_loops(loops)}." if loops else ""


def count_runs(
    data: Mapping[str, object],
    studies: Sequence[str],
    models: Collection[str] = (),
    shown: Mapping[str, tuple[xr.DataArray, xr.DataArray | None]] = {},
) -> str:
    """Count the runs that a figure leaves out or draws pale, in sentences for the end of its caption; often empty.

    `data` are the datasets of the figure by name, `studies` and `models` the names of what it shows; no models if they
    are not known. `shown` has, by study, the runs that the figure shows and those that it should show (`show_runs`).
    """
    found: list[str] = []
    for name in studies:
        if name in getattr(data.get("sensitivity"), "children", ()):
            found += [f"{line}." for line in left_out_of_samples(data["sensitivity"][name].to_dataset())]
        if name not in getattr(data.get("campaign"), "children", ()):
            continue
        study, suffix = data["campaign"][name].to_dataset(), f" in study {name}" if len(studies) > 1 else ""
        masks = shown.get(name, (None, None))
        left_out = left_out_of_study(study, *masks)
        if left_out.words:
            biased = "; the others are a biased selection" if left_out.biased else ""
            found.append(
                f"The figure shows {left_out.words}{suffix}{biased}. Means over too few of the requested seeds have no "
                "intervals. The report lists the reasons."
            )
        found += [f"Without a curve{suffix}: {each}." for each in absent_materials(study, *masks)]
        drawn = study["status"].isin(LOADED_RUNS)
        drawn &= study["model"].isin(list(models)) if models else True
        for mask in masks:
            drawn = drawn if mask is None else drawn & mask
        reasons = study["applicability"].where(drawn, "").values.ravel()
        for reason, count in Counter(filter(None, reasons.tolist())).items():
            found.append(f"Note on {count} {'run' if count == 1 else 'runs'}{suffix}: {reason}.")
    return " ".join(found)
