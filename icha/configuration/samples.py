"""Key `sample` of a study: cases whose parameters are drawn from distributions (design of experiments)."""

from collections.abc import Iterator
from functools import cached_property, partial
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, create_model, model_validator

from icha.configuration.surfaces import PARAMETERS
from icha.support.rules import SLOPE, FloatRange, IntegerRange
from icha.support.values import Problem, Section, Seed, integer, rule_of, to_number, to_si
from icha.uncertainty.distributions import KINDS, Distribution

_EXPECTED = (
    "expected a range [low, high], or one of {uniform: [low, high]}, {loguniform: [low, high]}, "
    "{normal: [mean, standard deviation]}, {lognormal: [median, geometric standard deviation]}"
)
_PAIR = {"type": "array", "minItems": 2, "maxItems": 2, "items": {"type": ["string", "number"]}}
_SCHEMA = {
    "anyOf": [
        _PAIR,
        {
            "type": "object",
            "properties": dict.fromkeys(KINDS, _PAIR),
            "minProperties": 1,
            "maxProperties": 1,
            "additionalProperties": False,
        },
    ]
}


def _read_distribution(rule: FloatRange, value: Any) -> Distribution:
    """Return the distribution that a value of the configuration describes; raise ValueError for other values."""
    if isinstance(value, Distribution):
        return value
    given = {"uniform": value} if isinstance(value, list) else value
    kind, numbers = next(iter(given.items())) if isinstance(given, dict) and len(given) == 1 else (None, None)
    if kind not in KINDS or not isinstance(numbers, list) or len(numbers) != 2:
        raise ValueError(f"is not a distribution; {_EXPECTED}")
    reads = [partial(to_si, si_unit=rule.unit) if rule.unit != "1" else to_number] * 2
    if kind == "lognormal":
        reads[1] = to_number
    found = []
    for each, read, name in zip(numbers, reads, KINDS[kind], strict=True):
        try:
            found.append(read(each))
        except ValueError as error:
            raise ValueError(f"{each!r} ({name}) {error}; {_EXPECTED}") from None
    first, second = found
    within = [first] if kind in ("normal", "lognormal") else [first, second]
    for number in within:
        if not rule.contains(number):
            unit = "" if rule.unit == "1" else f" {rule.unit}"
            raise ValueError(f"{number:g}{unit} is out of range; expected {rule.expected}{unit}")
    if kind in ("uniform", "loguniform") and not first < second:
        raise ValueError("does not increase; expected [low, high] with low < high")
    if kind.startswith("log") and first <= 0:
        raise ValueError(f"has the logarithm of {first:g}; expected values greater than 0, or another distribution")
    if (kind == "normal" and second <= 0) or (kind == "lognormal" and second <= 1):
        least = "1" if kind == "lognormal" else "0"
        raise ValueError(f"{second:g} ({KINDS[kind][1]}) is too small; expected a number greater than {least}")
    return Distribution(kind, first, second)


# Bounds and description of each parameter with continuous values.
RULES = {name: rule for name, field in PARAMETERS.items() if (rule := rule_of(field))} | {"rms_slope": SLOPE}
_DESCRIPTIONS = {name: PARAMETERS[name].description for name in RULES if name in PARAMETERS}
_DESCRIPTIONS["rms_slope"] = "Rms slope h'rms, instead of the key `rms_slopes`."
Parameters = create_model(
    "Parameters",
    __base__=Section,
    __doc__="Distribution of each parameter that is sampled. A list `[low, high]` is a uniform distribution.",
    __module__=__name__,
    **{
        name: (
            Annotated[Any, BeforeValidator(partial(_read_distribution, RULES[name])), WithJsonSchema(_SCHEMA)],
            Field(default=None, description=text),
        )
        for name, text in _DESCRIPTIONS.items()
    },
)


class Sample(Section):
    """Cases of a study, with parameters drawn from distributions that are independent of each other."""

    method: Literal["sobol", "latin_hypercube"] = "sobol"
    """`sobol`: Sobol' sequence with scrambling. `latin_hypercube`: Latin hypercube."""
    count: integer(IntegerRange(4, 512))
    """Number of cases. With `sobol`, a power of 2."""
    seed: Seed = 1
    """Seed of the sample. It has nothing to do with the seeds of surfaces."""
    parameters: Parameters
    """Parameters that are sampled, with their distributions."""

    @model_validator(mode="after")
    def _check(self):
        if self.method == "sobol" and self.count.bit_count() != 1:
            more = 1 << self.count.bit_length()
            raise ValueError(f"count: {self.count} is not a power of 2; expected {more}, or method: latin_hypercube")
        if not self.distributions:
            raise ValueError("parameters: is empty; expected one parameter or more, such as `hurst: [0.5, 0.9]`")
        return self

    @property
    def distributions(self) -> dict[str, Distribution]:
        """Distribution of each sampled parameter, by name; the order does not depend on the configuration file."""
        found = {name: getattr(self.parameters, name) for name in sorted(type(self.parameters).model_fields)}
        return {name: each for name, each in found.items() if each is not None}

    @cached_property
    def values(self) -> list[dict[str, float]]:
        """Value of each sampled parameter in each case, with six digits, because names and files contain the values."""
        from scipy.stats import qmc

        sampler = {"sobol": qmc.Sobol, "latin_hypercube": qmc.LatinHypercube}[self.method]
        points = sampler(len(self.distributions), rng=self.seed).random(self.count)
        columns = [each.quantile(column) for each, column in zip(self.distributions.values(), points.T, strict=True)]
        names = list(self.distributions)
        return [
            {name: float(f"{x:.6g}") for name, x in zip(names, row, strict=True)} for row in zip(*columns, strict=True)
        ]

    @property
    def cases(self) -> list[dict[str, Any]]:
        """Values of the parameters of each case, as in the key `cases` of a study."""
        units = {name: "" if RULES[name].unit == "1" else f" {RULES[name].unit}" for name in self.distributions}
        return [
            {name: f"{value!r}{units[name]}" if units[name] else value for name, value in case.items()}
            for case in self.values
        ]

    def problems(self) -> Iterator[Problem]:
        """Yield a problem for each parameter of which a case has an impossible value."""
        for name in self.distributions:
            rule = RULES[name]
            for number, case in enumerate(self.values, start=1):
                if not rule.contains(case[name]):
                    reason = f"is out of range in case {number}; expected {rule.expected}, so a narrower distribution"
                    yield ("parameters", name), case[name], reason
                    break
