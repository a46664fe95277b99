"""Variables of the cases of a study with `sample`, and of the shares of variance of their parameters."""

from icha.datasets.variables.terms import TERMS, read_tables
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS

_NO_RESULT = "where the run of a case has no result"
_NO_FIT = "where no polynomial is fitted; for half-widths also where more than a tenth of the cases is left out"
_OF_CASES = (*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS, "middle", "low", "high")
_OF_FITS = ("unexplained", "first_order", "total_order", "first_order_half_width", "total_order_half_width")
_ATTRIBUTES = {name: {"missing": _NO_RESULT} for name in _OF_CASES}
_ATTRIBUTES |= {name: {"missing": _NO_FIT} for name in (*_OF_FITS, "main_effect")}
SENSITIVITY = read_tables("sensitivity.txt", known=TERMS, attributes=_ATTRIBUTES)[""]
