"""Figure of a scan before and after its preparation, for `icha describe --plot`."""

import numpy as np
from matplotlib.figure import Figure

from icha.figures.style import TWO_COLUMNS, in_style, logarithmic_axes, new_figure
from icha.support.formatting import choose_unit
from icha.surfaces.moments import radial_power_spectrum
from icha.surfaces.surface import Surface


@in_style
def draw_preparation(before: Surface, after: Surface) -> Figure:
    """Draw maps of a scan before and after its preparation, and both radial power spectra.

    The surface `before` is the square that is cut out of the scan, with filled points and without tilt.
    """
    figure = new_figure(TWO_COLUMNS, 2.5)
    *maps, spectra = figure.subplots(1, 3)
    for axes, surface, title in zip(maps, (before, after), ("before", "after"), strict=True):
        (per_length, length), (per_height, height) = (
            choose_unit(value, "m") for value in (surface.period, float(np.ptp(surface.heights)))
        )
        side = surface.period * per_length
        image = axes.imshow(
            surface.heights * per_height, origin="lower", extent=(0, side, 0, side), cmap="cividis", rasterized=True
        )
        figure.colorbar(image, ax=axes, label=f"height ({height})", shrink=0.75)
        axes.set(title=title, xlabel=f"$x$ ({length})", ylabel=f"$y$ ({length})")
    for surface, label in ((before, "before"), (after, "after")):
        q, power, _ = radial_power_spectrum(surface)
        spectra.plot(q[power > 0], power[power > 0], label=label)
    logarithmic_axes(spectra)
    spectra.set(xlabel="wave number  $q$ (rad/m)", ylabel="$C(q)$ (m$^4$)")
    spectra.legend()
    return figure
