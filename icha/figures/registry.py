"""Draw figures by their names: the figure `fig<number>_<words>` is drawn by the function `<words>` of a module.

The module `own_figure` draws all figures of the user's own, whose names do not begin in this way. A function receives
the data and the arguments that the request of the figure names (`icha.configuration.figures`). It raises
`icha.figures.select.NothingToDraw` if no run in the figure is complete.

Snakemake imports this module whenever it starts. The other modules of this folder, which import Matplotlib and xarray,
are imported when a figure is drawn.
"""

import importlib
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from icha.datasets.results import figure_number

# The module of each function that draws a figure.
_MODULES = {
    "jkr": "one_asperity",
    **dict.fromkeys(("area_and_gap", "multi_slope", "stiffness"), "against_load"),
    **dict.fromkeys(("distributions", "patch_sizes"), "at_one_load"),
    **dict.fromkeys(("contact_map", "spots_by_slope", "snap_map", "pressure_maps"), "contact_maps"),
    **dict.fromkeys(("tabor", "pull_off", "loss"), "against_parameter"),
    **dict.fromkeys(("model_error", "distribution_error"), "errors"),
    "loops": "loops",
    **dict.fromkeys(("force_indentation", "jkr_plot", "work_of_adhesion"), "indenters"),
    **dict.fromkeys(("sensitivity", "parameters"), "samples"),
    "own": "own_figure",
}


def module_name(name: str) -> str:
    """Return the name of the module that draws a figure."""
    return f"icha.figures.{_MODULES[_function(name)]}"


def drawing_function(name: str) -> Callable:
    """Return the function that draws a figure."""
    return getattr(importlib.import_module(module_name(name)), _function(name))


def _function(name):
    return name.partition("_")[2] if figure_number(name) else "own"


def draw_figure(
    name: str,
    png: str | os.PathLike,
    pdf: str | os.PathLike,
    text: str | os.PathLike,
    table: str | os.PathLike,
    *,
    inputs: Mapping[str, str | Sequence[str]],
    arguments: Mapping[str, Any],
    studies: Sequence[str] = (),
) -> None:
    """Draw a figure and write it to `png` and `pdf`, its caption to the file `text`, and what it draws to `table`.

    If no run in the figure is complete, the figure is a message only. `inputs` are paths of files, and `arguments`
    further keyword arguments of the function that draws. `studies` are the studies whose runs the figure shows.
    """
    from icha.datasets.campaign import NoSnapshot
    from icha.datasets.table import as_csv
    from icha.figures.captions import count_runs, units_of_shapes
    from icha.figures.drawn import caption_of, models_of, say, shown_runs, table_of
    from icha.figures.measured import read_measurements
    from icha.figures.select import NothingToDraw
    from icha.figures.style import empty_page, save
    from icha.support.atomic_files import whole_file
    from icha.support.scripts import caption_in

    data = {argument: _read(files) for argument, files in inputs.items()}
    if "tables" in data:
        arguments = {**arguments, "measurements": read_measurements(data.pop("tables"), arguments["measurements"])}
    try:
        figure = drawing_function(name)(**data, **arguments)
        groups = getattr(data.get("campaign"), "children", {})
        say(figure, units_of_shapes(figure, [groups[study].to_dataset() for study in studies if study in groups]))
        caption = caption_in(data["script"]) if "script" in data else caption_of(figure)
    except (NothingToDraw, NoSnapshot) as reason:
        caption = f"Nothing to draw: {reason}."
        print(caption)
        figure = empty_page(str(reason))
    save(figure, png, pdf)
    with whole_file(table) as temporary:
        temporary.write_text(as_csv(table_of(figure)), encoding="utf-8")
    with whole_file(text) as temporary:
        counts = count_runs(data, studies, models_of(figure), shown_runs(figure))
        temporary.write_text(f"{caption} {counts}".strip() + "\n", encoding="utf-8")


def _read(files):
    """Return the content of netCDF files as datasets or trees; return the paths of other files unchanged."""
    from icha.datasets.files import has_groups, read_campaign, read_dataset

    if not isinstance(files, str | os.PathLike):
        return [_read(file) for file in files]
    if not str(files).endswith(".nc"):
        return files
    return read_campaign(files) if has_groups(files) else read_dataset(files)
