"""The command `icha jkr`: contact modulus and works of adhesion from the measured points of a JKR test."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo, option, shorten_path


def jkr(
    file: Annotated[Path, typer.Argument(help="CSV file with a line of headings, such as force (mN).")],
    radius: Annotated[str, typer.Option(help="Radius of the lens with its unit, such as '5 mm'.")],
    column: Annotated[
        list[str] | None,
        option(
            "Heading of a quantity, such as 'force=Load cell (mN)'; may be repeated. Quantities: force, "
            "contact_radius, indentation, branch."
        ),
    ] = None,
    unit: Annotated[
        list[str] | None, option("Unit of a quantity without one in its heading, such as 'force=mN'; may be repeated.")
    ] = None,
    offset: Annotated[
        str | None, option("Indentation where the lens touches the undeformed plane, such as '0 um'. Default: fitted.")
    ] = None,
    interaction_range: Annotated[
        str, typer.Option(help="Range of the attraction, for the warning of small Tabor parameters.")
    ] = "0.5 nm",
    thickness: Annotated[
        str | None, option("Thickness of an elastic layer, such as '2 mm'. Default: a half-space.")
    ] = None,
    roughness: Annotated[
        Path | None, option("File with a measured topography, for the warning of rough surfaces. Default: smooth.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the resamples that give the intervals.", min=0)] = 0,
    figure: Annotated[
        Path | None,
        option("Name of the figure (.png and .pdf). Default: FILE with _jkr at its end."),
    ] = None,
) -> None:
    """Fit contact modulus and works of adhesion to the measured points of a JKR test.

    The table contains the force, positive in compression, and the contact radius or the indentation or both, in the
    order of the test: loading, then unloading. The command prints the values with their 90 % intervals, the number of
    points that were used and left out, and warnings if the law of JKR does not hold; and it draws points, fit and
    residuals.
    """
    import math
    import warnings

    from icha.support.usual import IchaWarning
    from icha.support.values import to_si

    def length(name, text):
        try:
            return to_si(text, "m")
        except ValueError as error:
            raise UserError(f"--{name} {text}: {error}; expected a length with its unit, such as '5 mm'") from None

    def pairs(name, texts):
        if wrong := [text for text in texts or () if "=" not in text]:
            raise UserError(f"--{name} {wrong[0]}: expected a quantity, =, and its {name}, such as 'force=mN'")
        return dict(text.split("=", 1) for text in texts or ())

    sizes = {"radius": length("radius", radius), "interaction_range": length("interaction-range", interaction_range)}
    sizes["indentation_offset"] = None if offset is None else length("offset", offset)
    sizes["thickness"] = math.inf if thickness is None else length("thickness", thickness)
    settings = {"columns": pairs("column", column), "units": pairs("unit", unit), "seed": seed}

    from icha.figures.quick import plot_jkr_test
    from icha.figures.style import save
    from icha.references.jkr_test import fit_jkr_test

    rough = None
    try:
        if roughness is not None:
            from icha.configuration.topographies import read_scan

            rough = read_scan(roughness, boundary="free", missing="fill")
        with warnings.catch_warnings():
            # The warnings are part of the result.
            warnings.simplefilter("ignore", IchaWarning)
            test = fit_jkr_test(file, roughness=rough, **sizes, **settings)
    except ValueError as error:
        raise UserError(str(error)) from None
    for line in str(test).splitlines():
        echo(line, fg="red" if line.startswith("warning:") else None)
    name = str(figure or file.with_name(f"{file.stem}_jkr")).removesuffix(".png").removesuffix(".pdf")
    png, pdf = Path(f"{name}.png"), Path(f"{name}.pdf")
    save(plot_jkr_test(test), png, pdf)
    echo(f"figure: {shorten_path(png)}, {shorten_path(pdf)}")
