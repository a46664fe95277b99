"""Hysteresis of a path from first contact to separation: its pull-off, its loss and what that consists of."""

from collections.abc import Mapping, Sequence

import numpy as np

from icha.asperity.material import Material

_LOSSES = ("by_jump_in", "by_jump_off", "by_coalescence", "by_load_jump")


def hysteresis(
    steps: Sequence[Mapping[str, float]],
    pull_off: int,
    material: Material,
    largest_tension: float,
    unattributed: float,
) -> dict[str, float]:
    """Pull-off, detachment and losses, by the names of their variables.

    Parameters
    ----------
    steps : the path's equilibria in order, each with pressure, separation, area and energies by their names.
    pull_off : which of them has the largest tension of the last unloading.
    material : half-space and interface.
    largest_tension : Pa, of all asperities at once.
    unattributed : what is in no class of losses, J/m^2.
    """
    last, adhesive = steps[-1], material.surface_energy > 0
    touching = steps[max((k for k, step in enumerate(steps) if step["spot_count"]), default=0)]
    tension = max(0.0, -steps[pull_off]["nominal_pressure"])
    # Nothing is stored at either end.
    loss = last["work"]
    losses = {f"loss_{name}": last[f"dissipated_{name}"] for name in _LOSSES}
    strength = 16 / (9 * np.sqrt(3)) * material.surface_energy / material.interaction_range
    return {
        "pull_off_pressure": tension,
        "pull_off_separation": steps[pull_off]["mean_separation"],
        "pull_off_over_strength": tension / strength if adhesive else 0.0,
        "pull_off_over_summits": tension / largest_tension if adhesive else 0.0,
        "detachment_pressure": touching["nominal_pressure"],
        "detachment_separation": touching["mean_separation"],
        "hysteresis_loss": loss,
        "hysteresis_loss_over_surface_energy": loss / material.surface_energy if adhesive else 0.0,
        **losses,
        "loss_unattributed": unattributed,
        "largest_contact_area_fraction": max(step["contact_area_fraction"] for step in steps),
        "largest_reduced_pressure": max(step["reduced_pressure"] for step in steps),
    }
