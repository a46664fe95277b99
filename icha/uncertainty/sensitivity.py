"""Results of the cases of a study with `sample`, and the share of their variance that each parameter causes."""

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from icha.contact.models import MODELS
from icha.datasets import quantities
from icha.datasets.attributes import DERIVED, combine_attributes
from icha.datasets.build import build_dataset, stack_rows
from icha.datasets.labels import place_of
from icha.datasets.variables.sensitivity import SENSITIVITY
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS
from icha.uncertainty.distributions import KINDS, Distribution
from icha.uncertainty.estimates import CONTACT, LOOP, stops_of, values_of
from icha.uncertainty.left_out import INFINITE, NOT_POSITIVE, find_left_out
from icha.uncertainty.polynomial_chaos import Expansion, expand

# Surface, rms slope and material of each case, and for each sampled parameter: unit, kind and numbers of its
# distribution, and its value in each case.
Sampled = tuple[Sequence[tuple], Mapping[str, tuple]]

_SUMMARY = "Results of sampled cases, and the shares of their variance that the parameters cause."
# Number of values at which the effect of a parameter alone is computed, and the range of their probabilities.
_NODES, _TAIL = 21, 0.05


def sensitivity_of_campaign(
    tree: xr.DataTree, samples: Mapping[str, Sampled], *, attrs: Mapping[str, str] = {}
) -> xr.DataTree:
    """Return a tree with one group for each study with `sample`; `attrs` are further global attributes.

    The variables are those of `icha.datasets.variables.sensitivity`, and the sampled parameters along `case`.
    """
    groups = {f"/{name}": _sensitivity(tree[name].to_dataset(), name, *samples[name]) for name in samples}
    root = combine_attributes("Sampled cases of every study", _SUMMARY, DERIVED, [g.attrs for g in groups.values()])
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root | dict(attrs))} | groups)


def _sensitivity(study, name, cases, parameters):
    """Return the dataset of one study."""
    models, stops = study["model"].values.tolist(), stops_of(study)
    places = [place_of(study, dict(zip(CONTACT, case, strict=True))) for case in cases]
    index = tuple(np.array([place[label] for place in places]) for label in CONTACT)
    distributions = [Distribution(*of_parameter[1:4]) for of_parameter in parameters.values()]
    varied = {key: (of_parameter[0], np.array(of_parameter[4])) for key, of_parameter in parameters.items()}
    nodes = np.array([each.quantile(np.linspace(_TAIL, 1 - _TAIL, _NODES)) for each in distributions])
    results, rows = {}, []
    known = [quantity for quantity in (*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS) if quantity in study]
    for quantity, (m, model) in itertools.product(known, enumerate(models)):
        of_loop = quantity in ESTIMATED_OF_LOOPS
        targets = [(-1, (LOOP, 0.0))] if of_loop else list(enumerate(stops))
        shape = len(models), study.sizes["seed"], len(cases), len(targets)
        of_quantity = results.setdefault(quantity, np.empty(shape))
        for target, stop in targets:
            found = values_of(study, model, quantity, *stop)
            column, causes = found.values[:, *index].astype(float), found.causes[:, *index]
            # The stiffness of full contact is infinite.
            causes = np.where(np.isinf(column) & (causes == ""), INFINITE, causes)
            column = of_quantity[m, ..., target] = np.where(np.isinf(column), np.nan, column)
            # The logarithm of zero contact area, for example, is not finite.
            causes = np.where((causes == "") & ~(column > 0), NOT_POSITIVE, causes)
            prescribed = stop[0] in ESTIMATED_AT_TARGETS.get(quantity, ())
            if (causes == "").all(axis=0).any() and not prescribed:
                names = {"response_model": model, "response_quantity": quantity, "response_target": target}
                rows.append(names | _response(column, causes, varied, distributions, nodes))
    sizes = {"parameter": len(parameters), "node": _NODES}
    values = stack_rows(SENSITIVITY, rows, "response", sizes) if rows else {}
    values |= {key: each[..., 0] if key in ESTIMATED_OF_LOOPS else each for key, each in results.items()} | {
        "case": np.arange(len(cases)),
        "model": models,
        "seed": study["seed"].values,
        "target": np.arange(len(stops)),
        "stop_kind": [kind for kind, _ in stops],
        "stop_target": [target for _, target in stops],
        "parameter": list(parameters),
        "effect_value": nodes,
    }
    values |= dict(zip(CONTACT, zip(*cases, strict=True), strict=True))
    described = combine_attributes(f"Sampled cases of study {name}", _SUMMARY, DERIVED, [study.attrs])
    data = build_dataset(SENSITIVITY, values, described | {"study": name})
    for key, of in parameters.items():
        # A sampled rms slope is already among the coordinates.
        column = data["rms_slope"].values if key == "rms_slope" else varied[key][1]
        data = data.assign_coords({key: ("case", column, _attributes(key, of))})
    return data


def _attributes(name, of_parameter):
    unit, kind, first, second, _ = of_parameter
    numbers = f"{KINDS[kind][0]} and {KINDS[kind][1]}"
    return {
        "units": unit,
        "long_name": f"sampled {name.replace('_', ' ')}",
        "distribution": kind,
        "distribution_numbers": np.array([first, second]),
        "comment": f"distribution_numbers are {numbers}",
    }


def _response(column, causes, varied, distributions, nodes):
    """Return statistics and indices of a result of the cases; a case counts if all its seeds have a result.

    Parameters
    ----------
    column, causes : results, and why a run has none, shape (seeds, cases).
    varied : unit and values of each parameter, by name.
    distributions : distribution of each parameter.
    nodes : values of each parameter at which its effect is computed, shape (parameters, nodes).
    """
    left_out = find_left_out("cases", [next(filter(None, seeds), "") for seeds in causes.T], varied)
    known = (causes == "").all(axis=0)
    logarithms = np.log(column[:, known]).mean(axis=0)
    low, high = np.exp(np.quantile(logarithms, [_TAIL, 1 - _TAIL]))
    normal = [each.is_normal for each in distributions]
    samples = [values[known] for _, values in varied.values()]
    points, at = (
        np.array([each.standardise(row) for each, row in zip(distributions, rows, strict=True)])
        for rows in (samples, nodes)
    )
    return {
        "case_count": int(known.sum()),
        "left_out": left_out.sentence,
        "biased": int(left_out.biased),
        "middle": math.exp(logarithms.mean()),
        "low": low if left_out.has_interval else math.nan,
        "high": high if left_out.has_interval else math.nan,
    } | _indices(expand(points.T, normal, logarithms), at, normal, has_interval=left_out.has_interval)


def _indices(found: Expansion | None, at, normal, *, has_interval):
    """Return indices and main effects of a fitted polynomial; NaN without polynomial, half-widths also if biased."""
    names = ("first_order", "total_order", "first_order_half_width", "total_order_half_width")
    if found is None:
        nothing = dict.fromkeys(names, np.full(len(at), np.nan))
        return nothing | {"degree": 0, "unexplained": np.nan, "main_effect": np.full(at.shape, np.nan)}
    widths = found.half_widths() if has_interval else (np.full(len(at), np.nan),) * 2
    indices = dict(zip(names, (*found.indices(found.coefficients), *widths), strict=True))
    effects = [found.main_effect(k, row, normal=normal[k]) for k, row in enumerate(at)]
    return indices | {"degree": found.degree, "unexplained": found.error, "main_effect": np.exp(effects)}


def response_words(data: xr.Dataset, row: xr.Dataset) -> str:
    """Return quantity, state and, if there are several, model of a result of sampled cases."""
    words, target = quantities.quantity(str(row["response_quantity"].item())).name, int(row["response_target"])
    if target >= 0:
        words += f" at {quantities.state_words(*(data[key].values[target] for key in ('stop_kind', 'stop_target')))}"
    return words + (f", {MODELS[str(row['response_model'].item())].words}" if data.sizes["model"] > 1 else "")


def left_out_of_samples(data: xr.Dataset) -> list[str]:
    """Return a line for each group of results that leave out the same cases, such as `pull-off pressure: 9 of 16 …`."""
    groups: dict[str, list[str]] = {}
    for row in (data.isel(response=k) for k in range(data.sizes.get("response", 0))):
        groups.setdefault(str(row["left_out"].item()), []).append(response_words(data, row))
    return [
        f"{', '.join(results) if len(groups) > 1 else 'all results'}: {words}"
        for words, results in groups.items()
        if words
    ]
