"""Sections `surfaces` and `materials`: rough surfaces and elastic half-spaces."""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, ConfigDict, Field, WithJsonSchema, field_validator, model_validator

from icha.support.rules import GRID, HURST, LENGTH, FloatRange, IntegerRange
from icha.support.values import (
    PATTERN,
    ROUNDING,
    File,
    Length,
    Modulus,
    Section,
    SurfaceEnergy,
    Text,
    integer,
    number,
    quantity,
    to_si,
)


class MaterialSection(Section):
    """An elastic half-space and its interface with a rough surface."""

    model_config = ConfigDict(title="Material")

    contact_modulus: Modulus
    """Composite elastic modulus E*."""
    surface_energy: SurfaceEnergy
    """Work of adhesion Δγ per area; `0 J/m^2` means no adhesion."""
    interaction_range: Length
    """Range ε of the attraction, which determines when asperities jump into contact. The Tabor parameter of a surface
    with rms curvature 1/R is μ = (RΔγ²/E*²)^(1/3)/ε."""
    flaw_radius: Length | None = None
    """Radius a of the largest flaw of the interface. Full contact then opens at √(πE*Δγ/(2a)), the tension at which a
    penny-shaped crack grows, if this is less than the theoretical strength 1.03 Δγ/ε. Default: no flaw."""


def _unit_of_length(value: Any) -> float:
    """Return a unit such as `um`, or a multiple of a unit such as `0.1 mm`, in metres."""
    expected = "expected a unit of length, such as 'um', or a multiple of one, such as '0.1 mm'"
    if not isinstance(value, str):
        raise ValueError(f"is not a unit; {expected}")
    is_multiple = value.strip()[:1] in tuple("+-.0123456789")
    return _length(value, expected) if is_multiple else _length(f"1 {value}", expected)


def _sides(value: Any) -> tuple[float, float]:
    """Read the sides of a scan along x and y, m: one length, or a list of two."""
    sides = value if isinstance(value, list | tuple) else [value, value]
    expected = "expected one length, such as '90 um', or a list of two: along x and y"
    if len(sides) != 2:
        raise ValueError(f"has {len(sides)} entries; {expected}")
    return _length(sides[0], expected), _length(sides[1], expected)


def _length(value: Any, expected: str) -> float:
    try:
        metres = to_si(value, "m")
    except ValueError as error:
        raise ValueError(f"{error}; {expected}") from None
    if not LENGTH.contains(metres):
        raise ValueError(f"is not in {LENGTH.interval} m; {expected}")
    return metres


UnitOfLength = Annotated[
    float, BeforeValidator(_unit_of_length), WithJsonSchema({"type": "string", "examples": ["um", "0.1 mm"]})
]
Position = quantity(FloatRange("m", least=0), "20 um")
_LENGTH_SCHEMA = {"type": "string", "pattern": PATTERN, "examples": ["90 um"]}
_SIDES_SCHEMA = {"anyOf": [_LENGTH_SCHEMA, {"type": "array", "items": _LENGTH_SCHEMA, "minItems": 2, "maxItems": 2}]}
Sides = Annotated[tuple[float, float], BeforeValidator(_sides), WithJsonSchema(_SIDES_SCHEMA)]


class Crop(Section):
    """The square to cut out of a scan."""

    x: Position
    """Distance between the left edges of the square and of the scan."""
    y: Position
    """Distance between the first rows of the square and of the scan."""
    side: Length
    """Side of the square."""


class _SurfaceFromFile(Section):
    random: ClassVar[bool] = False
    # The waves of a file are not known.
    cells_per_short_wave: ClassVar[float] = math.inf


class MeasuredSurface(_SurfaceFromFile):
    """A measured topography and its preparation. The mean height is always removed."""

    kind: Literal["measured"]
    """A topography from a measurement."""
    path: File
    """File of the topography, relative to the configuration file."""
    format: Literal["auto", "npy", "netcdf", "matrix", "xyz", "hdf5", "fourier", "instrument"] = "auto"
    """Format of the file: `npy`; `netcdf`; `matrix` (text, a row of heights per line); `xyz` (text, x y z per line in
    any order); `hdf5`; `fourier` (text, qx qy Re Im per line); `instrument` (a format of a microscope that
    SurfaceTopography can read). `auto` chooses by the ending of the file name and, for text, by the number of
    columns."""
    columns: Annotated[list[integer(IntegerRange(1))], Field(min_length=3, max_length=3)] | None = None
    """Columns of x, y and z in a text, counted from 1, such as `[1, 2, 3]`. Required if a line has more than three
    numbers."""
    data: Text | None = None
    """Array or channel to use if the file has several: name of the variable (netcdf), path of the dataset (hdf5), name
    of the channel (instrument). Default: the only one, or the default of the file."""
    first_axis: Literal["y", "x"] = "y"
    """First axis of the array in npy, netcdf, hdf5 and matrix files: `y` if a row of the array is a line along x, else
    `x`. ICHA ignores this key if the dimensions in the file are named x and y."""
    height_unit: UnitOfLength | None = None
    """Unit of the heights, such as `nm` or `0.1 mm`. Required unless the file contains it. If you give it, the unit in
    the file is not used."""
    lateral_unit: UnitOfLength | None = None
    """Unit of the coordinates x and y; with `format: fourier`, unit of 1/q. Default: the unit in the file, else the
    unit of the heights."""
    size: Sides | None = None
    """Size of the whole scan: one length, or two lengths, along x and y. The pixel size is the size of the scan divided
    by the number of pixels. Required unless the file contains it. If you give it, the size in the file is not used."""
    touches_first: Literal["high", "low"] = "high"
    """Points that touch first: those with the largest numbers in the file (`high`), or with the smallest (`low`)."""
    missing: Literal["refuse", "fill"] = "refuse"
    """Treatment of points without a height: `refuse` the file, or `fill` them with the solution of Laplace's
    equation."""
    crop: Crop | None = None
    """The square to use. Default: the largest one, in the middle."""
    detrend: Literal["none", "tilt", "curvature"] | None = None
    """Trend to remove besides the mean height: `none`, the mean plane (`tilt`), or the paraboloid that fits best
    (`curvature`). Default: `tilt`; for a periodic topography `none`."""
    cutoff: Length | None = None
    """Cut-off wavelength (nesting index) of a Gaussian S-filter (ISO 25178-3, areal filter of ISO 16610-61). The filter
    removes shorter waves and halves the amplitude of waves of this length, before the edges are treated. At least 4
    pixels. Default: no filter."""
    boundary: Literal["periodic", "window", "mirror", "free"]
    """Treatment of the edges. `periodic`: the topography repeats as it is. `window`: the heights fall smoothly to their
    mean towards the edges, and the topography repeats. `mirror`: the topography and its mirror images form a periodic
    cell of twice the side. `free`: one square on a half-space that extends beyond the square."""
    taper: number(FloatRange(above=0, most=0.5)) | None = None
    """Only with `boundary: window`: width of the strip along each edge in which the heights fall to their mean, as a
    fraction of the side. Default: 0.1."""
    grid: integer(GRID) | None = None
    """Nodes along a side of the prepared surface, which is resampled by Fourier interpolation. A coarser grid loses the
    shortest waves. Default: as many nodes as the scan has (`mirror`: twice as many)."""

    @model_validator(mode="after")
    def _check_boundary(self):
        if self.boundary == "periodic" and self.detrend not in (None, "none"):
            raise ValueError(
                f"detrend: {self.detrend!r} would break the periodicity; expected none, or another boundary"
            )
        if self.taper is not None and self.boundary != "window":
            raise ValueError(f"taper: applies only to boundary window, not to {self.boundary}. Remove the key")
        return self

    @property
    def preparation(self) -> dict:
        """Arguments of `icha.surfaces.measured.settings.Preparation`: all keys except kind and path, in SI units."""
        settings = self.model_dump(exclude={"kind", "path"})
        settings["detrend"] = self.detrend or ("none" if self.boundary == "periodic" else "tilt")
        settings["taper"] = (self.taper or 0.1) if self.boundary == "window" else None
        if self.cutoff is None:
            # Results of earlier versions, which did not have this key, stay valid.
            del settings["cutoff"]
        if self.columns is None:
            del settings["columns"]
        return settings


class SelfAffineSurface(Section):
    """A random periodic surface from spectral synthesis, self-affine with roll-off."""

    random: ClassVar[bool] = True

    kind: Literal["self_affine"]
    """A random surface with a self-affine spectrum."""
    period: Length
    """Side L of the periodic cell."""
    rolloff_wavelength: Length
    """Roll-off wavelength 2π/q0: the spectrum is flat at longer wavelengths. At most the period."""
    short_wavelength: Length
    """Shortest wavelength 2π/q1. It must be less than the roll-off wavelength and at least 2 grid cells. Less than 4
    grid cells give a warning; 8 are recommended."""
    hurst: number(HURST)
    """Hurst exponent H, in (0, 1]."""
    grid: integer(GRID)
    """Grid points along a side of the cell."""
    amplitudes: Literal["fixed", "gaussian"] = "fixed"
    """Amplitudes of the waves: `fixed` by the spectrum, so that all seeds have the same rms height and slope, or
    `gaussian`, random with the spectrum as their mean square."""

    @property
    def lengths_and_hurst(self) -> tuple[float, float, float, float]:
        """Period, roll-off and shortest wavelength (m), and the Hurst exponent."""
        return self.period, self.rolloff_wavelength, self.short_wavelength, self.hurst

    @property
    def cells_per_short_wave(self) -> float:
        """Grid cells per shortest wavelength."""
        return self.grid * self.short_wavelength / self.period

    def grid_of_cells(self, cells: int) -> int:
        """Return the smallest grid that has `cells` cells per shortest wavelength."""
        return math.ceil(cells * self.period / self.short_wavelength * (1 - ROUNDING))

    @field_validator("rolloff_wavelength", "short_wavelength", "grid")
    @classmethod
    def _check_wavelengths(cls, value, info):
        """Check the order of the wave vectors qL <= q0 < q1, and that the grid resolves them."""
        period, rolloff, short = map(info.data.get, ("period", "rolloff_wavelength", "short_wavelength"))
        if info.field_name == "rolloff_wavelength":
            if period is not None and value > period * (1 + ROUNDING):
                raise ValueError(f"is longer than the period (q0 < qL); expected at most {period:g} m")
        elif info.field_name == "short_wavelength":
            if rolloff is not None and value >= rolloff * (1 - ROUNDING):
                reason = "is not shorter than the roll-off wavelength (q1 <= q0)"
                raise ValueError(f"{reason}; expected less than {rolloff:g} m")
        elif None not in (period, short) and value * short / period < 2 * (1 - ROUNDING):
            least = math.ceil(2 * period / short * (1 - ROUNDING))
            raise ValueError(
                f"gives {value * short / period:.3g} grid cells per shortest wavelength, but at least 2 are needed; "
                f"expected at least {least}, better {2 * least} or more"
            )
        return value


class FileSurface(_SurfaceFromFile):
    """A periodic height map from a file, for example a published surface."""

    kind: Literal["file"]
    """A height map from a file."""
    path: File
    """File of a square array of heights, first axis y: `.npy`, or netCDF (`.nc`) with a variable `height`; relative to
    the configuration file. Heights are positive towards the elastic body."""
    height_unit: UnitOfLength
    """Unit of the heights in the file, such as `um`. Each study scales the heights to its rms slopes."""
    period: Length
    """Side L of the periodic cell."""


# Sections of surfaces, by their key `kind`.
SURFACE_KINDS = {"self_affine": SelfAffineSurface, "file": FileSurface, "measured": MeasuredSurface}
AnySurface = Annotated[SelfAffineSurface | FileSurface | MeasuredSurface, Field(discriminator="kind")]
