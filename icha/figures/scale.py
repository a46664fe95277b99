"""Colours of what is too many to be named one by one, such as the surfaces of a study that varies a parameter."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.figures.style import COLOURS, material_label, unit_for

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The most that a legend names, with a colour for each.
MOST_COLOURS = len(COLOURS)
_MOST_TICKS = 9
# The brightest colours of the map do not show on white.
_BRIGHTEST = 0.9
_QUANTITIES = (
    ("contact_modulus", r"$E^{\ast}$", "Pa"),
    ("surface_energy", r"$\Delta\gamma$", "J/m²"),
    ("interaction_range", "range of attraction", "m"),
)


class Scale:
    """A colour for each of many, in their order, and the bar that tells which is which."""

    def __init__(self, names: Sequence[str], title: str = "", *, darkest: float = 0.0):
        """Take what is to be told apart; what all names begin with goes into the title.

        The darkest colours, in parts of the map from 0 to 0.9, do not show on black.
        """
        import matplotlib as mpl
        from matplotlib.colors import to_hex

        common = "" if title else _beginning(names)
        self.names = [name.removeprefix(common) for name in names]
        self.title = title or common.rstrip("-_ ")
        places = np.linspace(darkest, _BRIGHTEST, len(names))
        self.colours = [to_hex(colour) for colour in mpl.colormaps["viridis"](places)]

    def draw(self, figure: Figure, axes: Sequence[Axes]) -> None:
        """Add the bar beside the panels; of many names only some are written."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import BoundaryNorm, ListedColormap

        count = len(self.names)
        mappable = ScalarMappable(BoundaryNorm(np.arange(count + 1) - 0.5, count), ListedColormap(self.colours))
        bar = figure.colorbar(mappable, ax=axes, pad=0.015, aspect=28)
        shown = np.unique(np.rint(np.linspace(0, count - 1, min(count, _MOST_TICKS))).astype(int))
        bar.set_ticks(shown, labels=[self.names[k] for k in shown])
        bar.ax.tick_params(which="both", length=0, labelsize=7)
        bar.set_label(self.title)


def places_scale(places: Sequence[tuple[str, float | None]]) -> Scale:
    """The scale of surfaces and rms slopes (None: not told apart): what differs is named."""
    surfaces, slopes = (list(dict.fromkeys(each)) for each in zip(*places, strict=True))
    if len(surfaces) == 1:
        return Scale([f"{slope:g}" for _, slope in places], r"$h_{\mathrm{rms}}^{\prime}$")
    if len(slopes) == 1:
        return Scale([surface for surface, _ in places])
    return Scale([f"{surface}, {slope:g}" for surface, slope in places])


def materials_scale(interfaces: xr.Dataset, materials: Sequence[str]) -> Scale:
    """The scale of materials, by the quantity in which they differ if it is one."""
    own = interfaces.sel(material=list(materials))
    differing = [each for each in _QUANTITIES if len(np.unique(own[each[0]].values)) > 1]
    if len(differing) != 1:
        return Scale([material_label(interfaces, material) for material in materials])
    ((name, symbol, unit),) = differing
    factor, prefixed = unit_for(float(own[name].max()), unit)
    return Scale([f"{factor * value:.4g}" for value in own[name].values.tolist()], f"{symbol} ({prefixed})")


def _beginning(names):
    """What all names begin with, but not a part of a number."""
    if len(set(names)) < 2:
        return ""
    first, last = min(names), max(names)
    alike = next(k for k in range(len(first) + 1) if first[: k + 1] != last[: k + 1])
    return re.sub(r"[-+.\d]*$", "", first[:alike])
