"""The command `icha simulate`: one random surface against one material, without a campaign."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, UserError, echo, option
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.attributes import why_no_result
from icha.support.input_files import problem_with_path


def _quantity(key: str, help_text: str, name: str | None = None):
    """Declare an option with a unit; its value in SI units is checked against the usual values of a configuration."""

    def convert(parameter: typer.CallbackParam, text: str | None) -> float | None:
        from icha.configuration.plausibility import USUAL
        from icha.support.values import to_si

        usual = USUAL[key]
        if text is None:
            return None
        try:
            value = to_si(text, usual.si_unit)
        except ValueError as error:
            raise typer.BadParameter(
                f"{text!r}: {error}; expected a value such as {parameter.default or '10 um'!r}"
            ) from None
        if not usual.contains(text):
            echo(f"Warning: {parameter.opts[0]}: {text!r} is unusual; usual values: {usual}", err=True, fg="yellow")
        return value

    shown = not key.endswith("_wavelength")  # their defaults depend on other options
    return typer.Option(*([name] if name else []), help=help_text, callback=convert, show_default=shown)


def _numbers(value: str | None) -> list[float] | None:
    try:
        return None if value is None else [float(number) for number in value.split(",")]
    except ValueError:
        raise typer.BadParameter(f"{value!r}: expected a list of numbers such as 1e-3,1e-2") from None


def simulate(
    output: Annotated[Path, typer.Argument(help="Run file to write (.nc).")],
    period: Annotated[str, _quantity("period", "Side of the periodic square.")] = "100 um",
    rolloff: Annotated[
        str | None,
        _quantity(
            "rolloff_wavelength",
            "Roll-off wavelength. Default: a fifth of the period, but at least twice the shortest wavelength.",
        ),
    ] = None,
    short: Annotated[
        str | None, _quantity("short_wavelength", "Shortest wavelength. Default: 8 grid cells, as recommended.")
    ] = None,
    hurst: Annotated[float, typer.Option(help="Hurst exponent.")] = 0.8,
    rms_slope: Annotated[float, typer.Option(help="Root mean square slope.")] = 1.0,
    grid: Annotated[int, typer.Option(help="Grid nodes along a side.")] = 128,
    seed: Annotated[int, typer.Option(help="Seed of the random phases.")] = 1,
    modulus: Annotated[str, _quantity("contact_modulus", "Contact modulus E*.")] = "25 MPa",
    energy: Annotated[str, _quantity("surface_energy", "Surface energy (work of adhesion).")] = "50 mJ/m^2",
    interaction_range: Annotated[str, _quantity("interaction_range", "Range of the attraction.", "--range")] = "2 nm",
    pressures: Annotated[
        str | None, option("Reduced pressures p/(E* h'rms) to reach. Default: 1e-3,3e-3,1e-2,3e-2.", callback=_numbers)
    ] = None,
    areas: Annotated[
        str | None, option("Contact area fractions A/A0 to reach, instead of pressures.", callback=_numbers)
    ] = None,
    model: Annotated[str, typer.Option(help=f"Contact model: {' or '.join(MODELS)} (slower).")] = DEFAULT_MODEL,
    unload: Annotated[bool, typer.Option("--unload", help="Unload until the surfaces separate.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Press one random surface against one material and write the run, without a campaign.

    `icha show FILE` prints the result. Exit status 1 if the path could not be followed to its end; the file then
    contains the loads that were reached, and the reason.
    """
    if output.exists() and (problem := problem_with_path(output)):
        raise UserError(f"{output}: {problem}; expected a file")
    if output.exists() and not force:
        raise UserError(f"{output} exists already; use --force to replace it")
    if not output.absolute().parent.is_dir():
        raise UserError(f"{output}: the folder {output.parent} does not exist")
    import icha
    from icha.cli.show import print_run
    from icha.datasets.files import write_dataset
    from icha.support.rules import GRID

    try:
        short = 8 * period / GRID.validate("grid", grid) if short is None else short
        rolloff = min(period, max(period / 5, 2 * short)) if rolloff is None else rolloff
        surface = icha.SelfAffineSpectrum(period, rolloff, short, hurst, rms_slope).realise(grid, seed)
        material = icha.Material(modulus, energy, interaction_range)
        if pressures is None and areas is None:
            pressures = [1e-3, 3e-3, 1e-2, 3e-2]
        path = icha.Path(pressures, areas, unload=unload)
        run = icha.simulate(surface, material, path, model=model, seed=seed, progress=partial(echo, err=True))
    except icha.ConvergenceError as error:
        run = error.dataset
    except ValueError as error:
        raise UserError(str(error)) from None
    write_dataset(run, output)
    print_run(run, output)
    if why_no_result(run.attrs):
        raise typer.Exit(FAILED)
