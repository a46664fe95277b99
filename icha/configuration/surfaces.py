"""Sections `surfaces` and `materials`: rough surfaces, and elastic half-spaces or layers."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    computed_field,
    field_validator,
    model_validator,
)
from pydantic.fields import FieldInfo

from icha.asperity.adhesion_map import MAPS, AdhesionMap, map_of
from icha.asperity.material import VAN_DER_WAALS_RANGE, Material
from icha.configuration.shapes import ShapeSection
from icha.support import formatting
from icha.support.checksums import sha256_of
from icha.support.input_files import problem_with_path
from icha.support.rules import GRID, HURST, LENGTH, NUMBER, POISSON_RATIO, FloatRange, IntegerRange
from icha.support.values import (
    PATTERN,
    ROUNDING,
    File,
    Length,
    Modulus,
    OrSchema,
    Section,
    Seed,
    SurfaceEnergy,
    Text,
    integer,
    number,
    quantity,
    reader,
    to_si,
)
from icha.surfaces.resolution import NYQUIST_CELLS, Resolution

# Word for a body that does not deform.
RIGID = "rigid"


class Body(Section):
    """An elastic body of a contact."""

    youngs_modulus: Modulus
    """Young's modulus E."""
    poisson_ratio: number(POISSON_RATIO)
    """Poisson ratio ν, from 0 to 0.5; rubber has nearly 0.5."""


def _body(value: Any) -> Any:
    """Return None for a rigid body; raise ValueError for other words."""
    if isinstance(value, str) and value != RIGID:
        raise ValueError("is not a body; expected `{youngs_modulus: 2 MPa, poisson_ratio: 0.5}`, or the word rigid")
    return None if value == RIGID else value


_Bodies = Annotated[
    list[Annotated[Body | None, BeforeValidator(_body), OrSchema({"const": RIGID})]], Field(min_length=2, max_length=2)
]


def _bodies_of(content: Mapping) -> Any:
    """Return the value of `bodies` of a material, with the material's own Young's modulus and Poisson ratio.

    Raises ValueError if there is no single elastic body with these values.
    """
    bodies = content.get("bodies", [{}, RIGID])
    own = {name: content[name] for name in Body.model_fields if content.get(name) is not None}
    elastic = [body for body in bodies if isinstance(body, Mapping)] if isinstance(bodies, list) else []
    if len(elastic) != 1:
        if "youngs_modulus" in own:
            raise ValueError(
                "youngs_modulus: needs `bodies` with one elastic body; expected the word rigid for the other"
            )
        return bodies
    if "youngs_modulus" in own and "poisson_ratio" not in elastic[0] | own:
        raise ValueError(
            f"poisson_ratio: the key is missing; expected {POISSON_RATIO.expected} beside `youngs_modulus`, because E* "
            "= E/(1 - ν²)"
        )
    return [body | own if isinstance(body, Mapping) else body for body in bodies]


class StripesSection(Section):
    """Stripes of two works of adhesion."""

    low: SurfaceEnergy
    """Smaller work of adhesion; the stripe at the origin has it."""
    high: SurfaceEnergy
    """Larger work of adhesion."""
    width: Length
    """Width of each stripe; on a periodic surface, two widths fit into the period a whole number of times."""
    along: Literal["x", "y"] = "x"
    """Axis along which the stripes run."""


class PatchesSection(Section):
    """Random field of works of adhesion, whose logarithm is Gaussian."""

    mean: SurfaceEnergy
    """Mean work of adhesion."""
    standard_deviation: SurfaceEnergy
    """Standard deviation of the work of adhesion."""
    correlation_length: Length
    """Distance at which the correlation of the logarithm has fallen to 1/e: two grid cells to a quarter of the side."""
    seed: Seed = 0
    """Seed of the field; all runs with the material have the same field."""


_unit_of_energy = reader(
    lambda value: to_si(f"1 {value}", "J/m^2"), NUMBER, "a unit of a work of adhesion, such as 'mJ/m^2'"
)


class AdhesionMapSection(Section):
    """Works of adhesion from place to place: stripes, patches, or a file. Only with `models: [boundary_elements]`."""

    stripes: StripesSection | None = None
    """Stripes of two works of adhesion."""
    patches: PatchesSection | None = None
    """Random patches."""
    file: File | None = None
    """Path of a NumPy file (`.npy`) with an array (grid, grid) of works of adhesion, one for each node of the surface,
    relative to the configuration file. The first axis is y."""
    unit: Annotated[float, BeforeValidator(_unit_of_energy), WithJsonSchema({"type": "string"})] | None = None
    """Unit of the numbers in the file, such as `mJ/m^2`."""

    @computed_field
    @cached_property
    def sha256(self) -> str | None:
        """SHA-256 of the file; None without."""
        return sha256_of(Path(self.file)) if self.file else None

    @property
    def field(self) -> AdhesionMap:
        """The map that the section describes."""
        return map_of(self.model_dump(exclude_none=True))

    @model_validator(mode="after")
    def _check(self):
        given = self.model_fields_set
        if len(given) != (2 if self.file else 1) or given == {"unit"} or (self.file and self.unit is None):
            raise ValueError(f"has {', '.join(sorted(given)) or 'no keys'}; expected {_ONE_MAP}")
        if self.file and (problem := problem_with_path(self.file)):
            raise ValueError(f"{self.file!r} {problem}; expected a NumPy file (`.npy`). Correct the path")
        _ = self.field  # raises ValueError for invalid values
        return self


# Works of adhesion by direction and place.
_ONE_MAP = f"one of the keys {', '.join(MAPS)}, or the keys file and unit"
_KEYS_OF_MAP = (*([name] for name in MAPS), ["file", "unit"])
_MAP = {"type": "object", "oneOf": [{"required": keys, "maxProperties": len(keys)} for keys in _KEYS_OF_MAP]}
_DIRECTIONS = {
    "type": "object",
    "required": ["advancing", "receding"],
    "additionalProperties": False,
    "properties": {
        "advancing": {"anyOf": [{"type": "string", "pattern": PATTERN, "examples": ["30 mJ/m^2"]}, _MAP]},
        "receding": {"type": "string", "pattern": PATTERN, "examples": ["90 mJ/m^2"]},
    },
}


class MaterialSection(Section):
    """Material of the elastic body, and adhesion between this body and the rough surface."""

    model_config = ConfigDict(title="Material")

    bodies: _Bodies | None = Field(
        default=None,
        exclude=True,
        description="The two bodies, instead of `contact_modulus`, such as `[{youngs_modulus: 2 MPa, poisson_ratio: "
        "0.5}, rigid]`. Their contact modulus is 1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2.",
    )
    youngs_modulus: Modulus | None = Field(
        default=None,
        exclude=True,
        description="Young's modulus E of an elastic body on a rigid one, together with `poisson_ratio`: E* = E/(1 - "
        "ν²). Beside `bodies` with one elastic body, the two keys replace its values, so that a study can vary them.",
    )
    contact_modulus: Modulus
    """Composite elastic modulus E* (contact modulus). Required without `bodies` and `youngs_modulus`."""
    surface_energy: Annotated[SurfaceEnergy, OrSchema({"anyOf": [_DIRECTIONS, _MAP]})]
    """Work of adhesion Δγ. The value `0 J/m^2` means no adhesion. With `{advancing: 30 mJ/m^2, receding: 90 mJ/m^2}`,
    the edge of a contact advances at a smaller work of adhesion than it recedes, and stands in between. With
    `{stripes: …}`, `{patches: …}` or `{file: map.npy, unit: mJ/m^2}`, it differs from place to place: see
    `adhesion_map`. The advancing value may be such a map; the receding one is then a mean, and both have the same
    factors from place to place."""
    receding_energy: SurfaceEnergy | None = None
    """Work of adhesion of a receding edge, for studies that vary it; `surface_energy` with two values sets it. Default:
    that of an advancing edge."""
    adhesion_map: AdhesionMapSection | None = None
    """Works of adhesion from place to place, relative to their mean; `surface_energy` with a map sets it."""
    interaction_range: Length = Field(default=f"{VAN_DER_WAALS_RANGE * 1e9:g} nm", validate_default=True)
    """Range ε of the attraction. The range determines when asperities jump into contact. Boundary elements have this
    range if the grid resolves it. The Tabor parameter is μ =
    (RΔγ²/E*²)^(1/3)/ε, where 1/R is the rms curvature of the surface. The default is about the distance between
    molecules, as for van der Waals forces."""
    flaw_radius: Length | None = None
    """Radius a of the largest flaw of the interface. A flaw grows as a penny-shaped crack at the tension √(πE*Δγ/(2a)).
    Full contact opens at the smaller of this tension and the theoretical strength 1.03 Δγ/ε. Default: no flaw."""
    thickness: Length | None = None
    """Thickness of an elastic layer that is bonded to a rigid base. Only with `models: [boundary_elements]`. Default: a
    half-space, which is infinitely thick."""
    poisson_ratio: number(POISSON_RATIO) | None = None
    """Poisson ratio of the layer or of the body with `youngs_modulus`, from 0 to 0.5; rubber has nearly 0.5. Required
    with `thickness`. A half-space with a given E* does not depend on this ratio."""

    @property
    def material(self) -> Material:
        """The material that the section describes."""
        return Material(**self.model_dump(exclude_none=True))

    @property
    def reads_poisson_ratio(self) -> bool:
        """Whether the key `poisson_ratio` changes results: by a layer, or by E* of a single elastic body."""
        single = self.bodies is not None and sum(body is not None for body in self.bodies) == 1
        return self.thickness is not None or self.youngs_modulus is not None or single

    @model_validator(mode="before")
    @classmethod
    def _combine_bodies(cls, content: Any) -> Any:
        """Compute the contact modulus, and the Poisson ratio of a layer, from the bodies."""
        given = content if isinstance(content, Mapping) else {}
        key = next((key for key in ("bodies", "youngs_modulus") if given.get(key) is not None), None)
        if key is None:
            return content
        if "contact_modulus" in content:
            raise ValueError(f"{key}: is given beside `contact_modulus`; expected one of both keys")
        try:
            bodies = TypeAdapter(_Bodies).validate_python(_bodies_of(content))
        except ValidationError:
            # The field reports the problem. The placeholder prevents a second message about the contact modulus.
            return {**content, "contact_modulus": "1 Pa"}
        elastic = [body for body in bodies if body is not None]
        if not elastic:
            raise ValueError("bodies: both bodies are rigid; expected at least one with youngs_modulus, poisson_ratio")
        modulus = 1 / sum((1 - body.poisson_ratio**2) / body.youngs_modulus for body in elastic)
        combined = {**content, "contact_modulus": f"{modulus!r} Pa"}
        if len(elastic) == 1 and content.get("thickness") is not None:
            combined.setdefault("poisson_ratio", elastic[0].poisson_ratio)
        return combined

    @model_validator(mode="before")
    @classmethod
    def _divide_energy(cls, content: Any, info: ValidationInfo) -> Any:
        """Divide a work of adhesion by direction and place into three keys."""
        energy = content.get("surface_energy") if isinstance(content, Mapping) else None
        if isinstance(energy, Mapping) and set(energy) == {"advancing", "receding"}:
            if content.get("receding_energy") is not None:
                raise ValueError("receding_energy: is given beside surface_energy.receding; expected one of both")
            content = {**content, "surface_energy": energy["advancing"], "receding_energy": energy["receding"]}
            energy = energy["advancing"]
        if not isinstance(energy, Mapping):
            return content
        if not {*MAPS, "file"}.intersection(energy):
            keys = ", ".join(map(str, energy)) or "no keys"
            raise ValueError(
                f"surface_energy: has {keys}; expected one value, the keys advancing and receding, or {_ONE_MAP}"
            )
        if content.get("adhesion_map") is not None:
            raise ValueError("adhesion_map: is given beside a map in surface_energy; expected one of both")
        try:
            mean = AdhesionMapSection.model_validate(energy, context=info.context).field.mean
        except ValidationError:
            mean = 1.0  # the map reports the problem
        return {**content, "surface_energy": f"{mean!r} J/m^2", "adhesion_map": energy}

    @model_validator(mode="after")
    def _check(self):
        _ = self.material  # raises ValueError for works of adhesion that do not fit each other
        if self.thickness is not None and self.poisson_ratio is None:
            reason = f"the key is missing; a layer with thickness {formatting.length(self.thickness)} needs it"
            raise ValueError(f"poisson_ratio: {reason}; expected {POISSON_RATIO.expected}, such as 0.5 for rubber")
        return self


def _unit_of_length(value: Any) -> float:
    """Convert a unit such as `um`, or a multiple of a unit such as `0.1 mm`, to metres."""
    expected = "expected a unit of length, such as 'um', or a multiple of a unit, such as '0.1 mm'"
    if not isinstance(value, str):
        raise ValueError(f"is not a unit; {expected}")
    is_multiple = value.strip()[:1] in tuple("+-.0123456789")
    return _length(value, expected) if is_multiple else _length(f"1 {value}", expected)


def _sides(value: Any) -> tuple[float, ...]:
    """Return the sides of a scan, m: one length of a square, or two lengths along x and y."""
    several = isinstance(value, list | tuple)
    expected = "expected one length, such as '90 um', or a list of two lengths, along x and y"
    if several and len(value) != 2:
        raise ValueError(f"has {len(value)} entries; {expected}")
    return tuple(_length(each, expected) for each in (value if several else [value]))


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
Sides = Annotated[tuple[float, ...], BeforeValidator(_sides), WithJsonSchema(_SIDES_SCHEMA)]


class Crop(Section):
    """The square that is cut out of a scan."""

    x: Position
    """Distance from the left edge of the scan to the left edge of the square."""
    y: Position
    """Distance from the first row of the scan to the first row of the square."""
    side: Length
    """Side of the square."""


_SHAPE = Field(
    default=None,
    description="Smooth shape that carries the roughness, such as `{sphere: {radius: 1 mm}}`, with its apex in the "
    "middle of the square. A shape needs `boundary: free`, which is then the default. Default: no shape.",
)
_BOUNDARY = Field(
    default="periodic",
    description="`periodic`: the surface repeats. `free`: a single square; the elastic body is larger than the square. "
    "Default: `periodic`, or `free` with a shape.",
)


class _Surface(Section):
    """Base class of surfaces.

    Attributes
    ----------
    random : whether the surface has seeds.
    from_file : whether the heights come from the file `path`.
    smooth : whether the surface has no roughness, so that it has no rms slopes.
    """

    random: ClassVar[bool] = False
    from_file: ClassVar[bool] = False
    smooth: ClassVar[bool] = False

    @property
    def free(self) -> bool:
        """True for a single square, False for a periodic surface."""
        return self.shape is not None or self.boundary == "free"

    @model_validator(mode="after")
    def _check_free(self):
        if self.shape is not None and "boundary" in self.model_fields_set and self.boundary != "free":
            raise ValueError(
                f"boundary: {self.boundary!r} with a shape; expected free, because a shape does not repeat"
            )
        # Side and grid of other surfaces are known when their file is read.
        if self.shape is not None and (self.random or self.smooth):
            if problem := self.shape.problem(self.period, self.grid):
                raise ValueError(problem)
        return self


class _SurfaceFromFile(_Surface):
    from_file: ClassVar[bool] = True


class MeasuredSurface(_SurfaceFromFile):
    """A measured topography, and its preparation for contact models. The mean height is always removed."""

    kind: Literal["measured"]
    """A topography from a measurement."""
    path: File
    """Path of the topography file, relative to the configuration file."""
    format: Literal["auto", "npy", "npz", "matlab", "netcdf", "matrix", "xyz", "hdf5", "instrument"] = "auto"
    """Format of the file: `npy`; `npz`; `matlab`; `netcdf`; `hdf5`; `matrix` (text, a row of heights in each line);
    `xyz` (text, x y z in each line, in any order); `instrument` (a microscope's format that SurfaceTopography can
    read). With `auto`, ICHA chooses the format by the content of the file, the ending of its name and, for text, the
    number of columns."""
    columns: Annotated[list[integer(IntegerRange(1))], Field(min_length=3, max_length=3)] | None = None
    """Numbers (from 1) of the columns x, y and z of a text file, such as `[1, 2, 3]`. This key is required if
    the file has more than three columns."""
    data: Text | None = None
    """Array or channel with the heights, if the file has several arrays or channels: name of the array (npz, matlab) or
    variable (netcdf), path of the dataset (hdf5), or name of the channel (instrument). Default: the only array, or the
    default channel."""
    first_axis: Literal["y", "x"] = "y"
    """First axis of an array whose axes have no names (npy, npz, matlab, netcdf, hdf5, matrix): `y` if each row of the
    array is a line along x, else `x`. ICHA refuses `x` for a file that states otherwise."""
    height_unit: UnitOfLength | None = None
    """Unit of the heights, such as `nm` or `0.1 mm`. Required for a file without this unit. The key replaces the
    unit in the file."""
    lateral_unit: UnitOfLength | None = None
    """Unit of the coordinates x and y. Default: the unit in the file. Required if the file contains coordinates without
    a unit, and `size` is not given."""
    size: Sides | None = None
    """Size of the whole scan: one length if the scan is square, or a list of two lengths, along x and y. The size of a
    pixel is the size of the scan divided by the number of pixels. Required if the file does not contain the size. This
    key replaces the size in the file."""
    touches_first: Literal["high", "low"] = "high"
    """Points that touch the elastic body first: the points with the largest (`high`) or the smallest (`low`) numbers in
    the file."""
    missing: Literal["refuse", "fill"] = "refuse"
    """Treatment of points without a height. `refuse`: ICHA refuses the file. `fill`: the solution of Laplace's equation
    fills the points."""
    scattered: Literal["refuse", "interpolate"] = "refuse"
    """Treatment of points of an xyz file that are on no regular grid. `refuse`: ICHA refuses the file. `interpolate`:
    linear interpolation on triangles gives the heights on a grid with as many points per area."""
    outliers: Literal["keep", "remove"] = "keep"
    """Treatment of outliers: points that deviate from the points around them by far more than other points. `remove`
    replaces outliers by the solution of Laplace's equation."""
    levelling: Literal["none", "lines", "columns"] = "none"
    """Removal of offsets between scan lines, as of scanning probe microscopes: the mean height of each line of points
    along x (`lines`) or y (`columns`) and, if the tilts of the lines also have steps, the tilt of each line. This also
    removes the mean height that the surface itself has along each line."""
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
    shape: ShapeSection | None = _SHAPE

    @field_validator("height_unit", "lateral_unit", "size", mode="before")
    @classmethod
    def _check_not_empty(cls, value: Any) -> Any:
        if value is None:
            raise ValueError("expected a value with its unit; leave the key out if the file contains it")
        return value

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
        """Arguments of `icha.surfaces.measured.settings.Preparation`, in SI units: all keys of the preparation."""
        settings = self.model_dump(exclude={"kind", "path", "shape"})
        settings["detrend"] = self.detrend or ("none" if self.boundary == "periodic" else "tilt")
        settings["size"] = self.size and (self.size[0], self.size[-1])
        settings["taper"] = (self.taper or 0.1) if self.boundary == "window" else None
        # Without keys that were added later and have their defaults, checksums and old results remain valid.
        defaults = {"cutoff": None, "columns": None, "scattered": "refuse", "outliers": "keep", "levelling": "none"}
        return {key: value for key, value in settings.items() if key not in defaults or value != defaults[key]}


class SelfAffineSurface(_Surface):
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
    cells. Less than 4 grid cells must be confirmed; 8 grid cells are recommended."""
    hurst: number(HURST)
    """Hurst exponent H, in (0, 1]."""
    grid: integer(GRID)
    """Number of nodes along a side of the periodic cell."""
    amplitudes: Literal["fixed", "gaussian"] = "fixed"
    """Amplitudes of the waves. `fixed`: the spectrum gives the square of each amplitude, so the ratio of rms height and
    rms slope is the same for all seeds. `gaussian`: amplitudes are random, and the spectrum gives the mean square of
    each amplitude. A study then scales the heights of each seed to its rms slope, or to its rms height."""
    boundary: Literal["periodic", "free"] = _BOUNDARY
    shape: ShapeSection | None = _SHAPE

    @property
    def lengths_and_hurst(self) -> tuple[float, float, float, float]:
        """Period, roll-off wavelength and shortest wavelength, m, and Hurst exponent."""
        return self.period, self.rolloff_wavelength, self.short_wavelength, self.hurst

    @property
    def rms_height_at_unit_slope(self) -> float:
        """Rms height of the spectrum at rms slope 1, m; with `amplitudes: gaussian`, root of the mean square."""
        from icha.surfaces.spectrum import SelfAffineSpectrum  # imports SciPy, which takes time

        return SelfAffineSpectrum(*self.lengths_and_hurst).rms_height

    @field_validator("rolloff_wavelength", "short_wavelength", "grid")
    @classmethod
    def _check_wavelengths(cls, value, info):
        """Check that period >= roll-off > shortest wavelength, and that the grid resolves the shortest wavelength."""
        period, rolloff, short = map(info.data.get, ("period", "rolloff_wavelength", "short_wavelength"))
        if info.field_name == "rolloff_wavelength":
            if period is not None and value > period * (1 + ROUNDING):
                raise ValueError(f"is longer than the period; expected at most {formatting.length(period)}")
        elif info.field_name == "short_wavelength":
            if rolloff is not None and value >= rolloff * (1 - ROUNDING):
                reason = "is not shorter than the roll-off wavelength"
                raise ValueError(f"{reason}; expected less than {formatting.length(rolloff)}")
        elif None not in (period, short):
            resolution = Resolution(value * short / period)
            if not resolution.representable:
                reason = f"gives {resolution}, but at least {NYQUIST_CELLS} are needed"
                raise ValueError(f"{reason}; expected {resolution.grids(value)}")
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
    boundary: Literal["periodic", "free"] = _BOUNDARY
    shape: ShapeSection | None = _SHAPE


class SpectrumSurface(_SurfaceFromFile):
    """A random periodic surface with the spectrum in a table, such as the merged spectrum of several scans."""

    random: ClassVar[bool] = True

    kind: Literal["spectrum"]
    """A random surface with the spectrum of a table."""
    path: File
    """Path of a text file with two columns, the wave number q and the power spectral density C(q) of an isotropic
    surface, relative to the configuration file. `icha.merge_spectra` makes such a file from scans."""
    length_unit: UnitOfLength | None = None
    """Unit of length of the table, such as `um`: q is in rad/um, and C in um⁴. Default: the units in the titles of the
    columns, or m."""
    convention: (
        Literal["surface", "surface_jacobs", "surface_frequency", "profile", "profile_jacobs", "profile_frequency"]
        | None
    ) = None
    """Convention of the power spectral density: the integral of the table that is the mean square height. `surface`:
    2π∫qC dq. `surface_jacobs` (as on contact.engineering): ∫qC dq/(2π). `surface_frequency` (first column f = q/2π):
    2π∫fC df. Of profiles of an isotropic surface, for q > 0 or f > 0: `profile`: 2∫C dq. `profile_jacobs`: ∫C dq/π.
    `profile_frequency`: ∫C df. Default: `surface`; required if the titles state a unit of q without rad, or m³."""
    period: Length
    """Side L of the periodic cell. Waves longer than the cell are left out."""
    grid: integer(GRID)
    """Number of nodes along a side of the periodic cell. The shortest wave of the table needs at least 2 cells; less
    than 4 cells must be confirmed; 8 cells are recommended."""
    amplitudes: Literal["fixed", "gaussian"] = "fixed"
    """Amplitudes of the waves, as for `kind: self_affine`."""
    boundary: Literal["periodic", "free"] = _BOUNDARY
    shape: ShapeSection | None = _SHAPE


class SmoothSurface(_Surface):
    """A shape alone, without roughness. A study uses it once, without seeds and rms slopes."""

    smooth: ClassVar[bool] = True
    boundary: ClassVar[str] = "free"

    kind: Literal["smooth"]
    """A shape without roughness."""
    shape: ShapeSection
    """The shape, such as `{sphere: {radius: 1 mm}}`, with its apex in the middle of the square."""
    side: Length
    """Side of the square. Contact must not reach its edges."""
    grid: integer(GRID)
    """Number of nodes along the side of the square. At every target, a contact radius of less than 4 cells must be
    confirmed; 8 cells are recommended."""

    @property
    def period(self) -> float:
        """Side of the square, m."""
        return self.side


# Classes of the sections of surfaces, by the value of the key `kind`.
SURFACE_KINDS = {
    "self_affine": SelfAffineSurface,
    "file": FileSurface,
    "measured": MeasuredSurface,
    "smooth": SmoothSurface,
    "spectrum": SpectrumSurface,
}
AnySurface = Annotated[
    SelfAffineSurface | FileSurface | MeasuredSurface | SmoothSurface | SpectrumSurface, Field(discriminator="kind")
]
# Parameters that a study may vary: all keys of surfaces and materials except these. The description of `boundary` is
# that of measured surfaces, which have most values.
_NOT_VARIED = ("kind", "path", "crop", "shape", "bodies")
PARAMETERS: dict[str, FieldInfo] = {}
for _section in (*SURFACE_KINDS.values(), MaterialSection):
    for _name, _field in _section.model_fields.items():
        if _name not in _NOT_VARIED and (_name != "boundary" or _section is MeasuredSurface):
            PARAMETERS.setdefault(_name, _field)
