"""A figure of your own in a campaign.

figures:
  area_histogram: {study: load, script: own_figure.py}
"""

import matplotlib.pyplot as plt


def draw(study):
    """Sizes of the contact spots at the largest load, for each material."""
    figure, axes = plt.subplots(figsize=(4, 3), layout="constrained")
    for material in study.material.values:
        spots = study.spot_area.where(study.spot_material == list(study.material.values).index(material), drop=True)
        axes.hist(spots.values * 1e12, bins=20, histtype="step", label=str(material))
    axes.set(xlabel="area of a spot (um$^2$)", ylabel="number of spots", yscale="log")
    axes.legend()
    return figure
