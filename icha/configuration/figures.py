"""The section of figures: one key for every figure that there is."""

from typing import Any

from pydantic import Field, create_model

from icha.datasets.results import ResultFiles
from icha.figures.declaration import Campaign, FigureOptions, Inputs
from icha.figures.registry import DECLARATIONS
from icha.support.values import Section


class _Drawn(Section):
    def drawn(self) -> dict[str, FigureOptions]:
        """The figures that are drawn, by name."""
        return {name: getattr(self, name) for name in type(self).model_fields if getattr(self, name) is not None}

    def inputs(self, name: str, campaign: Campaign, files: ResultFiles) -> Inputs:
        """The files that a figure is drawn from, by the arguments of the function that draws it."""
        return DECLARATIONS[name].inputs(campaign, getattr(self, name), files)

    def arguments(self, name: str, campaign: Campaign) -> dict[str, Any]:
        """The other arguments of the function that draws a figure."""
        options = getattr(self, name)
        return options.arguments() | DECLARATIONS[name].arguments(campaign, options)

    def studies_of(self, name: str, campaign: Campaign) -> tuple[str, ...]:
        """The studies whose runs a figure shows."""
        return getattr(self, name).studies_of(campaign)


Figures = create_model(
    "Figures",
    __base__=_Drawn,
    __doc__="The figures of the campaign; those that are left out are not drawn.",
    __module__=__name__,
    **{
        name: (declaration.options | None, Field(default=None, description=declaration.description))
        for name, declaration in DECLARATIONS.items()
    },
)
