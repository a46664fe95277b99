"""Colours and markers of lines, the same in all figures of a campaign.

A colour stands for a material, a marker for a model. Closed markers are asperities with adhesion, open markers
asperities without adhesion, crosses boundary elements. If a figure has several surfaces and slopes, the shapes of the
closed markers distinguish them. If there are many materials, or many surfaces and slopes, the colours of a scale
distinguish them instead.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE
from icha.figures.style import (
    BLACK,
    COLOURS,
    GREY,
    INTERFACE,
    choose_unit,
    legend_handle,
    material_label,
    slope_label,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

# Material, surface and rms slope of a line; the slope is None if slopes are not distinguished.
Contact = tuple[str, str, float | None]

# Okabe and Ito's colours without black, which is for theories, and darker ones of the same hues.
MATERIAL_COLOURS = (*COLOURS[:-1], "#004166", "#803800", "#005A42", "#80436A", "#805800", "#2B6C94")
PLACE_MARKERS = ("o", "s", "^", "D", "v", "p", "*")

ASPERITIES_NAME = MODELS["asperities"].words
# By the names of models in legends.
MODEL_MARKERS = {ASPERITIES_NAME: "o", SHORT_RANGE: "+", FINITE_RANGE: "1"}
UNLOADING_MARKERS = {SHORT_RANGE: "x", FINITE_RANGE: "2"}
BRANCH_DASHES = {"loading": "-", "unloading": (0, (4, 2))}
# Lines of boundary elements, which are drawn beside those of asperities.
TRUTH_LINE = {"ls": (0, (3, 2)), "lw": 0.8, "ms": 5, "mew": 0.8, "zorder": 5}

# Largest number of materials, or of surfaces and slopes, with a colour in the legend; more have a scale.
MOST_COLOURS = len(COLOURS)
# Largest number of lines that are not drawn thin.
FEW_LINES = 6
# All of several curves that coincide stay visible: without adhesion they are widest, and of several materials each is
# narrower than the one before. Sizes of markers in points, width of lines in sizes of markers.
_BARE_SIZE, _ADHESIVE_SIZE, _LEAST_SIZE, _NARROWER = 6.0, 4.6, 1.8, 0.75
_LINE_WIDTH = 0.22
# Fraction of a colour that is left in its pale one.
_PALENESS = 0.4

# Label of lines to which the asperity model is not applicable, and its form in figures of a single run.
NOT_APPLICABLE = "pale: asperity model not applicable"
NOT_APPLICABLE_ALONE = "asperity model not applicable"


class Looks:
    """Colour, marker and name of every line of a figure.

    Parameters
    ----------
    campaign : the campaign dataset, from which materials have their colours.
    interfaces : modulus, surface energy and range of the materials.
    contacts : those of the lines.
    by_place : whether surfaces and slopes have colours even if they are few, as lines without markers need.
    """

    def __init__(
        self, campaign: xr.DataTree, interfaces: xr.Dataset, contacts: Iterable[Contact], *, by_place: bool = False
    ):
        """Distribute colours and markers."""
        self.contacts = list(dict.fromkeys(contacts))
        self.interfaces = interfaces
        self.materials = list(dict.fromkeys(material for material, *_ in self.contacts))
        self.places = list(dict.fromkeys(tuple(place) for _, *place in self.contacts))
        self.many_places = len(self.places) > MOST_COLOURS
        self.by_place = self.many_places or (by_place and len(self.places) > 1)
        self.scale: Scale | None = None
        palette = material_colours(campaign)
        self.colours = {material: BLACK if self.many_places else palette[material] for material in self.materials}
        self._place_colours = {}
        if self.by_place:
            scale = places_scale(self.places)
            self._place_colours = dict(zip(self.places, scale.colours, strict=True))
            self.scale = scale if self.many_places else None
        elif len(self.materials) > MOST_COLOURS:
            self.scale = materials_scale(interfaces, self.materials)
            self.colours = dict(zip(self.materials, self.scale.colours, strict=True))
        self._markers = place_markers(self.places)
        self._sizes = {}
        for adhesive, largest in ((False, _BARE_SIZE), (True, _ADHESIVE_SIZE)):
            alike = [material for material in self.materials if self.adhesive(material) == adhesive]
            self._sizes |= {name: max(largest * _NARROWER**rank, _LEAST_SIZE) for rank, name in enumerate(alike)}

    def adhesive(self, material: str) -> bool:
        """Return whether a material has surface energy."""
        return float(self.interfaces["surface_energy"].sel(material=material)) > 0

    def colour(self, contact: Contact) -> str:
        """Return the colour of a line; of a contact without a line that of its material, or grey."""
        material, *place = contact
        return self._place_colours.get(tuple(place)) or self.colours.get(material, GREY)

    def look(self, contact: Contact, *, applicable: bool = True) -> dict:
        """Return arguments of `Axes.plot` for a line; pale if the asperity model is not applicable."""
        material, *place = contact
        colour, size, adhesive = self.colour(contact), self._sizes[material], self.adhesive(material)
        rank = self.materials.index(material)
        look = {
            "color": colour,
            "mec": colour,
            "mfc": colour if adhesive else "white",
            "mew": 0.9,
            "ms": size,
            "lw": _LINE_WIDTH * size,
            "zorder": 3 + adhesive + 0.01 * rank,
            # If surfaces and slopes have the colours of a scale, materials have the shapes.
            "marker": PLACE_MARKERS[rank % len(PLACE_MARKERS)] if self.many_places else self._markers[tuple(place)],
        }
        if self.scale:
            look |= {"lw": 0.6, "ms": 0.6 * size, "mew": 0.6}
        elif len(self.contacts) > FEW_LINES:
            look |= {"lw": 0.6, "ms": 0.8 * size}
        return look if applicable else _pale(look)

    def handles(self, **changed: object) -> dict[str, Line2D]:
        """Return the handles of all names that are not on the scale; `changed` overrides their looks."""
        first = self.places[0]
        if self.by_place and not self.many_places:
            return {self.name(each): legend_handle(**self.look(each) | changed) for each in self.contacts}
        found = {}
        if not self.scale or (self.many_places and 1 < len(self.materials) <= MOST_COLOURS):
            marker = self._markers[first] if not self.place_name(first) else MODEL_MARKERS[ASPERITIES_NAME]
            grey = {"color": GREY, "mec": GREY} if self.many_places else {"marker": marker}
            for material in self.materials:
                look = self.look((material, *first)) | grey | changed
                found[material_label(self.interfaces, material)] = legend_handle(**look)
        if len(self.places) > 1 and not self.many_places:
            grey = {"ls": "none", "color": GREY, "mfc": "white", "mew": 0.9, "ms": 5}
            for place, marker in self._markers.items():
                if name := self.place_name(place):  # empty if slopes are not distinguished
                    found[name] = legend_handle(**grey | {"marker": marker})
        return found

    def place_name(self, place: tuple[str, float | None]) -> str:
        """Return surface and rms slope of a line in words, as far as the figure has several."""
        surface, slope = place
        surfaces, slopes = (set(each) for each in zip(*self.places, strict=True))
        words = [surface] if len(surfaces) > 1 else []
        return ", ".join([*words, slope_label(slope)] if slope is not None and len(slopes) > 1 else words)

    def name(self, contact: Contact) -> str:
        """Return the name of a line, which distinguishes it from the other lines of the figure."""
        material, *place = contact
        place = self.place_name(tuple(place))
        # A single material is not named if surfaces and slopes have the colours.
        if place and self.by_place and len(self.materials) == 1:
            return place
        return ", ".join(filter(None, [material_label(self.interfaces, material), place]))


def looks_of_studies(campaign: xr.DataTree, studies: Sequence[str], contacts: Iterable[Contact]) -> Looks:
    """Return looks of lines of some studies; lines of a single material have the colours of surfaces and slopes."""
    contacts = list(contacts)
    interfaces = collect_interfaces(campaign[study].to_dataset() for study in studies)
    return Looks(campaign, interfaces, contacts, by_place=len({material for material, *_ in contacts}) == 1)


def material_colours(campaign: xr.DataTree) -> dict[str, str]:
    """Return a colour for every material of a campaign dataset, in the order in which its studies name them.

    Materials of one study have different colours, unless the study has more materials than there are colours.
    """
    studies = [node["material"].values.tolist() for node in campaign.children.values()]
    colours: dict[str, str] = {}
    for material in dict.fromkeys(name for names in studies for name in names):
        of_same_studies = {colours.get(name) for names in studies if material in names for name in names}
        for taken in (set(colours.values()), of_same_studies, set()):
            free = [colour for colour in MATERIAL_COLOURS if colour not in taken]
            if free:
                colours[material] = free[0]
                break
    return colours


def place_markers(places: Iterable[tuple[str, float | None]]) -> dict[tuple, str]:
    """Return a marker for every surface and rms slope; the steepest of a surface comes first."""
    places = list(dict.fromkeys(places))
    surfaces = list(dict.fromkeys(surface for surface, _ in places))
    ordered = sorted(places, key=lambda place: (surfaces.index(place[0]), -(place[1] or 0)))
    return {place: PLACE_MARKERS[k % len(PLACE_MARKERS)] for k, place in enumerate(ordered)}


def collect_interfaces(datasets: Iterable[xr.Dataset]) -> xr.Dataset:
    """Return modulus, surface energy and range of the materials of several datasets."""
    import xarray as xr

    found = {}
    for dataset in datasets:
        for material in dataset["material"].values.tolist():
            found.setdefault(material, dataset[list(INTERFACE)].sel(material=material))
    return xr.concat(found.values(), "material", coords="minimal", compat="override")


def _pale(look):
    """Return the look of a line to which the asperity model is not applicable: open, and in a lighter colour."""
    from matplotlib.colors import to_hex, to_rgb

    colour = to_hex([1 - _PALENESS * (1 - part) for part in to_rgb(look["color"])])
    return look | {"color": colour, "mec": colour, "mfc": "white", "label": NOT_APPLICABLE}


# --- colours of many names, such as the surfaces of a study that varies a parameter ---

_MOST_TICKS = 9
# Largest fraction of the colour map; brighter colours are invisible on white.
_BRIGHTEST = 0.9


class Scale:
    """A colour for each of many names, and the bar that shows them.

    Parameters
    ----------
    names : the names in the order of their colours.
    title : title of the bar; left out, the common beginning of the names, which they then lose.
    darkest : fraction of the colour map of the darkest colour, from 0 to 0.9.
    """

    def __init__(self, names: Sequence[str], title: str = "", *, darkest: float = 0.0):
        """Distribute the colours."""
        import matplotlib as mpl
        from matplotlib.colors import to_hex

        common = "" if title else _beginning(names)
        self.names = [name.removeprefix(common) for name in names]
        self.title = title or common.rstrip("-_ ")
        places = np.linspace(darkest, _BRIGHTEST, len(names))
        self.colours = [to_hex(colour) for colour in mpl.colormaps["viridis"](places)]

    def draw(self, figure: Figure, axes: Sequence[Axes]) -> None:
        """Draw the colour bar beside the panels, with at most `_MOST_TICKS` names."""
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
    """Return the scale of surfaces and rms slopes."""
    surfaces, slopes = (list(dict.fromkeys(each)) for each in zip(*places, strict=True))
    if len(surfaces) == 1:
        return Scale([f"{slope:g}" for _, slope in places], r"$h_{\mathrm{rms}}^{\prime}$")
    if len(slopes) == 1:
        return Scale([surface for surface, _ in places])
    return Scale([f"{surface}, {slope:g}" for surface, slope in places])


def materials_scale(interfaces: xr.Dataset, materials: Sequence[str]) -> Scale:
    """Return the scale of materials, labelled by the quantity in which they differ if there is only one."""
    interfaces = interfaces.sel(material=list(materials))
    differing = [name for name in INTERFACE if len(np.unique(interfaces[name].values)) > 1]
    if len(differing) != 1:
        return Scale([material_label(interfaces, material) for material in materials])
    (name,) = differing
    symbol, unit = INTERFACE[name]
    factor, prefixed = choose_unit(float(interfaces[name].max()), unit)
    return Scale([f"{factor * value:.4g}" for value in interfaces[name].values.tolist()], f"{symbol} ({prefixed})")


def _beginning(names):
    """Return the common beginning of all names, without digits of a number."""
    if len(set(names)) < 2:
        return ""
    first, last = min(names), max(names)
    alike = next(k for k in range(len(first) + 1) if first[: k + 1] != last[: k + 1])
    return re.sub(r"[-+.\d]*$", "", first[:alike])
