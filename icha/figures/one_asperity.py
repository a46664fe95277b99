"""Figure of one asperity: force and contact radius against approach (1)."""

import numpy as np
from matplotlib.figure import Figure

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.figures.drawn import plot, say
from icha.figures.style import BLUE, GREY, VERMILLION, in_style, new_panels

_CAPTION = """Force F (a) and contact radius a (b) against the approach δ, for one asperity by the theory of Johnson,
Kendall and Roberts (JKR). On loading (solid line), the asperity snaps into contact at point A, where the gap equals
Wu's jump-in distance. Only this distance depends on the Tabor parameter μ; the value of μ above panel (b) is an
example. On unloading (dashed line), the asperity follows the stable branch to the jump-off point C, and detaches. Point
B is the pull-off point under load control. The dotted line is the unstable branch. Negative forces are tensile."""


@in_style
def jkr(*, tabor_parameter: float = 3.0) -> Figure:
    """Draw the JKR law in reduced units: a in (Δγ R²/E*)^(1/3), δ in (Δγ² R/E*²)^(1/3) and F in Δγ R."""
    law = JKR(Material(contact_modulus=1.0, surface_energy=1.0, interaction_range=1 / tabor_parameter))
    R, left, right = 1.0, -3.0, 3.2
    jump_in, jump_off = float(law.jump_in_approach(R)), float(law.jump_off_approach(R))
    a_off, a_in = float(law.jump_off_radius(R)), float(law.contact_radius(jump_in, R))
    a_end = float(law.contact_radius(right, R))
    stable = np.linspace(a_off, a_end, 400)
    after_jump = np.linspace(a_in, a_end, 400)
    unstable = np.geomspace(1e-6, a_off, 200)
    a_pull = float(np.cbrt(9 * np.pi / 8))  # dF/da = 0

    fig, [axes] = new_panels(2.9)
    say(fig, _CAPTION)
    for ax, value in ((axes[0], lambda a: law.force(a, R)), (axes[1], lambda a: a)):
        ax.axhline(0, color="0.75", lw=0.6, zorder=0)
        ax.axvline(0, color="0.75", lw=0.6, zorder=0)
        plot(ax, law.approach(unstable, R), value(unstable), ls=":", color=GREY, label="unstable")
        loading = np.append([left, jump_in], law.approach(after_jump, R)), np.append([0, 0], value(after_jump))
        plot(ax, *loading, ls="-", color=BLUE, lw=2.4, alpha=0.45, solid_joinstyle="round", label="loading")
        unloading = np.append(law.approach(stable[::-1], R), [jump_off, left]), np.append(value(stable[::-1]), [0, 0])
        plot(ax, *unloading, ls="--", color=VERMILLION, dashes=(4, 2), label="unloading")
        _arrow(ax, jump_in, 0.0, value(a_in), BLUE)
        _arrow(ax, jump_off, value(a_off), 0.0, VERMILLION)
        for point, x, y, shift in (
            ("A", jump_in, 0.0, (5, 5)),
            ("B", float(law.approach(a_pull, R)), value(a_pull), (3, -11) if ax is axes[0] else (5, -9)),
            ("C", jump_off, value(a_off), (-11, -9)),
        ):
            plot(ax, [x], [y], point, marker="o", color="white", mec="black", ms=4.5, zorder=5)
            ax.annotate(point, (x, y), shift, textcoords="offset points", fontweight="bold")
        ax.set(xlim=(left, right), xlabel=r"approach  $\delta\,/\,(\Delta\gamma^2 R/E^{\ast 2})^{1/3}$")
    axes[0].set(ylabel=r"force  $F/(\Delta\gamma\,R)$", ylim=(-6, 4.5))
    axes[1].set(ylabel=r"contact radius  $a\,/\,(\Delta\gamma R^2/E^{\ast})^{1/3}$", ylim=(-0.15, 3.0))
    for x, name in ((jump_in, r"$\Delta_{\mathrm{IN}}$"), (jump_off, r"$\Delta_{\mathrm{OFF}}$")):
        axes[1].axvline(x, ymin=0.05, ymax=0.86, color=GREY, lw=0.5, zorder=0)
        axes[1].text(x, 0.88, name, ha="center", va="bottom", transform=axes[1].get_xaxis_transform())
    axes[1].set_title(rf"$\Delta_{{\mathrm{{IN}}}}$ for the example $\mu$ = {tabor_parameter:g}", loc="right")
    handles, names = axes[0].get_legend_handles_labels()
    axes[0].legend(handles[1:] + handles[:1], names[1:] + names[:1], loc="upper left")
    return fig


def _arrow(ax, x, start, end, colour):
    """Draw an arrow head in the middle of a jump; the jump is a vertical line at x."""
    tail, tip = ((x, start + share * (end - start)) for share in (0.45, 0.55))
    ax.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0})
