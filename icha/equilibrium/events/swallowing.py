"""Swallowing: new contacts that lie in another's contact area are under it, and are taken back.

The equations are singular where one spot's edge runs through another's centre.
"""

from dataclasses import replace

import numpy as np

from icha.equilibrium.equations import Point
from icha.equilibrium.search import Search


def swallow(search: Search, point: Point) -> Search:
    """New contacts in another's contact area taken into that."""
    sites, a, near, known = search.sites, point.a, point.interaction.pairs, search.sites.known
    i, j = near.target, near.source
    inside = np.flatnonzero((near.r < a[j]) & (a[i] > 0) & ~known[i])
    inside = inside[known[j[inside]] | (a[i[inside]] < a[j[inside]])]
    if not len(inside):
        return search
    inside = inside[np.argsort((a[j] - near.r)[inside], kind="stable")]
    i, j = i[inside], j[inside]
    holder = search.holder.copy()
    holder[sites.asperity[i]] = i
    index = np.append(np.arange(len(sites)), -1)
    index[i] = j  # the deepest comes last and stays
    while np.any(index[index] != index):  # who takes one in may be taken in itself, by a larger one
        index = index[index]
    search = search.forgetting_jumps_in(sites.asperity[np.unique(i)])
    return replace(
        search,
        sites=replace(sites.removed(i), approach=point.approach),
        holder=index[holder],  # -1 looks up the last
    )
