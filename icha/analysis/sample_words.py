"""The results of sampled cases in words: middle, range, and the share of variance that each parameter causes."""

import itertools
import math

import xarray as xr

from icha.contact.models import MODELS
from icha.datasets.quantities import quantity, state_words
from icha.support.distributions import KINDS
from icha.support.formatting import format_quantity


def sample_rows(data: xr.Dataset) -> list[dict]:
    """Return a row of texts for each result.

    The texts are `result`, `cases` (number of cases with a result), `middle`, `range`, `shares` by parameter,
    `unexplained`, and `left_out` (`icha.analysis.left_out.LeftOut.sentence`).
    """
    rows = []
    for k in range(data.sizes.get("response", 0)):
        row = data.isel(response=k)
        described, number = quantity(str(row["response_quantity"].item())), int(row["response_target"])
        factor, unit = described.in_unit(float(row["middle"]))
        state = f" at {state_words(*(data[key].values[number] for key in ('stop_kind', 'stop_target')))}"
        model = f", {MODELS[str(row['response_model'].item())].words}" if data.sizes["model"] > 1 else ""
        low, middle, high = (f"{float(f'{float(row[name]) * factor:.3g}'):g}" for name in ("low", "middle", "high"))
        biased = " (biased)" if row["biased"] else ""
        shares = [
            ""
            if math.isnan(share)
            else f"{100 * share:.0f} %{biased}"
            if math.isnan(half)
            else f"{100 * share:.0f} ± {100 * half:.0f} %{biased}"
            for share, half in zip(row["first_order"].values, row["first_order_half_width"].values, strict=True)
        ]
        error = float(row["unexplained"])
        rows.append(
            {
                "result": f"{described.name}{state if number >= 0 else ''}{model}",
                "cases": str(int(row["case_count"])),
                "middle": f"{middle} {unit}".strip() + biased,
                "range": "not stated" if low == "nan" else f"{low} to {high} {unit}".strip() + biased,
                "left_out": str(row["left_out"].item()),
                "shares": shares,
                "unexplained": "" if math.isnan(error) else f"{100 * min(error, 1):.2g} %",
            }
        )
    return rows


def distribution_words(data: xr.Dataset, name: str) -> str:
    """Describe the distribution of a parameter, such as `hurst: uniform, lower end 0.5, upper end 0.9`."""
    attributes = data[name].attrs
    kind, unit = attributes["distribution"], attributes["units"]
    texts = [
        f"{number:g}" if unit == "1" else format_quantity(number, unit) for number in attributes["distribution_numbers"]
    ]
    if kind == "lognormal":
        texts[1] = f"{attributes['distribution_numbers'][1]:g}"
    described = ", ".join(f"{words} {text}" for words, text in zip(KINDS[kind], texts, strict=True))
    return f"{name.replace('_', ' ')}: {kind}, {described}"


def sample_table(data: xr.Dataset) -> str:
    """Return the results of sampled cases as a table for a terminal."""
    names = data["parameter"].values.tolist()
    rows = sample_rows(data)
    lines = [["result", "cases", "middle", "90 % of cases", *names, "unexplained"]]
    lines += [[r["result"], r["cases"], r["middle"], r["range"], *r["shares"], r["unexplained"]] for r in rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    table = ["  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip() for line in lines]
    head = (
        f"{data.attrs['study']}: {data.sizes['case']} cases. Columns of parameters: share of the variance of the "
        "logarithm that the parameter alone causes"
    )
    return "\n".join(itertools.chain([head], (f"  {line}" for line in table), left_out_lines(rows)))


def left_out_lines(rows: list[dict]) -> list[str]:
    """Return a line for each group of results that leave out the same cases, such as `pull-off pressure: 9 of 16 …`."""
    groups: dict[str, list[str]] = {}
    for row in rows:
        groups.setdefault(row["left_out"], []).append(row["result"])
    return [
        f"{', '.join(results) if len(groups) > 1 else 'all results'}: {words}"
        for words, results in groups.items()
        if words
    ]
