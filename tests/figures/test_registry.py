"""Every figure that a configuration may request can be drawn."""

from icha.configuration.figures import Figures
from icha.datasets.results import figure_number
from icha.figures.registry import drawing_function


def test_figures_are_in_the_order_of_their_numbers_and_can_be_drawn():
    names = list(Figures.model_fields)
    numbers = [figure_number(name) for name in names]
    assert numbers == sorted(set(numbers)) and len(numbers) == 21
    for name in names:
        assert callable(drawing_function(name))
