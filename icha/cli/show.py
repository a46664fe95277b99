"""The command `icha show`: print what a file contains, and plot it."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import Plot, UserError, echo, option
from icha.datasets.attributes import reasons_not_applicable, why_no_result
from icha.support.formatting import format_count, printable

BARS = " ▁▂▃▄▅▆▇█"
MOST_BARS = 60
MOST_ROWS = 12
CURVES = {"contact_area_fraction": "A/A0", "reduced_pressure": "p*", "reduced_separation": "u/h_rms"}


def show(
    file: Annotated[Path, typer.Argument(help="A run, surface or campaign dataset (.nc).")],
    plot: Plot = None,
    study: Annotated[str | None, option("Study of a campaign dataset. Default: all of them.")] = None,
) -> None:
    """Show what a file contains: a run, a surface or a campaign dataset. --plot draws it."""
    from icha.datasets.format import CAMPAIGN, RUN, SURFACE, UnknownFile, identify_file

    try:
        kind, data = identify_file(file)
    except UnknownFile as error:
        raise UserError(str(error)) from None
    printers = {RUN: print_run, SURFACE: _print_surface, CAMPAIGN: _print_campaign}
    if kind not in printers:
        raise UserError(f"{file}: {kind}; expected a run, a surface or a campaign dataset. Try `ncdump -h`")
    if kind == CAMPAIGN and study is not None:
        if study not in data.children:
            raise UserError(f"--study {study}: not in {file}; expected one of {printable(', '.join(data.children))}")
        data = data.filter(lambda node: node.name in (None, data.name, study))
    try:
        printers[kind](data, file)
        if plot is not None:
            from icha.cli.quick_plot import draw

            draw(kind, data, plot)
    except (AttributeError, LookupError, TypeError, ValueError) as error:  # a file that another program wrote
        raise UserError(f"{file}: {kind} of another format ({error!r}); `icha check` lists the problems") from None


def print_run(run, file: Path) -> None:
    """Print the model, material and surface of a run, and its results."""
    from icha.support.formatting import format_quantity

    def value(variable, unit=None):
        number = float(run[variable])
        return number if unit is None else format_quantity(number, unit)

    echo(f"{file}: {printable(run.attrs.get('title', 'run'))}")
    labels = [f"{key} {printable(run.attrs[key])}" for key in ("campaign", "study") if run.attrs.get(key)]
    if labels:
        echo(" and ".join(labels))
    echo(f"model:    {printable(run.attrs.get('contact_model', 'unknown')).replace('_', ' ')}")
    echo(
        f"material: E* {value('contact_modulus', 'Pa')}, surface energy {value('surface_energy', 'J/m²')}, "
        f"range {value('interaction_range', 'm')}, Tabor parameter {value('tabor_parameter'):.3g}"
    )
    echo(
        f"surface:  period {value('period', 'm')}, rms slope {value('rms_slope'):.4g}, rms height "
        f"{value('rms_height', 'm')}, seed {int(run['seed'])}, {int(run['asperity_count'])} asperities"
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
    curves = {label: run[name].values for name, label in CURVES.items()}
    if str(run["boundary"].values) == "free":
        curves["gap/h_rms"] = (run["mean_gap"] / run["rms_height"]).values
    for label, values in curves.items():
        echo(f"{label:>10} {sparkline(values)} {values.min():.3g} to {values.max():.3g}")
    if "gap/h_rms" in curves:
        echo("          u: mean separation from the half-space far away; gap: mean gap between the surfaces")
    if "hysteresis_loss" in run:
        tension = format_quantity(-value("pull_off_pressure"), "Pa")
        echo(f"pull-off: {tension} of tension; loss {value('hysteresis_loss'):.3g} J/m²")
    echo("\n  step      p/(E* h'rms)   A/A0         u/h_rms    spots")
    rows = min(steps, MOST_ROWS)
    for k in sorted({round(row * (steps - 1) / max(rows - 1, 1)) for row in range(rows)}):
        row = run.isel(step=k)
        echo(
            f"{k:>6}  {float(row['reduced_pressure']):>16.4e}   {float(row['contact_area_fraction']):.4e}   "
            f"{float(row['reduced_separation']):>8.4f}   {int(row['spot_count']):>6}"
        )


def _print_surface(surface, file: Path) -> None:
    """Print attributes and statistics of a surface; those of a scan as measured, too."""
    from icha.datasets.surface_file import measured_scale
    from icha.support.formatting import format_quantity

    echo(f"{file}: {printable(surface.attrs.get('title', 'surface'))}")
    for key in ("summary", "boundary", "source_file", "preparation"):
        if key in surface.attrs:
            echo(f"{key.replace('_', ' ')}: {printable(surface.attrs[key])}")
    echo("")
    scale = measured_scale(surface)
    if scale != 1:
        height, slope = (float(surface[name]) * scale for name in ("rms_height", "rms_slope"))
        echo(f"as measured: rms height {format_quantity(height, 'm')}, rms slope {slope:.4g}")
        echo("as stored, at the rms slope to which the heights are scaled:")
    for name in surface.data_vars:
        variable = surface[name]
        if variable.ndim == 0 and variable.dtype.kind in "fiu":
            unit = variable.attrs.get("units", "1")
            text = format_quantity(float(variable), "m") if unit == "m" else f"{float(variable):.5g}"
            unit = "" if unit in ("1", "m") else f" {unit}"
            echo(printable(f"{variable.attrs.get('long_name', name)}: {text}{unit}"))
    heights = surface["height"].values
    low, high = (format_quantity(float(height) * scale, "m") for height in (heights.min(), heights.max()))
    echo(f"heights from {low} to {high}, as {'stored' if scale == 1 else 'measured'}; profile through the centre:")
    echo(f"  {sparkline(heights[len(heights) // 2])}")


def _print_campaign(tree, file: Path) -> None:
    """Print sizes, models, ranges of results and failures of every study."""
    from icha.datasets.labels import LABELS, labels_at

    echo(f"{file}: {printable(tree.attrs.get('title', 'campaign'))}")
    echo(printable(" ".join(str(tree.attrs.get("summary", "")).split())))
    for name, node in tree.children.items():
        study = node.to_dataset()
        sizes = ", ".join(f"{study.sizes[dim]} {dim}" for dim in LABELS)
        status = study["status"].values.ravel()
        meanings = study["status"].attrs.get("flag_meanings", "").split()
        numbers = {meaning: int((status == k).sum()) for k, meaning in enumerate(meanings)}
        counts = ", ".join(f"{number} {meaning}" for meaning, number in numbers.items() if number)
        echo(f"\n{printable(f'{name}: {sizes}; {counts}')}")
        echo(f"  models {printable(', '.join(study['model'].values))}")
        for label, variable in (("A/A0", "contact_area_fraction"), ("p*", "reduced_pressure")):
            values = study[variable].values
            if (known := values[values == values]).size:
                echo(f"  {label:<6} {known.min():.3g} to {known.max():.3g}")
        if reasons := reasons_not_applicable(study):
            first = printable(". ".join(list(reasons)[:3]))
            echo(f"  model not applicable to {format_count(reasons.total(), 'run')}: {first}", fg="red")
        if "failure" in study:
            for index in zip(*(study["failure"] != "").values.nonzero(), strict=True):
                labels = ", ".join(map(str, labels_at(study, index, study["failure"].dims)))
                echo(f"  failed: {printable(labels)}: {printable(study['failure'].values[index])}", fg="red")


def sparkline(values) -> str:
    """Return a row of bars whose heights represent values."""
    import numpy as np

    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    if not values.size:
        return ""
    if values.size > MOST_BARS:
        values = values[np.linspace(0, values.size - 1, MOST_BARS).round().astype(int)]
    span = np.ptp(values) or 1.0
    return "".join(BARS[1 + round((value - values.min()) / span * 7)] for value in values)
