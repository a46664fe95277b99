"""Figures of studies, and what they show."""

from icha.figures import against_parameter


def draw(module, tree, study):
    """Draw a study with a function of one study or of several."""
    return module(tree, **({"studies": [study]} if module is against_parameter.loss else {"study": study}))


def legend(figure):
    """Return the names in the legend of a figure."""
    return [text.get_text() for text in figure.legends[0].get_texts()]


def lines_of(axes, *markers):
    """Return the lines of an axes that have points and one of these markers, or any marker."""
    lines = [line for line in axes.get_lines() if len(line.get_xdata())]
    return [line for line in lines if line.get_marker() in markers or (not markers and line.get_marker() != "None")]
