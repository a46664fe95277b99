"""Draw one figure from the campaign dataset."""

import importlib
import textwrap

from job import guarded

from icha.datasets.files import read_campaign, read_dataset
from icha.datasets.measured_table import read_columns
from icha.figures.select import NothingToDraw
from icha.figures.style import GREY, new_figure, save, styled

READERS = {
    "campaign": read_campaign,
    "references": read_dataset,
    "surface": read_dataset,
    "model_error": read_campaign,
    "solution": read_dataset,
    "loops": lambda paths: [read_dataset(path) for path in _several(paths)],
    "error_sources": lambda paths: [read_dataset(path) for path in _several(paths)],
}


def _several(paths):
    """A list of files, also if Snakemake gives the only one of them as itself."""
    return [paths] if isinstance(paths, str) else list(paths)


def draw_figure(name, png, pdf, *, data, options, measurements=()):
    """Draw the figure of the module `icha.figures.<name>` and write it to `png` and `pdf`.

    `data` are the files of its arguments, `measurements` pairs of a file and what is to be known of it. Where nothing
    of what it shows is complete, the figure is an empty page that says so.
    """
    module = importlib.import_module(f"icha.figures.{name}")
    arguments = {argument: READERS[argument](path) for argument, path in data.items()}
    if measurements:
        options = options | {"measurements": [_measured(module.MeasuredAreas, *pair) for pair in measurements]}
    try:
        figure = module.figure(**arguments, **options)
    except NothingToDraw as reason:
        # The verdict says which runs failed; what can be drawn is drawn.
        print(f"An empty page: {reason}")
        figure = _empty_page(str(reason))
    save(figure, png, pdf)


@styled
def _empty_page(reason):
    figure = new_figure(5.0, 2.5)
    figure.text(0.5, 0.5, textwrap.fill(reason, 60), ha="center", va="center", color=GREY, parse_math=False)
    return figure


def _measured(kind, file, settings):
    load, area = read_columns(file, settings["columns"])
    known = {key: settings[key] for key in ("label", "citation", "material", "rms_slope")}
    return kind(reduced_pressure=load / settings["load_unit"], area_fraction=area, **known)


if "snakemake" in globals():
    with guarded(snakemake):
        inputs = dict(snakemake.input.items())
        measured = inputs.pop("measurements", [])
        draw_figure(
            snakemake.wildcards.name,
            snakemake.output.png,
            snakemake.output.pdf,
            data=inputs,
            options=snakemake.params.options,
            measurements=list(zip(_several(measured), snakemake.params.measurements, strict=True)),
        )
