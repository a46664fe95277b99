"""Power spectra of the surfaces of a campaign, as a picture of the report."""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.figures.looks import distinct_colours, legend_below, some_of
from icha.figures.style import TWO_COLUMNS, in_style, logarithmic_axes, new_figure

LEAST_POWER = 1e-16  # powers below this fraction of the largest power are rounding errors


def read_surface_statistics(path: str | os.PathLike) -> xr.Dataset:
    """Read a surface file without its heights."""
    with xr.open_dataset(path, engine="netcdf4", drop_variables=["height", "x", "y"]) as dataset:
        return dataset.load()


def picture_of_spectra(surfaces: Iterable[xr.Dataset]) -> str | None:
    """Draw the power spectra, averaged over the seeds of each surface, as a PNG in base64; None without spectra."""
    members: dict[str, list] = {}
    for surface in surfaces:
        if "power_spectrum" in surface and surface["power_spectrum"].any():
            members.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    if not members:
        return None
    file = io.BytesIO()
    draw_spectra(members).savefig(file, format="png", dpi=150, metadata={"Software": None})
    return base64.b64encode(file.getvalue()).decode("ascii")


@in_style
def draw_spectra(members: Mapping[str, Sequence[xr.Dataset]]) -> Figure:
    """Draw the mean power spectrum of each surface; if there are many surfaces, the legend names only some of them."""
    named = some_of(list(members))
    figure = new_figure(TWO_COLUMNS, 3.4)
    axes = figure.subplots()
    for (name, seeds), colour in zip(members.items(), distinct_colours(len(members)), strict=True):
        q = seeds[0]["psd_wavevector"].values
        power = np.mean([seed["power_spectrum"].values for seed in seeds if seed["psd_wavevector"].shape == q.shape], 0)
        visible = (q > 0) & (power > power.max() * LEAST_POWER)
        axes.plot(q[visible], power[visible], color=colour, label=name if name in named else None)
    logarithmic_axes(axes)
    axes.set(xlabel="wave number  $q$ (rad/m)", ylabel="power spectrum  $C(q)$ (m$^4$)")
    legend_below(figure, {})
    return figure
