"""The paper of the model, which everything that the model computes cites."""

from typing import NamedTuple


class Paper(NamedTuple):
    """A paper without an identifier; the authors by given and family names."""

    authors: tuple[tuple[str, str], ...]
    title: str

    @property
    def line(self) -> str:
        """The paper as it is cited in a text."""
        return f"{' and '.join(f'{given[0]}. {family}' for given, family in self.authors)}, {self.title}"


# That of the model: whoever uses data of the model builds on it.
MODEL_PAPER = Paper(
    (("Guido", "Violano"), ("Luciano", "Afferrante")),
    "Modeling the adhesive contact of rough soft media with an advanced asperity model",
)
