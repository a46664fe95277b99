"""Colours, markers and legends of lines, the same in all figures of a campaign.

A colour stands for a material, a marker for a model. Closed markers are asperities with adhesion, open markers
asperities without adhesion, crosses boundary elements. If a figure has several surfaces and slopes, the shapes of the
closed markers distinguish them. If there are many materials, or many surfaces and slopes, the colours of a scale
distinguish them instead.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE
from icha.figures.style import (
    BLACK,
    COLOURS,
    GREY,
    INTERFACE,
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
            scale = Scale([self.place_name(place) for place in self.places])
            self._place_colours = dict(zip(self.places, scale.colours, strict=True))
            self.scale = scale if self.many_places else None
        elif len(self.materials) > MOST_COLOURS:
            self.scale = Scale(self.materials)
            self.colours = dict(zip(self.materials, self.scale.colours, strict=True))
        # The steepest slope of a surface has the first marker.
        surfaces = list(dict.fromkeys(surface for surface, _ in self.places))
        ordered = sorted(self.places, key=lambda place: (surfaces.index(place[0]), -(place[1] or 0)))
        self._markers = dict(zip(ordered, itertools.cycle(PLACE_MARKERS)))
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
    """Return a colour for every material of a campaign dataset, in the order in which its studies name them."""
    materials = (name for study in campaign.children.values() for name in study["material"].values.tolist())
    return dict(zip(dict.fromkeys(materials), itertools.cycle(MATERIAL_COLOURS)))


def collect_interfaces(datasets: Iterable[xr.Dataset]) -> xr.Dataset:
    """Return modulus, surface energy and range of the materials of several datasets."""
    import xarray as xr

    found = {}
    for dataset in datasets:
        for material in dataset["material"].values.tolist():
            found.setdefault(material, dataset[INTERFACE].sel(material=material))
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

    The title of the bar is the common beginning of the names, which the labels of the bar then lack.

    Parameters
    ----------
    names : the names in the order of their colours.
    """

    def __init__(self, names: Sequence[str]):
        """Distribute the colours."""
        import matplotlib as mpl
        from matplotlib.colors import to_hex

        alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
        # Digits that all names share belong to their numbers.
        common = re.sub(r"[-+.\d]*$", "", "".join(letters[0] for letters in alike))
        self.names = [name.removeprefix(common) for name in names]
        self.title = common.rstrip("-_= ")
        self.colours = [to_hex(colour) for colour in mpl.colormaps["viridis"](np.linspace(0, _BRIGHTEST, len(names)))]

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


# --- legends ---

FEWER_SEEDS = "crossed: mean over fewer seeds than requested"
# Largest number of names in the larger font.
_MANY_NAMES = 12
_MOST_COLUMNS = 4
_PALE_GREY = "0.72"


def legend_below(
    figure: Figure, handles: Mapping[str, object], *, scale: Scale | None = None, panels: Sequence[Axes] = ()
) -> None:
    """Add a legend below the panels, in as many columns as have room; the figure grows by its height.

    Parameters
    ----------
    figure : the figure, in which all else is drawn.
    handles : handles of the legend, by name.
    scale : scale of colours that is added beside the `panels`, if any.
    """
    if scale:
        scale.draw(figure, list(panels))
    handles = dict(handles) | _marks(figure)
    look = {"loc": "outside lower center", "fontsize": 8 if len(handles) <= _MANY_NAMES else 7}
    for columns in range(_MOST_COLUMNS if handles else 0, 0, -1):
        legend = figure.legend(handles.values(), handles.keys(), ncols=columns, **look)
        size = legend.get_window_extent().size / figure.dpi
        if size[0] < figure.get_figwidth() or columns == 1:
            figure.set_figheight(figure.get_figheight() + size[1])
            break
        legend.remove()


def _marks(figure):
    """Return handles of crossed and pale marks, if a panel has some."""
    shown = named_handles(figure.axes)
    ring = {"ls": "none", "marker": "o", "ms": 5, "mew": 0.9, "mfc": "white"}
    cross = ring | {"marker": "x", "mew": 0.7}
    looks = {
        FEWER_SEEDS: (legend_handle(color=GREY, **ring), legend_handle(color=GREY, **cross)),
        NOT_APPLICABLE: legend_handle(color=_PALE_GREY, **ring | {"ls": "-", "lw": 0.9}),
    }
    return {name: look for name, look in looks.items() if name in shown}


def named_handles(panels: Iterable[Axes]) -> dict[str, object]:
    """Return the handles of all names in some panels."""
    found: dict[str, object] = {}
    for axes in panels:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(name, handle)
    return found


def model_handle(name: str, **look: object) -> Line2D:
    """Return the handle of a model."""
    return legend_handle(**{"ls": "none", "marker": MODEL_MARKERS[name], "color": GREY, "mec": GREY, "ms": 6} | look)


def words_handle(text: str) -> dict[str, object]:
    """Return an entry of a legend without a mark."""
    return {text: legend_handle(color=GREY, ls="none")}
