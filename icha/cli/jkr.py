"""The command `icha jkr`: contact modulus and works of adhesion from the measured points of a JKR test."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo, option, shorten_path
from icha.support.usual import USUAL, IchaWarning


def _length(text: str) -> float:
    from icha.support.values import to_si

    try:
        return to_si(text, "m")
    except ValueError as error:
        raise typer.BadParameter(f"{text}: {error}; expected a length with its unit, such as '5 mm'") from None


def _usual_length(name):
    def parse(text: str) -> float:
        if USUAL[name].least <= (length := _length(text)) <= USUAL[name].most:
            return length
        raise typer.BadParameter(f"{text}: expected {USUAL[name]}")

    return {"parser": parse, "metavar": "<length>"}


def _pair(text: str) -> list[str]:
    if "=" not in text:
        raise typer.BadParameter(f"{text}: expected a quantity, = and a text, such as 'force=mN'")
    return text.split("=", 1)


PAIR = {"parser": _pair, "metavar": "<quantity=text>"}
Radius = Annotated[float, option("Radius of the lens with its unit, such as '5 mm'.", **_usual_length("radius"))]
Columns = Annotated[list[object] | None, option("Heading: 'force=Load cell (mN)'; may be repeated.", **PAIR)]
Units = Annotated[list[object] | None, option("Unit that a heading lacks: 'force=mN'; may be repeated.", **PAIR)]
Offset = Annotated[
    float | None, option("Indentation at the undeformed plane. Default: fitted.", parser=_length, metavar="<length>")
]
Range = Annotated[
    float | None,
    option("Range of attraction, for the Tabor parameter. Default: 0.5 nm.", **_usual_length("interaction_range")),
]
Thickness = Annotated[
    float | None, option("Thickness of an elastic layer. Default: a half-space.", **_usual_length("thickness"))
]
Roughness = Annotated[Path | None, option("File with a measured topography. Default: smooth.")]


def jkr(
    file: Annotated[Path, typer.Argument(help="CSV file with a line of headings, such as force (mN).")],
    radius: Radius,
    column: Columns = None,
    unit: Units = None,
    offset: Offset = None,
    interaction_range: Range = None,
    thickness: Thickness = None,
    roughness: Roughness = None,
) -> None:
    """Fit contact modulus and works of adhesion to the measured points of a JKR test.

    The table contains the force, positive in compression, and the contact radius or the indentation or both, in the
    order of the test: loading, then unloading. The command prints the values with their 90 % intervals, the number of
    points that were used and left out, and warnings if the law of JKR does not hold; and it draws points, fit and
    residuals in FILE_jkr.png and .pdf. Quantities of the options: force, contact_radius, indentation, branch.
    """
    import warnings

    from icha.figures.quick import plot_jkr_test
    from icha.figures.style import save
    from icha.references.jkr_test import fit_jkr_test

    limits = {"interaction_range": interaction_range, "thickness": thickness}
    settings = {name: value for name, value in limits.items() if value is not None}
    try:
        if roughness is not None:
            from icha.configuration.topographies import read_scan

            settings["roughness"] = read_scan(roughness, boundary="free", missing="fill")
        with warnings.catch_warnings():
            # The warnings are part of the result.
            warnings.simplefilter("ignore", IchaWarning)
            names = {"columns": dict(column or ()), "units": dict(unit or ())}
            test = fit_jkr_test(file, radius, **names, indentation_offset=offset, **settings)
    except ValueError as error:
        raise UserError(str(error)) from None
    for line in str(test).splitlines():
        echo(line, fg="red" if line.startswith("warning:") else None)
    png, pdf = (file.with_name(f"{file.stem}_jkr{ending}") for ending in (".png", ".pdf"))
    save(plot_jkr_test(test), png, pdf)
    echo(f"figure: {shorten_path(png)}, {shorten_path(pdf)}")
