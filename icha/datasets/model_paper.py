"""The paper of the model, which everything that the model computes cites."""

from typing import NamedTuple


class Paper(NamedTuple):
    """A paper on arXiv; the authors by given and family names."""

    authors: tuple[tuple[str, str], ...]
    title: str
    year: int
    arxiv: str

    @property
    def address(self) -> str:
        """Where the paper is."""
        return f"https://arxiv.org/abs/{self.arxiv}"

    @property
    def line(self) -> str:
        """The paper as it is cited in a text."""
        authors = " and ".join(f"{given[0]}. {family}" for given, family in self.authors)
        return f"{authors}, {self.title}, arXiv:{self.arxiv} ({self.year})"


# That of the model: whoever uses data of the model builds on it. Volume and pages of its printed version could not be
# verified and are left out.
MODEL_PAPER = Paper(
    (("Guido", "Violano"), ("Luciano", "Afferrante")),
    "Modeling the adhesive contact of rough soft media with an advanced asperity model",
    2019,
    "1907.05859",
)
