"""Whether the model holds for a campaign: where its parts were verified, and how far it is from the truth.

Checks say that equations were solved; this says what the solutions are worth. The lines are short, to be read before a
campaign is run, after it, and on top of its report.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.asperity.material import WU_HOLDS_FROM
from icha.contact.models import ASPERITIES
from icha.datasets.labels import LABELS
from icha.datasets.variables.campaign import COMPUTED_RUNS

if TYPE_CHECKING:
    import xarray as xr

# Errors of the model in per cent, least and most of the means over the seeds, with adhesion and without: the summary of
# docs/validation.md, which is computed by campaign `validation`; a test compares them.
VALIDATION = {
    True: {"contact area": (-25.3, -8.1), "mean separation": (-36.1, -0.8)},
    False: {"contact area": (-21.4, -4.9), "mean separation": (-36.4, -0.8)},
}
_VALIDATED = "on seven self-affine surfaces, p* from 0.001 to 0.1 (page on validation)"

# Of single spots so many may lie outside the range of Wu's formula before it is said where: of every surface some do.
_FEW = 0.05
# So many cases are named.
_MOST_NAMES = 4


class Statement(NamedTuple):
    """A line: what it is about, what it says, and whether all is as it was verified."""

    about: str
    text: str
    good: bool = True


def statements(
    models: Mapping[str, Collection[str]],
    adhesive: Collection[bool],
    outside: str | None,
    others: Collection[str],
    sticky: Collection[str] = (),
) -> list[Statement]:
    """What is to be known of the models of a campaign, one line of each kind.

    Parameters
    ----------
    models : those of every study.
    adhesive : whether there are runs of asperities with adhesion, and without.
    outside : where jumps into contact lie outside what was verified, `named`; None if nothing jumps.
    others : surfaces that are not of the kind that the model was validated on.
    sticky : materials on surfaces that stick to each other without load, as `in_words_if_sticky` names them.
    """
    found = [Statement("models", _used(models))]
    if outside is not None:
        verified = f"Wu's distance is verified for Tabor parameters of {WU_HOLDS_FROM:g} and more"
        found.append(Statement("jump-in", f"{verified}; {outside or 'all cases inside'}", not outside))
    if sticky:
        text = f"attraction outweighs repulsion: {named(sticky)}; there errors can be many times those below"
        found.append(Statement("sticky", text, False))
    if adhesive:
        are = "are not self-affine surfaces" if len(others) > 1 else "is not a self-affine surface"
        but = f"; {named(others)} {are}: errors may be others there" if others else ""
        found.append(Statement("accuracy", f"{_error(adhesive)} {_VALIDATED}{but}", not others))
    return found


def named(cases: Iterable[str]) -> str:
    """The first of some cases, and how many there are besides."""
    cases = list(cases)
    more = len(cases) - _MOST_NAMES
    return ", ".join(cases[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def of_dataset(campaign: xr.DataTree, others: Collection[str] = ()) -> list[Statement]:
    """The statements on what was computed; other than complete runs count as far as they went.

    Parameters
    ----------
    campaign : the campaign dataset; of one that is left in its file only a few variables are read.
    others : as in `statements`.
    """
    models, adhesive, shares, sticky = {}, set(), {}, {}
    for name, node in campaign.children.items():
        study = node.to_dataset()
        models[name] = [str(model) for model in study["model"].values]
        if ASPERITIES not in models[name]:
            continue
        for surface, material, share in _outside(study):
            adhesive.add(share is not None)
            if share is not None:
                shares[surface, material] = max(share, shares.get((surface, material), 0.0))
                found = study["stickiness"].sel(surface=surface, material=material)
                sticky[surface, material] = max(float(found.max()), sticky.get((surface, material), 0.0))
    outside = _shares_in_words(shares) if shares else None
    return statements(models, adhesive, outside, others, in_words_if_sticky(sticky))


def in_words_if_sticky(found: Mapping[tuple[str, str], float]) -> list[str]:
    """Those materials on surfaces whose stickiness (`icha.asperity.stickiness`) is above 1, by surface and material."""
    return [
        f"{material} on {surface} (stickiness {value:.2g})" for (surface, material), value in found.items() if value > 1
    ]


def _shares_in_words(shares):
    there = sorted(((share, *at) for at, share in shares.items() if share > _FEW), key=lambda each: -each[0])
    cases = [f"{material} on {surface} ({100 * share:.0f} % of single spots)" for share, surface, material in there]
    return f"outside: {named(cases)}" if cases else ""


def _outside(study):
    """Surface and material of contacts, and the largest share of single spots outside the range, over seeds and slopes.

    It is that at the end of the first loading; None without adhesion, where nothing jumps.
    """
    runs = study[["status", "leg", "outside_wu_fraction", "surface_energy"]].sel(model=ASPERITIES)
    status = runs["status"].transpose(*LABELS[1:]).values
    share, leg = (runs[name].transpose(*LABELS[1:], "step").values for name in ("outside_wu_fraction", "leg"))
    energy = runs["surface_energy"].values
    for s, surface in enumerate(runs["surface"].values):
        for m, material in enumerate(runs["material"].values):
            there = np.isin(status[s, ..., m], COMPUTED_RUNS)
            loadings = zip(share[s, ..., m, :][there], leg[s, ..., m, :][there] == 0, strict=True)
            ends = [own[loading][-1] for own, loading in loadings if loading.any()]
            if ends:
                yield str(surface), str(material), float(max(ends)) if energy[m] > 0 else None


def _used(models):
    """Which models compute which studies."""
    studies: dict[str, list[str]] = {}
    for study, own in models.items():
        for model in own:
            studies.setdefault(model, []).append(study)
    return "; ".join(f"{model.replace('_', ' ')} in {named(own)}" for model, own in studies.items())


def _error(adhesive):
    """How far asperities were found to be from boundary elements, with adhesion, without, or both."""
    quantities = ", ".join(f"{name} {_too_small(name, adhesive)}" for name in VALIDATION[True])
    return f"{quantities}, beside boundary elements"


def _too_small(quantity, adhesive):
    """The range of an error, of both kinds of contact if they differ."""
    # With adhesion first.
    first, *others = (_range(*VALIDATION[kind][quantity]) for kind in sorted(adhesive, reverse=True))
    if not others or others == [first]:
        return f"{first} too small"
    return f"{first} too small with adhesion and {others[0]} without"


def _range(low, high):
    return f"{-high:.0f} to {-low:.0f} %"
