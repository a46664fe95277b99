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
    """Material of the elastic half-space, and adhesion between the half-space and the rough surface."""

    model_config = ConfigDict(title="Material")

    contact_modulus: Modulus
    """Composite elastic modulus E* (contact modulus)."""
    surface_energy: SurfaceEnergy
    """Work of adhesion Δγ. The value `0 J/m^2` means no adhesion."""
    interaction_range: Length
    """Range ε of the attraction. The range determines when asperities jump into contact. The Tabor parameter is μ =
    (RΔγ²/E*²)^(1/3)/ε, where 1/R is the rms curvature of the surface."""
    flaw_radius: Length | None = None
    """Radius a of the largest flaw of the interface. A flaw grows as a penny-shaped crack at the tension √(πE*Δγ/(2a)).
    Full contact opens at the smaller of this tension and the theoretical strength 1.03 Δγ/ε. Default: no flaw."""


def _unit_of_length(value: Any) -> float:
    """Convert a unit such as `um`, or a multiple of a unit such as `0.1 mm`, to metres."""
    expected = "expected a unit of length, such as 'um', or a multiple of a unit, such as '0.1 mm'"
    if not isinstance(value, str):
        raise ValueError(f"is not a unit; {expected}")
    is_multiple = value.strip()[:1] in tuple("+-.0123456789")
    return _length(value, expected) if is_multiple else _length(f"1 {value}", expected)


def _sides(value: Any) -> tuple[float, float]:
    """Return the sides of a scan along x and y, m, from one length or a list of two lengths."""
    sides = value if isinstance(value, list | tuple) else [value, value]
    expected = "expected one length, such as '90 um', or a list of two lengths, along x and y"
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
    """The square that is cut out of a scan."""

    x: Position
    """Distance from the left edge of the scan to the left edge of the square."""
    y: Position
    """Distance from the first row of the scan to the first row of the square."""
    side: Length
    """Side of the square."""


class _SurfaceFromFile(Section):
    random: ClassVar[bool] = False
    # The shortest wavelength of a surface from a file is unknown.
    cells_per_short_wave: ClassVar[float] = math.inf


class MeasuredSurface(_SurfaceFromFile):
    """A measured topography, and its preparation for contact models. The mean height is always removed."""

    kind: Literal["measured"]
    """A topography from a measurement."""
    path: File
    """Path of the topography file, relative to the configuration file."""
    format: Literal["auto", "npy", "netcdf", "matrix", "xyz", "hdf5", "fourier", "instrument"] = "auto"
    """Format of the file: `npy`; `netcdf`; `matrix` (text, a row of heights in each line); `xyz` (text, x y z in each
    line, in any order); `hdf5`; `fourier` (text, qx qy Re Im in each line); `instrument` (a microscope's format that
    SurfaceTopography can read). With `auto`, ICHA chooses the format by the ending of the file name and, for text, by
    the number of columns."""
    columns: Annotated[list[integer(IntegerRange(1))], Field(min_length=3, max_length=3)] | None = None
    """Numbers (from 1) of the columns x, y and z of a text file, such as `[1, 2, 3]`. This key is required if
    the file has more than three columns."""
    data: Text | None = None
    """Array or channel with the heights, if the file has several arrays or channels: name of the variable (netcdf),
    path of the dataset (hdf5), or name of the channel (instrument). Default: the only array, or the default channel."""
    first_axis: Literal["y", "x"] = "y"
    """First axis of the array in npy, netcdf, hdf5 and matrix files: `y` if each row of the array is a line along x,
    else `x`. ICHA ignores this key if the dimensions in the file have the names x and y."""
    height_unit: UnitOfLength | None = None
    """Unit of the heights, such as `nm` or `0.1 mm`. Required for a file without this unit. The key replaces the
    unit in the file."""
    lateral_unit: UnitOfLength | None = None
    """Unit of the coordinates x and y; with `format: fourier`, unit of 1/q. Default: the unit in the file. If the
    file has no such unit, the default is the unit of the heights."""
    size: Sides | None = None
    """Size of the whole scan: one length, or a list of two lengths, along x and y. The size of a pixel is the size of
    the scan divided by the number of pixels. Required if the file does not contain the size. This key replaces the size
    in the file."""
    touches_first: Literal["high", "low"] = "high"
    """Points that touch the elastic body first: the points with the largest (`high`) or the smallest (`low`) numbers in
    the file."""
    missing: Literal["refuse", "fill"] = "refuse"
    """Treatment of points without a height. `refuse`: ICHA refuses the file. `fill`: the solution of Laplace's equation
    fills the points."""
    crop: Crop | None = None
    """The square to cut out of the scan. Default: the largest square in the middle of the scan."""
    detrend: Literal["none", "tilt", "curvature"] | None = None
    """Trend to remove in addition to the mean height: `none`, the best plane (`tilt`), or the best paraboloid
    (`curvature`) in the least-squares sense. Default: `tilt`, or `none` with `boundary: periodic`."""
    cutoff: Length | None = None
    """Cut-off wavelength, or nesting index, of a Gaussian S-filter (ISO 25178-3 and ISO 16610-61). The filter weakens
    short waves: a wave as long as the cut-off keeps half of its amplitude. The edges are treated after the filter.
    The cut-off must be at least 4 pixels. Default: no filter."""
    boundary: Literal["periodic", "window", "mirror", "free"]
    """Treatment of the edges. `periodic`: the unchanged topography repeats. `window`: the heights fall smoothly to the
    mean height at the edges, and the topography repeats. `mirror`: the topography and its mirror images form a periodic
    cell of twice the side. `free`: the topography is a single square; the half-space is larger than the square."""
    taper: number(FloatRange(above=0, most=0.5)) | None = None
    """Width of the strip along each edge, divided by the side of the square. In this strip the heights fall to the mean
    height. Only with `boundary: window`. Default: 0.1."""
    grid: integer(GRID) | None = None
    """Number of nodes along a side of the prepared surface. Fourier interpolation resamples the heights to this grid. A
    coarser grid loses the shortest waves. Default: the number of nodes of the scan (with `mirror`, twice this
    number)."""

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
        """Arguments of `icha.surfaces.measured.settings.Preparation`, in SI units: all keys except kind and path."""
        settings = self.model_dump(exclude={"kind", "path"})
        settings["detrend"] = self.detrend or ("none" if self.boundary == "periodic" else "tilt")
        settings["taper"] = (self.taper or 0.1) if self.boundary == "window" else None
        if self.cutoff is None:
            # Settings without this key have the same checksums as in earlier versions, so old results remain valid.
            del settings["cutoff"]
        if self.columns is None:
            del settings["columns"]
        return settings


class SelfAffineSurface(Section):
    """A random periodic surface with a self-affine spectrum with roll-off, generated by spectral synthesis."""

    random: ClassVar[bool] = True

    kind: Literal["self_affine"]
    """A random surface with a self-affine spectrum."""
    period: Length
    """Side L of the periodic cell."""
    rolloff_wavelength: Length
    """Roll-off wavelength 2π/q0, at most the period. At longer wavelengths the spectrum is constant."""
    short_wavelength: Length
    """Shortest wavelength 2π/q1. This wavelength must be less than the roll-off wavelength and at least 2 grid
    cells. Less than 4 grid cells cause a warning; 8 grid cells are recommended."""
    hurst: number(HURST)
    """Hurst exponent H, in (0, 1]."""
    grid: integer(GRID)
    """Number of nodes along a side of the periodic cell."""
    amplitudes: Literal["fixed", "gaussian"] = "fixed"
    """Amplitudes of the waves. `fixed`: the spectrum gives the square of each amplitude, so all seeds have the same rms
    height and slope. `gaussian`: amplitudes are random, and the spectrum gives the mean square of each amplitude."""

    @property
    def lengths_and_hurst(self) -> tuple[float, float, float, float]:
        """Period, roll-off wavelength and shortest wavelength, m, and Hurst exponent."""
        return self.period, self.rolloff_wavelength, self.short_wavelength, self.hurst

    @property
    def cells_per_short_wave(self) -> float:
        """Number of grid cells per shortest wavelength."""
        return self.grid * self.short_wavelength / self.period

    def grid_of_cells(self, cells: int) -> int:
        """Return the smallest grid that has `cells` cells per shortest wavelength."""
        return math.ceil(cells * self.period / self.short_wavelength * (1 - ROUNDING))

    @field_validator("rolloff_wavelength", "short_wavelength", "grid")
    @classmethod
    def _check_wavelengths(cls, value, info):
        """Check that period >= roll-off > shortest wavelength, and that the grid resolves the shortest wavelength."""
        period, rolloff, short = map(info.data.get, ("period", "rolloff_wavelength", "short_wavelength"))
        if info.field_name == "rolloff_wavelength":
            if period is not None and value > period * (1 + ROUNDING):
                raise ValueError(f"is longer than the period; expected at most {period:g} m")
        elif info.field_name == "short_wavelength":
            if rolloff is not None and value >= rolloff * (1 - ROUNDING):
                reason = "is not shorter than the roll-off wavelength"
                raise ValueError(f"{reason}; expected less than {rolloff:g} m")
        elif None not in (period, short) and value * short / period < 2 * (1 - ROUNDING):
            least = math.ceil(2 * period / short * (1 - ROUNDING))
            raise ValueError(
                f"gives {value * short / period:.3g} grid cells per shortest wavelength, but at least 2 are needed; "
                f"expected at least {least}, better {2 * least} or more"
            )
        return value


class FileSurface(_SurfaceFromFile):
    """A periodic height map from a file, such as a published surface."""

    kind: Literal["file"]
    """A height map from a file."""
    path: File
    """Path of a file with a square array of heights, relative to the configuration file. The file is `.npy`, or netCDF
    (`.nc`) with a variable `height`. The first axis is y. Heights are positive towards the elastic body."""
    height_unit: UnitOfLength
    """Unit of the heights in the file, such as `um`. Each study scales the heights to the rms slopes of the study."""
    period: Length
    """Side L of the periodic cell."""


# Classes of the sections of surfaces, by the value of the key `kind`.
SURFACE_KINDS = {"self_affine": SelfAffineSurface, "file": FileSurface, "measured": MeasuredSurface}
AnySurface = Annotated[SelfAffineSurface | FileSurface | MeasuredSurface, Field(discriminator="kind")]
