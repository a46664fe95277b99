"""The command `icha show`: print a summary of a file, with its main numbers."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo, option
from icha.datasets.attributes import reasons_not_applicable, why_failed
from icha.support.formatting import format_count, format_quantity, printable

CURVES = {"contact_area_fraction": "A/A0", "reduced_pressure": "p*", "reduced_separation": "u/h_rms"}


def show(
    file: Annotated[Path, typer.Argument(help="A run, surface or campaign dataset (.nc).")],
    csv: Annotated[
        bool, typer.Option("--csv", help="Print a table with a row for each run and target of a campaign dataset.")
    ] = False,
    parquet: Annotated[
        Path | None, option("Write the same table to a Parquet file. This needs the package pyarrow.", "--parquet")
    ] = None,
) -> None:
    """Print a summary of a run, a surface or a campaign dataset, with its main numbers."""
    from icha.datasets.format import CAMPAIGN, RUN, SURFACE, UnknownFile, identify_file

    try:
        kind, data = identify_file(file)
    except UnknownFile as error:
        raise UserError(str(error)) from None
    if csv or parquet is not None:
        _print_table(kind, data, file, parquet)
        return
    printers = {RUN: _print_run, SURFACE: _print_surface, CAMPAIGN: _print_campaign}
    if kind not in printers:
        raise UserError(f"{file}: {kind}; expected a run, a surface or a campaign dataset. Try `ncdump -h`")
    try:
        printers[kind](data, file)
    except (AttributeError, LookupError, TypeError, ValueError) as error:  # a file that another program wrote
        raise UserError(f"{file}: {kind} of another format ({error!r}); `icha check` lists the problems") from None


def _print_table(kind: str, data, file: Path, parquet: Path | None) -> None:
    """Print the tidy table of a campaign dataset as CSV, or write it to a Parquet file."""
    from icha.datasets.format import CAMPAIGN
    from icha.datasets.table import as_csv, tidy_table

    if kind != CAMPAIGN:
        raise UserError(f"{file}: {kind}; expected a campaign dataset, such as results/NAME/dataset/NAME.nc")
    table = tidy_table(data)
    if parquet is None:
        typer.echo(as_csv(table), nl=False)
        return
    try:
        table.to_parquet(parquet, index=False)
    except ImportError:
        raise UserError("--parquet needs the package pyarrow; install it with `pip install pyarrow`") from None


def _print_run(run, file: Path) -> None:
    """Print the model, material and surface of a run, and the ranges of its results."""

    def quantity(name, unit):
        return format_quantity(float(run[name]), unit)

    echo(f"{file}: {printable(run.attrs.get('title', 'run'))}")
    labels = [f"{key} {printable(run.attrs[key])}" for key in ("campaign", "study") if run.attrs.get(key)]
    if labels:
        echo(" and ".join(labels))
    echo(f"model:    {printable(run.attrs.get('contact_model', 'unknown')).replace('_', ' ')}")
    echo(
        f"material: E* {quantity('contact_modulus', 'Pa')}, surface energy {quantity('surface_energy', 'J/m²')}, "
        f"range {quantity('interaction_range', 'm')}, Tabor parameter {float(run['tabor_parameter']):.3g}"
    )
    echo(
        f"surface:  period {quantity('period', 'm')}, rms slope {float(run['rms_slope']):.4g}, rms height "
        f"{quantity('rms_height', 'm')}, seed {int(run['seed'])}, {int(run['asperity_count'])} asperities"
    )
    if reason := why_failed(run.attrs):
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
        curves["gap/h_rms"] = (run["mean_gap"] / run["unit_height"]).values
    for label, values in curves.items():
        echo(f"{label:>10} {values.min():.3g} to {values.max():.3g}")
    if "shape" in run:
        echo("          p* is p/(E* unit_slope), h_rms is unit_height: units of the shape, not of its roughness")
    if "gap/h_rms" in curves:
        echo("          u: distance from mean plane to undeformed half-space; gap: mean gap between the surfaces")
    if "hysteresis_loss" in run:
        tension = format_quantity(float(run["pull_off_pressure"]), "Pa")
        echo(f"pull-off: {tension} of tension; loss {float(run['hysteresis_loss']):.3g} J/m²")
    if "pull_off_force" in run:
        echo(f"          {_indenter_test(run)}")


def _indenter_test(run) -> str:
    """Return the pull-off force of an indenter, its ratio to JKR, and works of adhesion or why a fit is missing."""
    from icha.references.indenter_runs import BRANCHES, reason_without_fit

    parts = [f"pull-off force {format_quantity(float(run['pull_off_force']), 'N')}"]
    if "pull_off_force_over_jkr" in run:
        parts[0] += f" ({float(run['pull_off_force_over_jkr']):.4g} of JKR)"
    elif "pull_off_force_over_theory" in run:
        parts[0] += f" ({float(run['pull_off_force_over_theory']):.4g} of the theory of the smooth shape)"
    if "pull_off_force_over_jkr" in run:
        for branch in BRANCHES:
            reason = reason_without_fit(run, branch)
            work = f"no fit ({reason})" if reason else format_quantity(float(run[f"work_of_adhesion_{branch}"]), "J/m²")
            parts.append(f"{branch} {work}")
    return ", ".join(parts)


def _print_surface(surface, file: Path) -> None:
    """Print attributes and statistics of a surface; for a scan, also the measured rms height and rms slope."""
    from icha.datasets.surface_file import measured_scale

    echo(f"{file}: {printable(surface.attrs.get('title', 'surface'))}")
    for key in ("summary", "boundary", "shape", "source_file", "preparation"):
        if key in surface.attrs:
            echo(f"{key.replace('_', ' ')}: {printable(surface.attrs[key])}")
    scale = measured_scale(surface)
    if scale != 1:
        height, slope = (float(surface[name]) * scale for name in ("rms_height", "rms_slope"))
        echo(f"as measured: rms height {format_quantity(height, 'm')}, rms slope {slope:.4g}")
        echo("as stored, after scaling to another rms slope:")
    for name, variable in surface.data_vars.items():
        if variable.ndim == 0 and variable.dtype.kind in "fiu":
            unit = variable.attrs.get("units", "1").removeprefix("1")
            text = format_quantity(float(variable), "m") if unit == "m" else f"{float(variable):.5g} {unit}".rstrip()
            echo(printable(f"{variable.attrs.get('long_name', name)}: {text}"))


def _print_campaign(tree, file: Path) -> None:
    """Print, for each study of a campaign, its size, models, number of failed runs and ranges of results."""
    from icha.analysis.left_out import left_out_of_study
    from icha.datasets.labels import LABELS
    from icha.datasets.variables.campaign import LOADED_RUNS

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
        if sentence := left_out_of_study(study).sentence:
            echo(f"  results are of {sentence}", fg="red")
        results = study[["contact_area_fraction", "reduced_pressure"]].where(study["status"].isin(LOADED_RUNS))
        for label, variable in (("A/A0", "contact_area_fraction"), ("p*", "reduced_pressure")):
            values = results[variable].values
            if (known := values[values == values]).size:
                echo(f"  {label:<6} {known.min():.3g} to {known.max():.3g}")
        if reasons := reasons_not_applicable(study):
            first = printable(". ".join(list(reasons)[:3]))
            echo(f"  model not applicable to {format_count(reasons.total(), 'run')}: {first}", fg="red")
