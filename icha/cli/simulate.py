"""One surface against one material, without the workflow."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, UserError
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.attributes import why_no_result
from icha.support.input_files import problem_with_path


def _length(value: str | None) -> float | None:
    return None if value is None else _si(value, "m", "100 um")


def _si(value: str, si_unit: str, example: str) -> float:
    from icha.support.values import to_si

    try:
        return to_si(value, si_unit)
    except ValueError as error:
        raise typer.BadParameter(f"{value!r}: {error}; allowed: such as {example!r}") from None


def _numbers(value: str | None) -> list[float] | None:
    try:
        return None if value is None else [float(part) for part in value.split(",")]
    except ValueError:
        raise typer.BadParameter(f"{value!r} is no list of numbers; allowed: such as 1e-3,1e-2") from None


def _modulus(value: str) -> float:
    return _si(value, "Pa", "25 MPa")


def _energy(value: str) -> float:
    return _si(value, "J/m^2", "50 mJ/m^2")


def _unset(text: str, callback=None):
    """An option without a default value; the text says what its absence means."""
    return typer.Option(help=text, callback=callback, show_default=False)


def simulate(
    output: Annotated[Path, typer.Argument(help="Run file to write (.nc).")],
    surface: Annotated[
        Path | None,
        _unset(
            "Topography: a surface file of a campaign, or heights in m as .npy with --period. Left out: a random one."
        ),
    ] = None,
    period: Annotated[str, typer.Option(help="Side of the periodic cell.", callback=_length)] = "100 um",
    rolloff: Annotated[
        str | None,
        _unset("Roll-off wavelength. Left out: a fifth of the period, but at least twice the short cut-off.", _length),
    ] = None,
    short: Annotated[str | None, _unset("Short cut-off wavelength. Left out: 8 grid cells.", _length)] = None,
    hurst: Annotated[float, typer.Option(help="Hurst exponent.")] = 0.8,
    grid: Annotated[int, typer.Option(help="Grid points along a side.")] = 128,
    seed: Annotated[int, typer.Option(help="Seed of the random phases.")] = 1,
    rms_slope: Annotated[float | None, _unset("Rms slope to scale to. Left out: 1; of a file as measured.")] = None,
    modulus: Annotated[str, typer.Option(help="Contact modulus E*.", callback=_modulus)] = "25 MPa",
    energy: Annotated[str, typer.Option(help="Surface energy.", callback=_energy)] = "50 mJ/m^2",
    interaction_range: Annotated[
        str, typer.Option("--range", help="Range of the attraction.", callback=_length)
    ] = "2 nm",
    pressures: Annotated[
        str | None, _unset("Stops p/(E* h'rms), increasing. Left out: 1e-3,3e-3,1e-2,3e-2.", _numbers)
    ] = None,
    areas: Annotated[str | None, _unset("Stops at contact area fractions A/A0 instead, increasing.", _numbers)] = None,
    model: Annotated[
        str, typer.Option(help=f"Contact model: {' or '.join(MODELS)}, which are slower.")
    ] = DEFAULT_MODEL,
    unload: Annotated[bool, typer.Option("--unload", help="Pull the surfaces apart again.")] = False,
    confirmed: Annotated[bool, typer.Option("--confirmed", help="Take unusual values as they are.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Press one surface against one material and write the run, without a campaign.

    `icha show FILE` shows what came out. Exit status 1 if the path could not be followed to its end; the file then
    holds the stops that were reached, and says why there are no more.
    """
    for path in (output, surface):
        if path is not None and path.exists() and (problem := problem_with_path(path)):
            raise UserError(f"{path}: {problem}; allowed: a file")
    if output.exists() and not force:
        raise UserError(f"{output} is there already; --force replaces it")
    if not output.absolute().parent.is_dir():
        raise UserError(f"{output}: no such folder as {output.parent}")
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
    from icha.asperity.material import Material
    from icha.cli.show import show_run
    from icha.datasets.files import write_dataset
    from icha.path.targets import Path as LoadingPath
    from icha.simulation import ConvergenceError
    from icha.simulation import simulate as press

    try:
        topography = _topography(surface, period, rolloff, short, hurst, grid, seed, rms_slope, model)
        material = Material(modulus, energy, interaction_range)
        if pressures is None and areas is None:
            pressures = [1e-3, 3e-3, 1e-2, 3e-2]
        path = LoadingPath(pressures, areas, unload=unload)
        with _Progress(len(path.targets)) as progress:
            run = press(
                topography, material, path, model=model, seed=seed if surface is None else -1, progress=progress
            )
    except ConvergenceError as error:
        run = error.dataset
    except ValueError as error:
        raise UserError(str(error)) from None
    write_dataset(run, output)
    show_run(run, str(output))
    if why_no_result(run.attrs):
        raise typer.Exit(FAILED)


def _refuse_unusual(**given: tuple[str, float | None]) -> None:
    """Refuse values, by the keys that configurations have for them, that are almost surely slips."""
    from icha.configuration.plausibility import USUAL

    for key, (option, value) in given.items():
        usual = USUAL[key]
        written = value if usual.si_unit == "1" else f"{value!r} {usual.si_unit}"
        if value is not None and not usual.contains(written):
            raise UserError(
                f"{option}: {written} is unusual; usual: {usual}; allowed: another value, or, if it is meant, this one "
                "with --confirmed"
            )


def _topography(file, period, rolloff, short, hurst, grid, seed, rms_slope, model):
    from icha.support.rules import GRID, LENGTH
    from icha.surfaces.spectrum import SelfAffineSpectrum
    from icha.surfaces.surface import Surface

    if file is None:
        slope = 1.0 if rms_slope is None else rms_slope
        for name, length in (("--period", period), ("--rolloff", rolloff), ("--short", short)):
            if length is not None:
                LENGTH.validate(name, length)
        rolloff, short = _cutoffs(period, rolloff, short, GRID.validate("grid", grid))
        _refuse_too_large(grid, period / short, model)
        return SelfAffineSpectrum(period, rolloff, short, hurst, slope).realise(grid, seed)
    if file.suffix == ".npy":
        from icha.surfaces.measured.array_files import read_height_map

        try:
            found = Surface(read_height_map(file, 1.0), period)
        except ValueError as error:
            raise ValueError(f"{file}: {error}") from None
    else:
        from icha.datasets.format import SURFACE, kind_of
        from icha.datasets.surface_file import as_measured, surface_of

        kind, data = kind_of(file)
        if kind != SURFACE:
            raise ValueError(f"{file}: {kind}; allowed: a {SURFACE}, or heights as .npy")
        found = surface_of(data, file)
        if rms_slope is None:  # scans are kept at rms slope 1
            rms_slope = as_measured(data) * found.rms_slope
    return found if rms_slope is None else found.scaled_to_rms_slope(rms_slope)


def _refuse_too_large(grid: int, waves: float, model: str) -> None:
    """Refuse a random surface that needs more memory than this machine has.

    `waves` are the shortest ones along a side: some twenty numbers are held for each wave of the spectrum.
    """
    from icha.planning.costs import RUN_SIZES, surface_cost
    from icha.planning.requirements import memory_of_machine
    from icha.support import formatting

    arrays = 8 * RUN_SIZES[model].arrays * grid**2
    needed, there = max(surface_cost(grid).memory, arrays, 8 * 20 * waves**2), memory_of_machine()
    if needed > there:
        raise ValueError(
            f"--grid {grid}, with {waves:.3g} of the shortest waves along a side, needs about "
            f"{formatting.size(needed)} of memory, and this machine has {formatting.size(there)}; "
            "choose a smaller --grid or a longer --short"
        )


def _cutoffs(period, rolloff, short, grid):
    """Longest and shortest wavelengths, as asked for or such that there is a spectrum between them."""
    cut = 8 * period / max(grid, 1) if short is None else short
    roll = min(period, max(period / 5, 2 * cut)) if rolloff is None else rolloff
    if cut >= roll:
        left_out = "" if short is not None else ", which is 8 grid cells if left out,"
        raise ValueError(
            f"--short {cut * 1e6:g} um{left_out} must be less than --rolloff {roll * 1e6:g} um; "
            f"give a smaller --short{'' if short is not None else ', a finer --grid'} or a longer --rolloff"
        )
    return roll, cut


class _Progress:
    """A progress bar over the stops of a path, on the standard error."""

    def __init__(self, stops: int):
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self._bar = Progress(
            TextColumn("{task.completed:.0f}/{task.total:.0f}"),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.description}"),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task("first contact", total=stops)

    def __enter__(self):
        self._bar.start()
        return self._tell

    def __exit__(self, *error):
        self._bar.stop()

    def _tell(self, line: str) -> None:
        self._bar.update(self._task, advance=line.startswith("stop "), description=line)
