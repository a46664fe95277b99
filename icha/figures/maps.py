"""Draw maps of a surface, and contact spots as circles of true size."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.image import AxesImage

from icha.datasets.campaign import spots_of
from icha.datasets.surface_file import surface_from
from icha.figures.drawn import Name, record
from icha.support.formatting import choose_unit

# Largest number of cells along a side that are distinguishable in a panel.
_MOST_CELLS = 1024
# Height at the end of the colour scale of a smooth surface, m.
_FLAT = 1e-9


class Topography(NamedTuple):
    """Heights of the topography of a run, with its shape, if any, and the units of the axes.

    Attributes
    ----------
    heights : (n, n) float along y and x, heights in the surface file, or of shape and roughness; NaN beside the shape.
    scale : factor that converts `heights` to the heights of the run in `height_unit`.
    lowest, highest : ends of the scale of heights, in `height_unit`; without a shape, 0 is in the middle.
    height_unit : unit of the heights.
    side : side of the surface in `length_unit`.
    length : factor that converts metres to `length_unit`.
    length_unit : unit of the axes x and y.
    """

    heights: np.ndarray
    scale: float
    lowest: float
    highest: float
    height_unit: str
    side: float
    length: float
    length_unit: str

    def draw(self, axes: Axes, **look) -> AxesImage:
        """Draw a map of the heights; `look` are keyword arguments of `Axes.imshow`."""
        return draw_map(axes, self.heights, self.side, self.scale, **look)

    def label(self, axes: Axes) -> None:
        """Set the limits and the labels of the x and y axes."""
        axes.set(xlim=(0, self.side), ylim=(0, self.side))
        axes.set(xlabel=f"$x$ ({self.length_unit})", ylabel=f"$y$ ({self.length_unit})")
        axes.tick_params(direction="out", top=False, right=False)


def topography_of(run: xr.Dataset, surface: xr.Dataset) -> Topography:
    """Return the topography of a run from the dataset of its surface file."""
    heights = surface["height"].transpose("y", "x").values
    factor = float(run["rms_height"]) / (float(surface["rms_height"]) or 1.0)
    if "shape" in surface.attrs:
        whole = surface_from(surface)
        heights, factor = whole.profile + (factor - 1) * whole.heights, 1.0
        heights = np.where(np.isfinite(heights), heights, np.nan)
    # The array may be large, so no copy is made.
    lowest, highest = float(np.nanmin(heights)) * factor, float(np.nanmax(heights)) * factor
    largest = max(highest, -lowest) or _FLAT
    if "shape" not in surface.attrs or lowest == highest:
        lowest, highest = -largest, largest
    period = float(run["period"])
    length, length_unit = choose_unit(period, "m")
    height, height_unit = choose_unit(largest, "m")
    scales = factor * height, lowest * height, highest * height
    return Topography(heights, *scales, height_unit, period * length, length, length_unit)


def draw_map(axes: Axes, nodes: np.ndarray, side: float, scale: float = 1.0, **look) -> AxesImage:
    """Draw a map of the array `nodes` times `scale` on a periodic grid; for a large array, draw means over blocks.

    Nodes are the centres of the cells of the image. The first row and column are repeated at the opposite border.
    """
    means = average_blocks(nodes) * scale
    drawn = np.pad(means, [(0, 1), (0, 1), (0, 0)][: means.ndim], mode="wrap")
    half = side / len(nodes) / 2
    borders = (-half, side - half + side / len(means))
    return axes.imshow(drawn, extent=borders * 2, origin="lower", interpolation="antialiased", **look)


def average_blocks(nodes: np.ndarray, most: int = _MOST_CELLS) -> np.ndarray:
    """Return means over blocks of nodes, at most `most` blocks along a side; return a small array unchanged."""
    count = min(len(nodes), most)
    if count == len(nodes):
        return nodes
    starts = np.arange(count) * len(nodes) // count
    width = np.diff(starts, append=len(nodes))
    sums = np.add.reduceat(np.add.reduceat(nodes, starts, axis=1), starts, axis=0)
    return (sums.T / np.outer(width, width)).T


def wrap_circles(x, y, radius, period: float, boundary: str) -> np.ndarray:
    """Return the circles and their periodic images that overlap the square [0, period)²; columns are x, y, radius."""
    steps = (-period, 0.0, period) if boundary == "periodic" else (0.0,)
    shifts = np.array([(dx, dy) for dx in steps for dy in steps])
    centres = np.column_stack([x, y])[:, None, :] + shifts
    circles = np.concatenate([centres, np.broadcast_to(np.asarray(radius)[:, None, None], (*centres.shape[:2], 1))], -1)
    reach = circles[..., 2:]
    return circles[np.all((circles[..., :2] > -reach) & (circles[..., :2] < period + reach), axis=-1)]


def spot_circles(run: xr.Dataset, snapshot: int, length: float) -> np.ndarray:
    """Return the spots of a snapshot as circles (`wrap_circles`); `length` converts metres to the unit of the axes."""
    spots = spots_of(run, snapshot)
    x, y, radius = (spots[f"spot_{name}"].values * length for name in ("x", "y", "radius"))
    return wrap_circles(x, y, radius, float(run["period"]) * length, str(run["boundary"].values))


def without_images(circles: np.ndarray, side: float) -> np.ndarray:
    """Return the circles on a square without their periodic images."""
    return circles[((circles[:, :2] >= 0) & (circles[:, :2] < side)).all(axis=1)]


def record_spots(axes: Axes, circles: np.ndarray, side: float, name: Name) -> None:
    """Record contact spots on a square; periodic images of spots are left out."""
    x, y, radius = without_images(circles, side).T
    record(axes, x, y, name, radius=radius)


def draw_spots(axes: Axes, circles: np.ndarray, **look) -> None:
    """Draw contact spots as circles; the columns of `circles` are x, y and radius in the unit of the axes."""
    x, y, radius = circles.T
    look |= {"offsets": np.column_stack([x, y]), "offset_transform": axes.transData, "units": "xy"}
    axes.add_collection(EllipseCollection(2 * radius, 2 * radius, np.zeros(len(radius)), **look))
