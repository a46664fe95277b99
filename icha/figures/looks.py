"""The one style of lines in all figures of a campaign: colours, markers, scales of colours, legends.

A colour is a material, a marker a model: closed shapes are asperities, open ones are without adhesion, crosses are
boundary elements. Where a figure has several surfaces and slopes, the shapes of the closed markers tell them apart. Of
many materials, or of many surfaces and slopes, those have colours of a scale instead.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE
from icha.figures.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    legend_handle,
    material_label,
    slope_label,
    unit_for,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

# Material, surface and rms slope of a line; None: slopes are not told apart.
Contact = tuple[str, str, float | None]

# Okabe and Ito's colours without black, which is for theories, and darker ones of the same hues.
MATERIAL_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
MATERIAL_COLOURS += ("#004166", "#803800", "#005A42", "#80436A", "#805800", "#2B6C94")
PLACE_MARKERS = ("o", "s", "^", "D", "v", "p", "*")

ASPERITIES_NAME = MODELS["asperities"].words
# By what legends call the models. Boundary elements have another cross in unloading.
MODEL_MARKERS = {ASPERITIES_NAME: "o", SHORT_RANGE: "+", FINITE_RANGE: "1"}
WAY_BACK_MARKERS = {SHORT_RANGE: "x", FINITE_RANGE: "2"}
# Lines of boundary elements beside those of asperities.
BESIDE_LINE = {"ls": (0, (3, 2)), "lw": 0.8, "ms": 5, "mew": 0.8, "zorder": 5}

# The most that a legend names, with a colour for each; more have a scale.
MOST_COLOURS = len(COLOURS)
# More lines than this are drawn thin.
FEW_LINES = 6
# Of curves that lie on each other all stay visible: without adhesion they are widest, and of several materials each is
# narrower than the one before. Sizes of markers in points, width of lines in sizes of markers.
_BARE_SIZE, _ADHESIVE_SIZE, _LEAST_SIZE, _NARROWER = 6.0, 4.6, 1.8, 0.75
_LINE_WIDTH = 0.22
# Part of a colour that is left in its pale one.
_PALENESS = 0.4

# Labels of what is drawn of incomplete ensembles and of runs that are no use as predictions, and how legends show it.
FEWER_SEEDS = "crossed: mean over n seeds, fewer than asked for"
NOT_APPLICABLE = "pale: asperity model not applicable"
# The same in figures of a single run, of which nothing is pale.
NOT_APPLICABLE_ALONE = "asperity model not applicable"


class Looks:
    """Colour, marker and name of every line of a figure.

    Parameters
    ----------
    campaign : the campaign dataset, from which materials have their colours.
    interfaces : modulus, surface energy and range of the materials.
    contacts : those of the lines.
    by_place : whether colours tell surfaces and slopes apart however few they are, as lines without markers need it.
    """

    def __init__(
        self, campaign: xr.DataTree, interfaces: xr.Dataset, contacts: Iterable[Contact], *, by_place: bool = False
    ):
        """Distribute colours and markers."""
        self.contacts = list(dict.fromkeys(contacts))
        self.interfaces = interfaces
        self.materials = list(dict.fromkeys(material for material, *_ in self.contacts))
        self.places = list(dict.fromkeys((surface, slope) for _, surface, slope in self.contacts))
        self.many_places = len(self.places) > MOST_COLOURS
        self.by_place = self.many_places or (by_place and len(self.places) > 1)
        self.scale: Scale | None = None
        palette = material_colours(campaign)
        self.colours = {material: BLACK if self.many_places else palette[material] for material in self.materials}
        if self.by_place:
            scale = places_scale(self.places)
            self.of_place = dict(zip(self.places, scale.colours, strict=True))
            self.scale = scale if self.many_places else None
        elif len(self.materials) > MOST_COLOURS:
            self.scale = materials_scale(interfaces, self.materials)
            self.colours = dict(zip(self.materials, self.scale.colours, strict=True))
        self._markers = place_markers(self.places)
        self._sizes = _marker_sizes(interfaces, self.materials)

    def adhesive(self, material: str) -> bool:
        """Whether a material has surface energy."""
        return float(self.interfaces["surface_energy"].sel(material=material)) > 0

    def colour(self, contact: Contact) -> str:
        """Return the colour of a line; of a contact without a line that of its material, or grey."""
        material, *place = contact
        if self.by_place and tuple(place) in self.of_place:
            return self.of_place[tuple(place)]
        return self.colours.get(material, GREY)

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
            # Where surfaces and slopes have the colours of a scale, materials have the shapes.
            "marker": PLACE_MARKERS[rank % len(PLACE_MARKERS)] if self.many_places else self._markers[tuple(place)],
        }
        if self.scale:
            look |= {"lw": 0.6, "ms": 0.6 * size, "mew": 0.6}
        elif len(self.contacts) > FEW_LINES:
            look |= {"lw": 0.6, "ms": 0.8 * size}
        return look if applicable else pale_look(look)

    def handles(self, **changed: object) -> dict[str, Line2D]:
        """Return what the legend names of the lines, in looks that are `changed`, but for what the scale tells."""
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
            grey = {"ls": "none", "color": GREY, "mec": GREY, "mfc": "white", "mew": 0.9, "ms": 5}
            for place, marker in self._markers.items():
                if name := self.place_name(place):  # of surfaces and slopes that are told apart
                    found[name] = legend_handle(**grey | {"marker": marker})
        return found

    def place_name(self, place: tuple[str, float | None]) -> str:
        """Return surface and rms slope of a line in words, as far as the figure has several."""
        return _place_name(place, self.places)

    def name(self, contact: Contact) -> str:
        """Return what tells a line apart from the others of its figure."""
        material, *place = contact
        parts = [material_label(self.interfaces, material), self.place_name(tuple(place))]
        # A single material is not named where surfaces and slopes have the colours.
        parts = parts[1:] if self.by_place and len(self.materials) == 1 and parts[1] else parts
        return ", ".join(filter(None, parts))


def _place_name(place, places):
    surface, slope = place
    surfaces, slopes = (set(each) for each in zip(*places, strict=True))
    parts = [surface] if len(surfaces) > 1 else []
    return ", ".join(parts + ([slope_label(slope)] if slope is not None and len(slopes) > 1 else []))


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


def _marker_sizes(interfaces, materials):
    """Sizes of the markers of materials, so that none hides another."""
    sizes = {}
    for adhesive, largest in ((False, _BARE_SIZE), (True, _ADHESIVE_SIZE)):
        own = [name for name in materials if (float(interfaces["surface_energy"].sel(material=name)) > 0) == adhesive]
        sizes |= {name: max(largest * _NARROWER**rank, _LEAST_SIZE) for rank, name in enumerate(own)}
    return sizes


def interfaces_of(datasets: Iterable[xr.Dataset]) -> xr.Dataset:
    """Modulus, surface energy and range of the materials of several datasets."""
    import xarray as xr

    names = ["contact_modulus", "surface_energy", "interaction_range"]
    found = {}
    for dataset in datasets:
        for material in dataset["material"].values.tolist():
            found.setdefault(material, dataset[names].sel(material=material))
    return xr.concat(found.values(), "material", coords="minimal", compat="override")


def pale_look(look: dict) -> dict:
    """Look of runs to which the asperity model is not applicable: open and in a lighter colour than others have."""
    from matplotlib.colors import to_hex, to_rgb

    colour = to_hex([1 - _PALENESS * (1 - part) for part in to_rgb(look["color"])])
    return look | {"color": colour, "mec": colour, "mfc": "white", "label": NOT_APPLICABLE}


def model_handle(name: str, **look: object) -> Line2D:
    """What a legend shows of a model."""
    return legend_handle(**{"ls": "none", "marker": MODEL_MARKERS[name], "color": GREY, "mec": GREY, "ms": 6} | look)


# --- colours of what is too many to be named one by one, such as the surfaces of a study that varies a parameter ---

_MOST_TICKS = 9
# The brightest colours of the map do not show on white.
_BRIGHTEST = 0.9
_QUANTITIES = (
    ("contact_modulus", r"$E^{\ast}$", "Pa"),
    ("surface_energy", r"$\Delta\gamma$", "J/m²"),
    ("interaction_range", "range of attraction", "m"),
)


class Scale:
    """A colour for each of many, in their order, and the bar that shows which is which.

    Parameters
    ----------
    names : what is told apart; what all names begin with goes into the title.
    title : what the names are.
    darkest : the darkest colour, in parts of the map from 0 to 0.9; darker ones do not show on black.
    """

    def __init__(self, names: Sequence[str], title: str = "", *, darkest: float = 0.0):
        """Take what is to be told apart."""
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


# --- legends, which stand below the panels, off the data ---

# More names than this are written smaller.
_MANY_NAMES = 12
# Inches that an entry takes beside its name, and a character of it, in 8 point; and of the height of a row.
_BESIDE, _CHARACTER, _ROW = 0.7, 0.062, 0.155
_MOST_COLUMNS = 4
_PALE_GREY = "0.72"


def legend_below(
    figure: Figure, handles: Mapping[str, object], *, scale: Scale | None = None, panels: Sequence[Axes] = ()
) -> None:
    """Add a legend below the panels, in as many columns as have room; the figure grows by its height.

    Parameters
    ----------
    figure : the figure, in which all else is drawn.
    handles : what the legend shows, by name.
    scale : a scale of colours, if any, that is added beside the `panels`.
    panels : the axes beside which the scale stands.
    """
    if scale:
        scale.draw(figure, list(panels))
    handles = dict(handles) | _marks(figure)
    if handles:
        size = 8 if len(handles) <= _MANY_NAMES else 7
        lengths = [_printed_length(name) * size / 8 for name in handles]
        columns = next(
            (count for count in range(_MOST_COLUMNS, 1, -1) if _width(lengths, count) < figure.get_figwidth()), 1
        )
        rows = -(-len(handles) // columns)
        figure.set_figheight(figure.get_figheight() + 0.06 + _ROW * size / 8 * rows)
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns, fontsize=size)
    _spread_numbers(figure)


def _marks(figure):
    """What the legend says of crossed and pale marks, as far as a panel has some."""
    shown = named_handles(figure.axes)
    ring = {"ls": "none", "marker": "o", "ms": 5, "mew": 0.9, "mfc": "white"}
    looks = {
        FEWER_SEEDS: (
            legend_handle(color=GREY, **ring),
            legend_handle(color=GREY, **ring | {"marker": "x", "mew": 0.7}),
        ),
        NOT_APPLICABLE: legend_handle(color=_PALE_GREY, **ring | {"ls": "-", "lw": 0.9}),
    }
    return {name: look for name, look in looks.items() if name in shown}


def named_handles(panels: Iterable[Axes]) -> dict[str, object]:
    """What is named in some panels, each name once."""
    found: dict[str, object] = {}
    for axes in panels:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(name, handle)
    return found


def words_handle(text: str) -> dict[str, object]:
    """An explanation in a legend, without a look of its own."""
    return {text: legend_handle(color=GREY, ls="none")}


def _width(lengths, columns):
    """Inches that so many columns of names take, at most as many as there are names."""
    parts = np.array_split(lengths, min(columns, len(lengths)))
    return sum(_BESIDE + _CHARACTER * max(part) for part in parts)


def _printed_length(name):
    """About how many characters a name has when its formulas are set."""
    return len(re.sub(r"\\mathrm|\\prime|\\ast|\\bar|[{}$^_]", "", name).replace(r"\Delta\gamma", "Δγ"))


class NumberPlace(NamedTuple):
    """Where the number of seeds stands beside a mark: points to the right and up, and how it is aligned."""

    right: float
    up: float
    align: str


NUMBER_PLACES = tuple(
    NumberPlace(sign * right, up, "left" if sign > 0 else "right")
    for (right, up), sign in itertools.product(((5, -8), (5, 5), (9, -2), (5, -17), (5, 14)), (1, -1))
)


def _spread_numbers(figure):
    """Move numbers of seeds that would lie on each other, or out of their panel, to another side of their mark."""
    panels = [each for axes in figure.axes for each in (axes, *axes.child_axes)]
    numbers = [(axes, text) for axes in panels for text in axes.texts if text.get_text().startswith("n=")]
    if len(numbers) < 2:
        return
    figure.draw_without_rendering()
    taken = []
    for axes, text in numbers:
        frame, boxes = axes.get_window_extent(), {}
        for place in NUMBER_PLACES:
            text.set(ha=place.align, position=(place.right, place.up))
            boxes[place] = text.get_window_extent()
        free = [place for place, box in boxes.items() if not any(box.overlaps(other) for other in taken)]
        inside = [place for place in free if frame.contains(*boxes[place].min) and frame.contains(*boxes[place].max)]
        place = (inside or free or NUMBER_PLACES)[0]
        text.set(ha=place.align, position=(place.right, place.up))
        taken.append(boxes[place])
