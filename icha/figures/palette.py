"""What colours and markers mean, the same in all figures of a campaign: a colour a material, a marker a model.

Markers are closed shapes for asperities, open without adhesion, and crosses for boundary elements. Where a figure has
several surfaces and slopes, the shapes of the closed markers tell them apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from icha.contact.models import MODELS
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE
from icha.figures.legends import NOT_APPLICABLE
from icha.figures.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, legend_handle

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.lines import Line2D

# Okabe and Ito's colours without black, which is for theories, and darker ones of the same hues.
MATERIAL_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
MATERIAL_COLOURS += ("#004166", "#803800", "#005A42", "#80436A", "#805800", "#2B6C94")
PLACE_MARKERS = ("o", "s", "^", "D", "v", "p", "*")

# By what legends call the models. Boundary elements have another cross on the way back.
MODEL_MARKERS = {MODELS["asperities"].words: "o", MODELS["boundary_elements"].words: "+", FINITE_RANGE: "1"}
WAY_BACK_MARKERS = {SHORT_RANGE: "x", FINITE_RANGE: "2"}
# Lines of boundary elements beside those of asperities.
BESIDE_LINE = {"ls": (0, (3, 2)), "lw": 0.8, "ms": 5, "mew": 0.8, "zorder": 5}
# Further solutions of the same states at a finite range, on other grids.
FINITE_RANGE_MARKERS = ("1", "2", "3", "4")


def material_colours(campaign: xr.DataTree) -> dict[str, str]:
    """A colour for every material of a campaign dataset, in the order in which its studies name them.

    No two materials of a study have the same one, unless it has more of them than there are colours.
    """
    studies = [node["material"].values.tolist() for node in campaign.children.values()]
    colours: dict[str, str] = {}
    for material in dict.fromkeys(name for names in studies for name in names):
        beside = {colours.get(name) for names in studies if material in names for name in names}
        for taken in (set(colours.values()), beside, set()):
            free = [colour for colour in MATERIAL_COLOURS if colour not in taken]
            if free:
                colours[material] = free[0]
                break
    return colours


def place_markers(places: Iterable[tuple[str, float | None]]) -> dict[tuple, str]:
    """A marker for every surface and rms slope (None: not told apart); the steepest of a surface comes first."""
    places = list(dict.fromkeys(places))
    surfaces = list(dict.fromkeys(surface for surface, _ in places))
    ordered = sorted(places, key=lambda place: (surfaces.index(place[0]), -(place[1] or 0)))
    return {place: PLACE_MARKERS[k % len(PLACE_MARKERS)] for k, place in enumerate(ordered)}


class Layer(NamedTuple):
    """How wide a material is drawn, in points, how far in front, and whether it has adhesion."""

    size: float
    order: float
    adhesive: bool


# Of curves that lie on each other all stay visible: without adhesion they are widest, and of several materials each is
# narrower than the one before.
_BARE_SIZE, _ADHESIVE_SIZE, _LEAST_SIZE, _NARROWER = 6.0, 4.6, 1.8, 0.75
_LINE_WIDTH = 0.22  # in sizes of markers


def material_layers(study: xr.Dataset, materials: Sequence[str]) -> dict[str, Layer]:
    """How every material of a study is drawn, so that none hides another."""
    layers = {}
    for adhesive, largest in ((False, _BARE_SIZE), (True, _ADHESIVE_SIZE)):
        own = [name for name in materials if (float(study["surface_energy"].sel(material=name)) > 0) == adhesive]
        for rank, name in enumerate(own):
            size = max(largest * _NARROWER**rank, _LEAST_SIZE)
            layers[name] = Layer(size, 3 + adhesive + 0.01 * rank, adhesive)
    return layers


def closed_look(colour: str, layer: Layer) -> dict:
    """Look of the lines and closed markers of a material, arguments of `Axes.plot`; open without adhesion."""
    return {
        "color": colour,
        "mec": colour,
        "mfc": colour if layer.adhesive else "white",
        "mew": 0.9,
        "ms": layer.size,
        "lw": _LINE_WIDTH * layer.size,
        "zorder": layer.order,
    }


def pale_look(look: dict) -> dict:
    """Look of runs to which the asperity model is not applicable: open and in a lighter colour than others have."""
    from matplotlib.colors import to_hex, to_rgb

    colour = to_hex([1 - _PALENESS * (1 - part) for part in to_rgb(look["color"])])
    return look | {"color": colour, "mec": colour, "mfc": "white", "label": NOT_APPLICABLE}


# Part of a colour that is left in its pale one.
_PALENESS = 0.4


def model_handle(name: str, **look: object) -> Line2D:
    """What a legend shows of a model."""
    return legend_handle(**{"ls": "none", "marker": MODEL_MARKERS[name], "color": GREY, "mec": GREY, "ms": 6} | look)
