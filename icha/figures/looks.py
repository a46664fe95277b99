"""Colours, markers and legends of lines. A material has the same colour in all figures, unless colours are graded.

The colour of a marker shows the material. Crosses are results of boundary elements. Closed markers are results of the
asperity model with adhesion, open markers those without adhesion. The shape of closed and open markers distinguishes
surfaces and slopes. If there are many materials, or many surfaces and slopes, colours change gradually from dark to
bright, and the legend names only some of the lines.
"""

import itertools
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from icha.contact.models import DEFAULT_MODEL, MODELS, REFERENCE_MODEL
from icha.datasets.labels import RunLabels, slopes_of
from icha.datasets.quantities import symbol_of
from icha.figures.drawn import scatter_handles
from icha.figures.select import FINITE_RANGE_NAME, Line
from icha.figures.style import BLACK, COLOURS, GREY, interfaces_of, legend_handle, material_labels, slope_label
from icha.support.formatting import format_quantity

# The colours of Okabe and Ito except black, and darker colours of the same hues. Black lines are theories.
MATERIAL_COLOURS = (*COLOURS[:-1], "#004166", "#803800", "#005A42", "#80436A", "#805800", "#2B6C94")
MARKERS = ("o", "s", "^", "D", "v", "p", "*")

ASPERITIES_NAME, REFERENCE_NAME = MODELS[DEFAULT_MODEL].words, MODELS[REFERENCE_MODEL].words
# Crosses of boundary elements for the second and further surfaces or slopes; the first one has four arms.
CROSSES = ((4, 2, 0), (5, 2, 0), (6, 2, 0), (8, 2, 0))
# Markers in legends by the name of the model.
MODEL_MARKERS = {ASPERITIES_NAME: "o", REFERENCE_NAME: "+", FINITE_RANGE_NAME: "1"}
UNLOADING_MARKERS = {REFERENCE_NAME: "x", FINITE_RANGE_NAME: "2"}
BRANCH_DASHES = {"loading": "-", "unloading": (0, (4, 2))}
# Look of lines of boundary elements in figures that also have lines of the asperity model.
TRUTH_LINE = {"ls": (0, (3, 2)), "lw": 0.8, "ms": 5, "mew": 0.8, "zorder": 5}

# Colours are distinct for up to this number of materials, or of surfaces and slopes. For more, colours are graded.
MOST_COLOURS = len(COLOURS)
# In a figure with more than this number of lines, all lines are thin.
FEW_LINES = 6
# Marker sizes in points, and line width divided by marker size. Curves without adhesion are widest, and the curve of
# each material is narrower than the curve of the previous material. Thus coinciding curves are all visible.
_BARE_SIZE, _ADHESIVE_SIZE, _LEAST_SIZE, _NARROWER = 6.0, 4.6, 1.8, 0.75
_LINE_WIDTH = 0.22
# Largest number of graded colours that a legend names.
_MOST_NAMED = 9
# Fraction of the original colour in a pale colour; the rest is white.
_PALENESS = 0.4
# Beginning of the legend entry of pale lines.
_PALE = "pale: "


class Looks:
    """Colour, marker and name of every line of a figure; a `place` is a surface and an rms slope.

    Parameters
    ----------
    campaign : the campaign dataset; the order of the materials in the dataset determines the colours.
    studies : names of the studies with the materials.
    lines : the lines of the figure.
    by_place : True if colours distinguish places instead of materials; None if they do so for a single material. Always
        True for more than `MOST_COLOURS` places.
    crosses : True if boundary elements are drawn as crosses; None if they are so beside lines of another model. Colours
        then distinguish places if there are more places than shapes of crosses.
    only_drawn : True if names of materials need not differ from those of materials without a line.

    Attributes
    ----------
    models : names of the models of the lines.
    """

    def __init__(
        self,
        campaign: xr.DataTree,
        studies: Sequence[str],
        lines: Iterable[Line],
        *,
        by_place: bool | None = False,
        crosses: bool | None = None,
        only_drawn: bool = False,
    ):
        """Assign colours and markers to the lines."""
        self._campaign, lines = campaign, list(lines)
        contacts = dict.fromkeys(line.contact for line in lines)
        self.models = list(dict.fromkeys(MODELS[line.model].words for line in lines))
        crosses = len(self.models) > 1 if crosses is None else crosses
        self._few = len(contacts) <= FEW_LINES
        interfaces = interfaces_of(campaign[study].to_dataset() for study in studies)
        self.materials = list(dict.fromkeys(material for material, *_ in contacts))
        self._interfaces = {each: interfaces[each] for each in self.materials} if only_drawn else interfaces
        self._material_labels = material_labels(self._interfaces)
        self.places = list(dict.fromkeys(tuple(place) for _, *place in contacts))
        self.by_place = len(self.places) > (len(CROSSES) if crosses else MOST_COLOURS)
        self.by_place |= (len(self.materials) == 1 if by_place is None else by_place) and len(self.places) > 1
        coloured = self.places if self.by_place else self.materials
        self.many = len(coloured) > MOST_COLOURS
        if self.by_place and len({surface for surface, _ in self.places}) == len(self.places):
            palette = distinct_colours(len(coloured))
        elif self.by_place or self.many:
            palette = graded_colours(len(coloured))
        else:
            palette = map(material_colours(campaign).get, coloured)
        self._colours = dict(zip(coloured, palette, strict=True))
        # The steepest slope of a surface has the first marker.
        surfaces = list(dict.fromkeys(surface for surface, _ in self.places))
        ordered = sorted(self.places, key=lambda place: (surfaces.index(place[0]), -(place[1] or 0)))
        self._markers = {} if self.by_place else dict(zip(ordered, itertools.cycle(MARKERS)))
        self._sizes = {}
        for adhesive, largest in ((False, _BARE_SIZE), (True, _ADHESIVE_SIZE)):
            alike = [material for material in self.materials if self.adhesive(material) == adhesive]
            self._sizes |= {name: max(largest * _NARROWER**rank, _LEAST_SIZE) for rank, name in enumerate(alike)}
            # Open and closed markers of the same shape differ in their filling.
            self._markers |= dict(zip(alike, itertools.cycle(MARKERS))) if self.by_place else {}

    def adhesive(self, material: str) -> bool:
        """Return True if the surface energy of a material is positive."""
        return bool(self._interfaces[material].surface_energy)

    def is_beside(self, line: Line) -> bool:
        """Return True if a line shows boundary elements beside another model."""
        return len(self.models) > 1 and line.model == REFERENCE_MODEL

    def colour(self, line: Line) -> str:
        """Return the colour of a line; grey if the figure has no line of this material or surface."""
        return self._colours.get(self._keys(line)[0], GREY)

    def material_colour(self, material: str | None) -> str:
        """Return the colour of a material; black if the colours do not show this material."""
        return self._colours.get(material, BLACK)

    def look(self, line: Line) -> dict:
        """Return arguments of `Axes.plot` for a line."""
        colour, size, adhesive = self.colour(line), self._sizes[line.material], self.adhesive(line.material)
        look = {
            "color": colour,
            "mec": colour,
            "mfc": colour if adhesive else "white",
            "mew": 0.9,
            "ms": size,
            "lw": _LINE_WIDTH * size,
            "zorder": 3 + adhesive + 0.01 * self.materials.index(line.material),
            "marker": self._markers[self._keys(line)[1]],
        }
        if not self._few:
            look |= {"lw": 0.6, "ms": (0.6 if self.many else 0.8) * size}
        return pale(look, line.doubt)

    def cross(self, line: Line, model_name: str = REFERENCE_NAME, *, shape: str | None = None) -> dict:
        """Return arguments of `Axes.plot` for boundary elements: crosses in the colour of the material or place.

        `shape` is the marker of the first surface and slope, if it is not the usual one.
        """
        colour, adhesive = self.colour(line), self.adhesive(line.material)
        # Crosses without adhesion are larger than crosses with adhesion, so that both are visible if they coincide.
        size = (8 if adhesive else 11) * (1 if self._few else 0.7)
        rank = self.rank(line) if model_name == REFERENCE_NAME else 0
        marker = CROSSES[rank % len(CROSSES)] if rank else shape or MODEL_MARKERS[model_name]
        look = {"color": colour, "mec": colour, "mew": 1.0, "ms": size, "ls": "none", "marker": marker}
        look["zorder"] = 6 + adhesive
        return pale(look, line.doubt)

    def handles(self, **changed: object) -> dict[str, Line2D]:
        """Return the legend entries of materials, surfaces and slopes by name.

        If there are many names, only some have an entry. `changed` replaces some arguments of `Axes.plot`.
        """
        material, place = self.materials[0], self.places[0]
        if self.by_place:
            found = {self.label(each): self.look(Line(material, *each)) | changed for each in some_of(self.places)}
            for each in [] if self.heading() else some_of(self.materials):
                look = self.look(Line(each, *place)) | changed | {"color": GREY, "mec": GREY}
                found[self.label(each)] = look | ({"mfc": GREY} if self.adhesive(each) else {})
        else:
            changed = ({"marker": MODEL_MARKERS[ASPERITIES_NAME]} if self.label(place) else {}) | changed
            looks = {each: self.look(Line(each, *place)) | changed for each in some_of(self.materials)}
            found = {self.label(each): look for each, look in looks.items()}
            grey = {"ls": "none", "color": GREY, "mfc": "white", "mew": 0.9, "ms": 5}
            found |= {self.label(each): grey | {"marker": marker} for each, marker in self._markers.items()}
            found.pop("", None)  # the name is empty if the figure has a single surface and slope
        return {name: legend_handle(**look) for name, look in found.items()}

    def cross_handles(self, lines: Iterable[Line], *, shape: str | None = None, **look: object) -> dict[str, Line2D]:
        """Return the legend entries of the crosses of some lines by name: one for each shape of crosses.

        `shape` is that of `cross`, and `look` are further arguments of `Axes.plot`.
        """
        lines = list(lines)
        several = any(map(self.rank, lines))
        names = {line: f"{REFERENCE_NAME}, {self.shape_name(line)}" if several else REFERENCE_NAME for line in lines}
        markers = {name: self.cross(line, shape=shape)["marker"] for line, name in names.items()}
        return {name: model_handle(REFERENCE_NAME, marker=marker, **look) for name, marker in markers.items()}

    def fill(self) -> dict:
        """Return the filling of a grey marker for all materials: half closed for those with and without adhesion."""
        closed = {self.adhesive(material) for material in self.materials}
        alone = {"mfc": GREY if closed == {True} else "white"}
        return alone if len(closed) == 1 else {"fillstyle": "left", "mfc": GREY, "markerfacecoloralt": "white"}

    def heading(self) -> str | None:
        """Return the heading of a legend: the only material, if colours distinguish surfaces and slopes."""
        return self.label(self.materials[0]) if self.by_place and len(self.materials) == 1 else None

    def colour_handles(self) -> dict[str, Line2D]:
        """Return legend entries that show only colours: bars of some materials, or of some surfaces and slopes."""
        return {self.label(each): legend_handle(color=self._colours[each], lw=4) for each in some_of([*self._colours])}

    def shape_name(self, line: Line) -> str:
        """Return what the marker of a line shows, as text: surface and slope, or the material."""
        return self.label(self._keys(line)[1])

    def _keys(self, line):
        """Return what the colour and what the marker of a line show: its material, or its place."""
        return (line.place, line.material) if self.by_place else (line.material, line.place)

    def label(self, key: str | tuple[str, float | None]) -> str:
        """Return the label of a material, or surface and rms slope of a place as text.

        A surface or slope that all lines have in common is left out.
        """
        if isinstance(key, str):
            return self._material_labels[key]
        surface, slope = key
        surfaces, slopes = (set(each) for each in zip(*self.places, strict=True))
        # Crosses may be on a surface of which the figure has no line.
        words = [surface_labels(self._campaign, surfaces | {surface})[surface]] if len(surfaces) > 1 else []
        return ", ".join([*words, slope_label(slope)] if slope is not None and len(slopes) > 1 else words)

    def rank(self, line: Line) -> int:
        """Return the number of a line in the order of the markers, from 0; 0 for unknown ones."""
        shapes, (_, shape) = list(self._markers), self._keys(line)
        return shapes.index(shape) if shape in shapes else 0

    def name(self, line: Line) -> str:
        """Return a name that distinguishes a line from the other lines of the figure."""
        place = self.label(line.place)
        # If colours distinguish surfaces and slopes, the name of the only material is left out.
        if place and self.by_place and len(self.materials) == 1:
            return place
        return ", ".join(filter(None, [self.label(line.material), place]))


def surface_label(campaign: xr.DataTree, surface: str) -> str:
    """Return a label of a surface that no other surface of its study has."""
    return surface_labels(campaign, [surface])[surface]


def surface_labels(campaign: xr.DataTree, surfaces: Iterable[str]) -> dict[str, str]:
    """Return a legend text for each surface; no two are the same.

    The text is the name of the surface; if parameters are varied, it is the name of the original surface and those
    parameters that are coordinates. Surfaces that do not differ in these have their names.
    """
    found: dict[str, str] = {}
    for study in campaign.children.values():
        found = _labels_of_variants(study) | found
    return _names_of_repeated({name: found.get(name, name) for name in surfaces})


def _labels_of_variants(study):
    """Return the labels of the surfaces of a study by name; none if no parameter of surfaces is a coordinate."""
    coordinates = study.coords.items()
    varied = {name: each for name, each in coordinates if "varied" in each.attrs and each.dims == ("surface",)}
    if not varied:
        return {}
    # Names of variants begin with the name of the original surface, a hyphen and the first varied parameter.
    origins = {each: each.partition(f"-{next(iter(varied))}")[0] for each in study["surface"].values.tolist()}
    several = len(set(origins.values())) > 1
    labels = {}
    for k, (name, origin) in enumerate(origins.items()):
        words = list(filter(None, (_symbol_and_value(parameter, values, k) for parameter, values in varied.items())))
        labels[name] = ", ".join([origin, *words] if several or not words else words)
    return _names_of_repeated(labels)


def _names_of_repeated(labels):
    """Return labels by name, with the name itself instead of a label that several names have."""
    counts = Counter(labels.values())
    return {name: label if counts[label] == 1 else name for name, label in labels.items()}


def run_label(campaign: xr.DataTree, labels: RunLabels) -> str:
    """Return surface and material of a run, and the seed and the slope if the study has several, as text."""
    study = campaign[labels.study].to_dataset()
    words = [surface_label(campaign, labels.surface)]
    words += [f"seed {labels.seed}"] if study.sizes["seed"] > 1 else []
    words += [slope_label(labels.rms_slope)] if len(slopes_of(study)) > 1 else []
    return ", ".join([*words, material_labels(interfaces_of([study]))[labels.material]])


def _symbol_and_value(name, values, k):
    """Return the symbol of a varied parameter with the value at index `k`, as text; "" without a value."""
    value = values.values[k]
    if value == "" or value != value:
        return ""
    if isinstance(value, str):
        shown = value
    else:
        shown = format_quantity(value, "m") if values.attrs["units"] == "m" else f"{value:g}"
    return f"{symbol_of(name)} = {shown}"


def material_colours(campaign: xr.DataTree) -> dict[str, str]:
    """Return a colour for every material of a campaign dataset, in the order of the studies."""
    materials = (name for study in campaign.children.values() for name in study["material"].values.tolist())
    return dict(zip(dict.fromkeys(materials), itertools.cycle(MATERIAL_COLOURS)))


def pale(look: dict, doubt: str) -> dict:
    """Return a look in a lighter colour for runs with a `doubt`, the same look without one; open markers stay open."""
    if not doubt:
        return look
    colour = to_hex([1 - _PALENESS * (1 - part) for part in to_rgb(look["color"])])
    filling = {"mfc": colour} if look.get("mfc") == look["color"] else {}
    return look | {"color": colour, "mec": colour, "label": f"{_PALE}{doubt}"} | filling


def graded_colours(count: int) -> list[str]:
    """Return `count` colours from dark to bright, as hexadecimal text."""
    return [to_hex(colour) for colour in mpl.colormaps["viridis"](np.linspace(0, 0.9, count))]


def distinct_colours(count: int) -> Sequence[str]:
    """Return the first colours of `COLOURS`; graded colours if there are too few."""
    return COLOURS[:count] if count <= MOST_COLOURS else graded_colours(count)


def some_of(names: Sequence, most: int = _MOST_NAMED) -> list:
    """Return all names if they are at most `most`; otherwise some, evenly spaced, with the first and the last."""
    at = np.unique(np.rint(np.linspace(0, len(names) - 1, min(len(names), most))).astype(int))
    return [names[k] for k in at]


# --- legends ---

FEWER_SEEDS = "crossed out: mean over fewer seeds than requested"
# A legend with more than this number of entries has a smaller font.
_MANY_NAMES = 12
_MOST_COLUMNS = 4


def legend_below(figure: Figure, handles: Mapping[str, object], heading: str | None = None) -> None:
    """Add a legend below the panels, in as many columns as fit, and with a heading.

    The legend has an entry for each handle, for the scatter of means (`icha.figures.ensembles`), and for everything
    that has a label in a panel. The legend increases the height of the figure, and must therefore be added last.
    """
    named: dict[str, object] = {}
    for axes in figure.axes:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(name, handle)
    last = {name: named.pop(name) for name in sorted(named) if name.startswith((FEWER_SEEDS, _PALE))}
    handles = dict(handles) | scatter_handles(figure) | named | last
    look = {"loc": "outside lower center", "fontsize": 8 if len(handles) <= _MANY_NAMES else 7}
    for columns in range(_MOST_COLUMNS if handles else 0, 0, -1):
        legend = figure.legend(handles.values(), handles.keys(), ncols=columns, title=heading, **look)
        size = legend.get_window_extent().size / figure.dpi
        if size[0] < figure.get_figwidth() or columns == 1:
            figure.set_figheight(figure.get_figheight() + size[1])
            break
        legend.remove()


def model_handle(name: str, **look: object) -> Line2D:
    """Return the legend entry of a model; `look` are keyword arguments of `Axes.plot`."""
    return legend_handle(**{"ls": "none", "marker": MODEL_MARKERS[name], "color": GREY, "mec": GREY, "ms": 6} | look)
