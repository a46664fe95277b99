"""Section `surfaces`, but for measured ones."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import (
    Field,
    field_validator,
)

from icha.configuration.measured_surfaces import MeasuredSurface
from icha.support.rules import GRID, HURST
from icha.support.values import (
    ROUNDING,
    File,
    Length,
    Section,
    conversion_factor,
    integer,
    number,
)


class SelfAffineSurface(Section):
    """A random periodic surface, self-affine with roll-off, made by spectral synthesis."""

    random: ClassVar[bool] = True

    kind: Literal["self_affine"] = Field(description="Surface made from a self-affine spectrum.")
    period: Length = Field(description="Side L of the periodic cell.")
    rolloff_wavelength: Length = Field(
        description="Roll-off wavelength 2π/q0: the spectrum is flat at longer wavelengths. At most the period."
    )
    short_wavelength: Length = Field(
        description="Short cut-off 2π/q1: there are no shorter waves. Less than the roll-off wavelength; at least 2 "
        "grid cells (an error below), better 4 (a warning below) or 8."
    )
    hurst: number(HURST) = Field(description="Hurst exponent H, in (0, 1].")
    grid: integer(GRID) = Field(description="Grid points along a side.")
    amplitudes: Literal["fixed", "gaussian"] = Field(
        default="fixed",
        description="Amplitudes of the waves: `fixed` by the spectrum, so that all seeds have the same rms height and "
        "slope, or `gaussian`, random with the spectrum as their mean square.",
    )

    @property
    def cells_per_short_wave(self) -> float:
        """Grid cells per shortest wavelength."""
        return self.grid * self.short_wavelength / self.period

    @field_validator("rolloff_wavelength")
    @classmethod
    def _q0_not_below_ql(cls, value, info):
        period = info.data.get("period")
        if period is not None and value > period * (1 + ROUNDING):
            raise ValueError(f"is longer than the period (q0 < qL); allowed: at most {period:g} m")
        return value

    @field_validator("short_wavelength")
    @classmethod
    def _q1_above_q0(cls, value, info):
        rolloff = info.data.get("rolloff_wavelength")
        if rolloff is not None and value >= rolloff * (1 - ROUNDING):
            raise ValueError(
                f"is not shorter than the roll-off wavelength (q1 <= q0); allowed: less than {rolloff:g} m"
            )
        return value

    @field_validator("grid")
    @classmethod
    def _grid_holds_the_spectrum(cls, value, info):
        period, short = info.data.get("period"), info.data.get("short_wavelength")
        if period is None or short is None:
            return value
        if value * short / period < 2 * (1 - ROUNDING):
            least = math.ceil(2 * period / short * (1 - ROUNDING))
            raise ValueError(
                f"gives {value * short / period:.3g} grid cells per shortest wavelength, but at least 2 are needed; "
                f"allowed: at least {least}, advisable: {2 * least} or more"
            )
        return value


class FileSurface(Section):
    """A periodic height map from a file, for example a surface that others have published."""

    random: ClassVar[bool] = False

    kind: Literal["file"] = Field(description="Surface read from a file.")
    path: File = Field(
        description="File of a square array of heights, first axis y: `.npy`, or netCDF (`.nc`) with a "
        "variable `height`. Relative to the configuration file. Heights point towards the elastic body."
    )
    height_unit: Annotated[str, Field(strict=True)] = Field(
        description="Unit of the heights in the file, such as `um`. All studies scale the heights to their rms slopes."
    )
    period: Length = Field(description="Side L of the periodic cell.")

    @field_validator("height_unit")
    @classmethod
    def _is_a_length(cls, value):
        try:
            conversion_factor(value, "m")
        except ValueError as error:
            raise ValueError(f"{error}; allowed: a unit of length, such as 'um'") from None
        return value

    @property
    def metres_per_unit(self) -> float:
        """The unit of the heights, in m."""
        return float(conversion_factor(self.height_unit, "m"))


# By the value of their key `kind`.
SURFACE_KINDS = {"self_affine": SelfAffineSurface, "file": FileSurface, "measured": MeasuredSurface}
AnySurface = Annotated[SelfAffineSurface | FileSurface | MeasuredSurface, Field(discriminator="kind")]
