"""Works of adhesion that differ from place to place: stripes, random patches, and maps on the nodes of a surface."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from icha.support.checksums import refuse_changed
from icha.support.input_files import RefusedFile, bounded_memory, require_room
from icha.support.rules import LENGTH, SEED, SURFACE_ENERGY

# Waves of a random field whose amplitude is below this part of the largest one are left out.
_SMALLEST_AMPLITUDE = 1e-8


@dataclass(frozen=True)
class Stripes:
    """Stripes of two works of adhesion, low and high in turn; the first low stripe begins at the origin.

    Parameters
    ----------
    low, high : works of adhesion, J/m^2.
    width : width of each stripe, m. On a periodic surface, two widths fit into the side a whole number of times.
    along : "x" or "y", the axis along which the stripes run.
    """

    low: float
    high: float
    width: float
    along: str = "x"
    kind = "stripes"

    def __post_init__(self):
        """Check the values."""
        for name, rule in (("low", SURFACE_ENERGY), ("high", SURFACE_ENERGY), ("width", LENGTH)):
            object.__setattr__(self, name, rule.validate(name, getattr(self, name)))
        if not 0 < self.low < self.high:
            raise ValueError(f"low: {self.low:g} J/m^2, and high {self.high:g} J/m^2; expected 0 < low < high")
        if self.along not in ("x", "y"):
            raise ValueError(f"along: {self.along!r}; expected x or y")

    @property
    def mean(self) -> float:
        """Mean work of adhesion, J/m^2."""
        return 0.5 * (self.low + self.high)

    def on_nodes(self, grid: int, side: float, *, periodic: bool) -> np.ndarray:
        """Return the work of adhesion at the nodes of a square, (n, n), J/m^2; a node has the value of its middle."""
        pairs = side / (2 * self.width)
        if periodic and (round(pairs) < 1 or abs(pairs - round(pairs)) > 1e-6 * pairs):
            raise ValueError(
                f"width: {self.width:g} m does not divide the period {side:g} m into pairs of stripes; expected "
                f"{side / (2 * max(round(pairs), 1)):.6g} m"
            )
        if self.width < side / grid:
            raise ValueError(f"width: {self.width:g} m is less than a grid cell, {side / grid:g} m")
        across = (np.arange(grid) + 0.5) * (side / grid) / self.width
        values = np.where(np.floor(across) % 2 == 0, self.low, self.high)
        return np.broadcast_to(values[:, None] if self.along == "x" else values, (grid, grid)).copy()


@dataclass(frozen=True)
class Patches:
    """Random field of works of adhesion: its logarithm is Gaussian, so that every value is positive.

    The logarithm has the correlation exp(-r^2/l^2). Mean and standard deviation are those of the distribution.

    Parameters
    ----------
    mean, standard_deviation : of the work of adhesion, J/m^2.
    correlation_length : l, m.
    seed : seed of the field.
    """

    mean: float
    standard_deviation: float
    correlation_length: float
    seed: int = 0
    kind = "patches"

    def __post_init__(self):
        """Check the values."""
        rules = {"mean": SURFACE_ENERGY, "standard_deviation": SURFACE_ENERGY}
        rules |= {"correlation_length": LENGTH, "seed": SEED}
        for name, rule in rules.items():
            object.__setattr__(self, name, rule.validate(name, getattr(self, name)))
        if not self.mean > 0:
            raise ValueError(f"mean: {self.mean:g} J/m^2; expected a positive value")

    def on_nodes(self, grid: int, side: float, *, periodic: bool) -> np.ndarray:
        """Return the work of adhesion at the nodes of a square, (n, n), J/m^2. The field is always periodic."""
        if not 2 * side / grid <= self.correlation_length <= side / 4:
            raise ValueError(
                f"correlation_length: {self.correlation_length:g} m; expected two grid cells, {2 * side / grid:g} m, "
                f"to a quarter of the side, {side / 4:g} m"
            )
        waves = np.fft.fftfreq(grid, side / grid)
        q = 2 * np.pi * np.hypot(waves[:, None], waves)
        amplitude = np.exp(-(q**2) * self.correlation_length**2 / 8)
        amplitude[0, 0] = 0.0
        random = np.random.Generator(np.random.PCG64(self.seed)).standard_normal((grid, grid))
        field = np.fft.ifft2(np.fft.fft2(random) * amplitude * (amplitude > _SMALLEST_AMPLITUDE)).real
        variance = math.log1p((self.standard_deviation / self.mean) ** 2)
        values = np.exp(math.sqrt(variance) * (field - field.mean()) / field.std())
        return self.mean * values / values.mean()


@dataclass(frozen=True, eq=False)
class NodeValues:
    """Works of adhesion on the nodes of a surface, (n, n), J/m^2, with rows along y and columns along x."""

    values: np.ndarray
    kind = "map"

    def __post_init__(self):
        """Check the values."""
        values = np.array(self.values, dtype=float)
        if values.ndim != 2 or len(set(values.shape)) != 1 or not values.size:
            raise ValueError(
                f"surface_energy: the map has the shape {values.shape}; expected (n, n), a value for each node of the "
                "surface"
            )
        wrong = ~np.isfinite(values) | (values <= 0)
        if wrong.any():
            row, column = map(int, np.argwhere(wrong)[0])
            raise ValueError(
                f"surface_energy: {wrong.sum()} of {wrong.size} values of the map, the first [{row}, {column}] = "
                f"{values[row, column]:g} J/m^2; expected positive numbers. Replace these values"
            )
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    @cached_property
    def _identity(self):
        return hashlib.sha256(self.values.tobytes()).hexdigest(), self.values.shape

    def __eq__(self, other: object) -> bool:
        """Return whether two maps have the same values."""
        return isinstance(other, NodeValues) and self._identity == other._identity

    def __hash__(self) -> int:
        """Return the hash of the values."""
        return hash(self._identity)

    def __repr__(self) -> str:
        """Return a text that differs for maps of different values."""
        return f"NodeValues({self._identity})"

    @property
    def mean(self) -> float:
        """Mean work of adhesion, J/m^2."""
        return float(self.values.mean())

    def on_nodes(self, grid: int, side: float, *, periodic: bool) -> np.ndarray:
        """Return the values; raise ValueError if the surface has another number of nodes."""
        if self.values.shape != (grid, grid):
            raise ValueError(
                f"surface_energy: the map has {self.values.shape} values; expected {(grid, grid)}, a value for each "
                "node of the surface. Interpolate the map"
            )
        return self.values


@lru_cache(maxsize=4)
def read_map(file: str, unit: float, sha256: str) -> NodeValues:
    """Read works of adhesion on the nodes of a surface.

    Parameters
    ----------
    file : path of a NumPy file (`.npy`) with an array (n, n); the first axis is y.
    unit : unit of the numbers in the file, J/m^2.
    sha256 : expected checksum of the file.

    Raises
    ------
    ValueError
        If the file has changed, is not a NumPy file, or has other values than positive numbers.
    """
    refuse_changed(file, sha256)
    try:
        # A mapped array cannot be larger than its file. NumPy warns of an overflow before it refuses the array.
        with bounded_memory(), np.errstate(over="ignore"):
            values = np.lib.format.open_memmap(file, mode="r")
            require_room(3 * 8 * values.size)
            if values.dtype.kind not in "iuf":
                raise ValueError(f"{values.dtype} values")
            return NodeValues(values * unit)
    except RefusedFile as error:
        raise ValueError(f"surface_energy: {error}") from None
    except (ValueError, OSError, EOFError, SyntaxError) as error:
        if str(error).startswith("surface_energy"):
            raise
        raise ValueError(
            "surface_energy: the file is no NumPy array of numbers; expected a file `.npy` from `numpy.save`"
        ) from None


AdhesionMap = Stripes | Patches | NodeValues
# Names of the maps in configurations.
MAPS = {each.kind: each for each in (Stripes, Patches)}


def map_of(value: object) -> AdhesionMap | None:
    """Return the map that a value describes, else None.

    The value is a map, an array, a name in `MAPS` with its parameters, or a mapping of the arguments of `read_map`.
    """
    if isinstance(value, Stripes | Patches | NodeValues):
        return value
    if isinstance(value, dict) and "file" in value:
        return read_map(str(value["file"]), value["unit"], value["sha256"])
    if isinstance(value, dict) and len(value) == 1 and next(iter(value)) in MAPS:
        (name, parameters), *_ = value.items()
        return MAPS[name](**parameters)
    return NodeValues(value) if isinstance(value, np.ndarray) and value.ndim else None
