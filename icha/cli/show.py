"""Look into a file: what it is, its numbers in short, and a quick plot."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo
from icha.cli.scans import check_picture
from icha.datasets.attributes import reasons_not_applicable, why_no_result
from icha.support.formatting import format_count, printable

_BARS = " ▁▂▃▄▅▆▇█"
_WIDTH = 60
_CURVES = {"contact_area_fraction": "A/A0", "reduced_pressure": "p*", "reduced_separation": "u/h_rms"}


def show(
    file: Annotated[Path, typer.Argument(help="A run, surface or campaign dataset (.nc).")],
    plot: Annotated[
        Path | None, typer.Option(help="Draw a plot into this file (.png, .pdf or .svg).", show_default=False)
    ] = None,
    study: Annotated[
        str | None, typer.Option(help="Study of a campaign dataset. Left out: all of them.", show_default=False)
    ] = None,
) -> None:
    """Show what is in a file: a run, a surface or a campaign dataset. --plot draws it."""
    check_picture(plot)
    from icha.datasets.format import CAMPAIGN, RUN, SURFACE, UnknownFile, kind_of

    try:
        kind, data = kind_of(file)
    except UnknownFile as error:
        raise UserError(str(error)) from None
    if kind not in (RUN, SURFACE, CAMPAIGN):
        raise UserError(f"{file}: {kind}; shown are runs, surfaces and campaign datasets, and others by `ncdump -h`")
    if kind == CAMPAIGN:
        studies = list(data.children)
        if study is not None and study not in studies:
            raise UserError(f"--study {study}: there is none in {file}; there are: {printable(', '.join(studies))}")
        data = data if study is None else data.filter(lambda node: node.name in (None, data.name, study))
    try:
        if kind == RUN:
            show_run(data, str(file))
        elif kind == SURFACE:
            _show_surface(data, file)
        else:
            _show_campaign(data, file)
        if plot is not None:
            from icha.cli.quick_plot import draw

            draw(kind, data, plot)
            echo(f"drawn:   {plot}")
    except (AttributeError, LookupError, TypeError, ValueError) as error:  # of files from elsewhere
        raise UserError(f"{file}: {kind} of another format ({error!r}); `icha check` lists what is wrong") from None


def show_run(run, name: str) -> None:
    """Print what a run was and what came out."""
    from icha.figures.style import quantity

    def value(variable):
        return float(run[variable])

    echo(f"{name}: {printable(run.attrs.get('title', 'run'))}")
    place = [printable(run.attrs[key]) for key in ("campaign", "study") if run.attrs.get(key)]
    if place:
        echo(f"campaign {' and study '.join(place)}")
    if run.attrs.get("applicability"):
        echo(printable(run.attrs["applicability"]), fg="yellow")
    echo(f"model:    {printable(run.attrs.get('contact_model', 'unknown')).replace('_', ' ')}")
    echo(
        f"material: E* {quantity(value('contact_modulus'), 'Pa')}, surface energy "
        f"{quantity(value('surface_energy'), 'J/m²')}, range {quantity(value('interaction_range'), 'm')}, "
        f"Tabor parameter {value('tabor_parameter'):.3g}"
    )
    echo(
        f"surface:  period {quantity(value('period'), 'm')}, rms slope {value('rms_slope'):.4g}, rms height "
        f"{quantity(value('rms_height'), 'm')}, seed {int(run['seed'])}, {int(run['asperity_count'])} asperities"
    )
    if reason := why_no_result(run.attrs):
        echo(f"failed:   {printable(reason)}", fg="red")
    if reason := run.attrs.get("applicability"):
        echo(f"warning:  {printable(reason)}", fg="red")
    steps = run.sizes["step"]
    if not steps:
        echo("no step was reached")
        return
    residual = float(run["residual"].max())
    echo(f"{steps} steps, {run.sizes.get('snapshot', 0)} snapshots, residual at most {residual:.1e} h_rms")
    for variable, label in _CURVES.items():
        values = run[variable].values
        echo(f"{label:>8} {sparkline(values)} {values.min():.3g} to {values.max():.3g}")
    if str(run["boundary"].values) == "free":
        gap = (run["mean_gap"] / run["rms_height"]).values
        echo(f" gap/h_rms {sparkline(gap)} {gap.min():.3g} to {gap.max():.3g}")
        echo("          u: mean separation from the half-space far away; gap: mean gap between the surfaces")
    if "hysteresis_loss" in run:
        echo(
            f"pull-off: {quantity(-value('pull_off_pressure'), 'Pa')} of tension; "
            f"loss {value('hysteresis_loss'):.3g} J/m²"
        )
    echo("")
    echo("  step      p/(E* h'rms)   A/A0         u/h_rms    spots")
    for k in _some(steps):
        row = run.isel(step=k)
        echo(
            f"{k:>6}  {float(row['reduced_pressure']):>16.4e}   {float(row['contact_area_fraction']):.4e}   "
            f"{float(row['reduced_separation']):>8.4f}   {int(row['spot_count']):>6}"
        )


def _some(count: int, most: int = 12) -> list[int]:
    """At most so many indices, evenly spread from the first to the last."""
    if count <= most:
        return list(range(count))
    return sorted({round(k * (count - 1) / (most - 1)) for k in range(most)})


def _show_surface(surface, file) -> None:
    from icha.datasets.surface_file import as_measured
    from icha.figures.style import quantity

    echo(f"{file}: {printable(surface.attrs.get('title', 'surface'))}")
    for key in ("summary", "boundary", "source_file", "preparation"):
        if key in surface.attrs:
            echo(f"{key.replace('_', ' ')}: {printable(surface.attrs[key])}")
    echo("")
    scale = as_measured(surface)
    if scale != 1:
        height, slope = (float(surface[name]) * scale for name in ("rms_height", "rms_slope"))
        echo(f"as measured: rms height {quantity(height, 'm')}, rms slope {slope:.4g}")
        echo("as stored, at the rms slope to which the heights are scaled:")
    for name in surface.data_vars:
        variable = surface[name]
        if variable.ndim == 0 and variable.dtype.kind in "fiu":
            unit = variable.attrs.get("units", "1")
            text = quantity(float(variable), "m") if unit == "m" else f"{float(variable):.5g}"
            unit = "" if unit in ("1", "m") else f" {unit}"
            echo(printable(f"{variable.attrs.get('long_name', name)}: {text}{unit}"))
    heights = surface["height"].values
    low, high = (quantity(float(height) * scale, "m") for height in (heights.min(), heights.max()))
    echo(f"heights from {low} to {high}, as {'stored' if scale == 1 else 'measured'}; a line through the middle:")
    echo(f"  {sparkline(heights[len(heights) // 2])}")


def _show_campaign(tree, file) -> None:
    from icha.datasets.labels import LABELS, labels_at

    echo(f"{file}: {printable(tree.attrs.get('title', 'campaign'))}")
    echo(printable(" ".join(str(tree.attrs.get("summary", "")).split())))
    for name, node in tree.children.items():
        study = node.to_dataset()
        sizes = ", ".join(f"{study.sizes[d]} {d}" for d in LABELS)
        status = study["status"].values.ravel()
        meanings = study["status"].attrs.get("flag_meanings", "").split()
        numbers = {word: int((status == k).sum()) for k, word in enumerate(meanings)}
        counts = ", ".join(f"{number} {word}" for word, number in numbers.items() if number)
        echo(f"\n{printable(f'{name}: {sizes}; {counts}')}")
        echo(f"  models {printable(', '.join(study['model'].values))}")
        for label, variable in (("A/A0", "contact_area_fraction"), ("p*", "reduced_pressure")):
            values = study[variable].values
            if (known := values[values == values]).size:
                echo(f"  {label:<6} {known.min():.3g} to {known.max():.3g}")
        if reasons := reasons_not_applicable(study):
            some = printable(". ".join(list(reasons)[:3]))
            echo(f"  model not applicable to {format_count(reasons.total(), 'run')}: {some}", fg="red")
        if "failure" in study:
            for where in zip(*(study["failure"] != "").values.nonzero(), strict=True):
                labels = map(str, labels_at(study, where, study["failure"].dims))
                reason = printable(study["failure"].values[where])
                echo(f"  failed: {printable(', '.join(labels))}: {reason}", fg="red")


def sparkline(values) -> str:
    """A row of bars, at most 60, as high as the values are between their least and their largest."""
    import numpy as np

    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    if not values.size:
        return ""
    if values.size > _WIDTH:
        values = values[np.linspace(0, values.size - 1, _WIDTH).round().astype(int)]
    span = np.ptp(values) or 1.0
    return "".join(_BARS[1 + round((value - values.min()) / span * 7)] for value in values)
