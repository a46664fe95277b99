"""The command `icha simulate`: one surface against one material, without a campaign."""

import contextlib
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, UserError, option
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.attributes import why_no_result
from icha.support.input_files import problem_with_path


def _in_si(unit: str, example: str):
    """Return a callback that converts a quantity with a unit to SI units."""

    def convert(value: str | None) -> float | None:
        from icha.support.values import to_si

        try:
            return None if value is None else to_si(value, unit)
        except ValueError as error:
            raise typer.BadParameter(f"{value!r}: {error}; expected such as {example!r}") from None

    return convert


_LENGTH = _in_si("m", "100 um")


def _numbers(value: str | None) -> list[float] | None:
    try:
        return None if value is None else [float(number) for number in value.split(",")]
    except ValueError:
        raise typer.BadParameter(f"{value!r}: expected a list of numbers such as 1e-3,1e-2") from None


def simulate(
    output: Annotated[Path, typer.Argument(help="Run file to write (.nc).")],
    surface: Annotated[
        Path | None,
        option("Topography: surface file of a campaign, or heights in m as .npy with --period. Default: a random one."),
    ] = None,
    period: Annotated[str, typer.Option(help="Side of the periodic cell.", callback=_LENGTH)] = "100 um",
    rolloff: Annotated[
        str | None,
        option(
            "Roll-off wavelength. Default: a fifth of the period, but at least twice the short cut-off.",
            callback=_LENGTH,
        ),
    ] = None,
    short: Annotated[str | None, option("Short cut-off wavelength. Default: 8 grid cells.", callback=_LENGTH)] = None,
    hurst: Annotated[float, typer.Option(help="Hurst exponent.")] = 0.8,
    grid: Annotated[int, typer.Option(help="Grid points along a side.")] = 128,
    seed: Annotated[int, typer.Option(help="Seed of the random phases.")] = 1,
    rms_slope: Annotated[
        float | None, option("Scale the heights to this rms slope. Default: 1; that of a file as measured.")
    ] = None,
    modulus: Annotated[str, typer.Option(help="Contact modulus E*.", callback=_in_si("Pa", "25 MPa"))] = "25 MPa",
    energy: Annotated[str, typer.Option(help="Surface energy.", callback=_in_si("J/m^2", "50 mJ/m^2"))] = "50 mJ/m^2",
    interaction_range: Annotated[
        str, typer.Option("--range", help="Range of the attraction.", callback=_LENGTH)
    ] = "2 nm",
    pressures: Annotated[
        str | None, option("Stops p/(E* h'rms), increasing. Default: 1e-3,3e-3,1e-2,3e-2.", callback=_numbers)
    ] = None,
    areas: Annotated[
        str | None, option("Stops at contact area fractions A/A0 instead, increasing.", callback=_numbers)
    ] = None,
    model: Annotated[str, typer.Option(help=f"Contact model: {' or '.join(MODELS)} (slower).")] = DEFAULT_MODEL,
    unload: Annotated[bool, typer.Option("--unload", help="Unload until the surfaces separate.")] = False,
    confirmed: Annotated[bool, typer.Option("--confirmed", help="Accept unusual values.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Load one surface against one material and write the run, without a campaign.

    `icha show FILE` prints the result. Exit status 1 if the path could not be followed to its end; the file then
    contains the stops that were reached, and the reason.
    """
    for path in (output, surface):
        if path is not None and path.exists() and (problem := problem_with_path(path)):
            raise UserError(f"{path}: {problem}; expected a file")
    if output.exists() and not force:
        raise UserError(f"{output} exists already; use --force to replace it")
    if not output.absolute().parent.is_dir():
        raise UserError(f"{output}: the folder {output.parent} does not exist")
    if not confirmed:
        _refuse_unusual(
            period=("--period", period if surface is None or surface.suffix == ".npy" else None),
            rolloff_wavelength=("--rolloff", rolloff),
            short_wavelength=("--short", short),
            rms_slope=("--rms-slope", rms_slope),
            contact_modulus=("--modulus", modulus),
            surface_energy=("--energy", energy),
            interaction_range=("--range", interaction_range),
        )
    from icha import simulation
    from icha.asperity.material import Material
    from icha.cli.show import print_run
    from icha.datasets.files import write_dataset
    from icha.path.targets import Path as LoadingPath

    try:
        if surface is None:
            topography = _random_surface(period, rolloff, short, hurst, grid, seed, rms_slope, model)
        else:
            topography = _read_surface(surface, period, rms_slope)
        material = Material(modulus, energy, interaction_range)
        if pressures is None and areas is None:
            pressures = [1e-3, 3e-3, 1e-2, 3e-2]
        path = LoadingPath(pressures, areas, unload=unload)
        seed = seed if surface is None else -1
        with _progress_bar(len(path.targets)) as progress:
            run = simulation.simulate(topography, material, path, model=model, seed=seed, progress=progress)
    except simulation.ConvergenceError as error:
        run = error.dataset
    except ValueError as error:
        raise UserError(str(error)) from None
    write_dataset(run, output)
    print_run(run, output)
    if why_no_result(run.attrs):
        raise typer.Exit(FAILED)


def _refuse_unusual(**values: tuple[str, float | None]) -> None:
    """Refuse values that are probably typing errors; `values` maps keys of configurations to option and value."""
    from icha.configuration.plausibility import USUAL

    for key, (name, value) in values.items():
        usual = USUAL[key]
        text = value if usual.si_unit == "1" else f"{value!r} {usual.si_unit}"
        if value is not None and not usual.contains(text):
            raise UserError(
                f"{name}: {text} is unusual; expected {usual}. Correct it, or add --confirmed if it is intended"
            )


def _random_surface(period, rolloff, short, hurst, grid, seed, rms_slope, model):
    """Return a random surface; refuse one that needs more memory than this machine has."""
    from icha.planning.costs import RUN_SIZES, surface_cost
    from icha.planning.requirements import memory_of_machine
    from icha.support import formatting
    from icha.support.rules import GRID, LENGTH
    from icha.surfaces.spectrum import SelfAffineSpectrum

    for name, length in (("--period", period), ("--rolloff", rolloff), ("--short", short)):
        if length is not None:
            LENGTH.validate(name, length)
    rolloff, short = _cutoffs(period, rolloff, short, GRID.validate("grid", grid))
    waves = period / short  # the shortest ones along a side
    run_arrays = 8 * RUN_SIZES[model].arrays * grid**2
    wave_arrays = 8 * 20 * waves**2  # about twenty numbers for each wave of the spectrum
    needed, available = max(surface_cost(grid).memory, run_arrays, wave_arrays), memory_of_machine()
    if needed > available:
        raise ValueError(
            f"--grid {grid}, with {waves:.3g} of the shortest waves along a side, needs about "
            f"{formatting.size(needed)} of memory, and this machine has {formatting.size(available)}; use a smaller "
            "--grid or a longer --short"
        )
    return SelfAffineSpectrum(period, rolloff, short, hurst, 1.0 if rms_slope is None else rms_slope).realise(
        grid, seed
    )


def _cutoffs(period, rolloff, short, grid):
    """Return the longest and the shortest wavelength: those given, or defaults with a spectrum between them."""
    cut = 8 * period / max(grid, 1) if short is None else short
    roll = min(period, max(period / 5, 2 * cut)) if rolloff is None else rolloff
    if cut >= roll:
        default, finer_grid = (" (default: 8 grid cells)", ", a finer --grid") if short is None else ("", "")
        raise ValueError(
            f"--short {cut * 1e6:g} um{default} must be less than --rolloff {roll * 1e6:g} um; use a smaller "
            f"--short{finer_grid} or a longer --rolloff"
        )
    return roll, cut


def _read_surface(file: Path, period: float, rms_slope: float | None):
    """Read a surface file, or heights in m from an .npy file; scale it to an rms slope if one is given."""
    from icha.datasets.format import SURFACE, identify_file
    from icha.datasets.surface_file import measured_scale, surface_of
    from icha.surfaces.measured.array_files import read_height_map
    from icha.surfaces.surface import Surface

    if file.suffix == ".npy":
        try:
            surface = Surface(read_height_map(file, 1.0), period)
        except ValueError as error:
            raise ValueError(f"{file}: {error}") from None
    else:
        kind, data = identify_file(file)
        if kind != SURFACE:
            raise ValueError(f"{file}: {kind}; expected a {SURFACE}, or heights as .npy")
        surface = surface_of(data, file)
        if rms_slope is None:  # files contain scans at rms slope 1
            rms_slope = measured_scale(data) * surface.rms_slope
    return surface if rms_slope is None else surface.scaled_to_rms_slope(rms_slope)


@contextlib.contextmanager
def _progress_bar(stops: int):
    """Show a progress bar over the stops of a path; provide the function that takes a line of progress."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    count, description = TextColumn("{task.completed:.0f}/{task.total:.0f}"), TextColumn("{task.description}")
    columns = (count, BarColumn(), TimeElapsedColumn(), description)
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("first contact", total=stops)
        yield lambda line: bar.update(task, advance=line.startswith("stop "), description=line)
