"""Tidy table of a campaign: one row for each run and target, one column for each label and quantity."""

import numpy as np
import pandas as pd
import xarray as xr

from icha.datasets.campaign import run_place, runs_of_status, variables_of_run
from icha.datasets.labels import LABELS
from icha.datasets.variables.campaign import COMPUTED_RUNS, STATUS_MEANINGS
from icha.path.targets import BETWEEN

# Ends of the names of columns, by unit.
_ENDINGS = {
    "1": "",
    "m": "_m",
    "Pa": "_Pa",
    "N": "_N",
    "m^2": "_m2",
    "m^-1": "_per_m",
    "m^-2": "_per_m2",
    "Pa m^-1": "_Pa_per_m",
    "N m^-1": "_N_per_m",
    "J m^-2": "_J_per_m2",
}


def column_name(name: str, unit: str) -> str:
    """Return the name of the column of a variable: its name and unit, such as `mean_separation_m`."""
    return name + _ENDINGS[unit]


def name_and_unit(column: str) -> tuple[str, str]:
    """Return name and unit of the variable in a column, the inverse of `column_name`."""
    endings = sorted(_ENDINGS.items(), key=lambda each: -len(each[1]))
    unit, ending = next(each for each in endings if column.endswith(each[1]))
    return column.removesuffix(ending), unit


def tidy_table(campaign: xr.DataTree) -> pd.DataFrame:
    """Return a table of all targets that the runs of a campaign reached; a run that reached none has one row.

    The columns are: study and labels of the run; varied parameters; status of the run; number, branch and target of the
    step; all quantities of the step; all quantities of the run. Names of columns end in the unit, if the unit is not 1.
    """
    return pd.concat([_study_table(campaign, name) for name in campaign.children], ignore_index=True)


def _study_table(campaign, name):
    """Return the table of one study."""
    study, frames = campaign[name].to_dataset(), []
    for labels in runs_of_status(study, name, COMPUTED_RUNS):
        variables, _ = variables_of_run(campaign, labels)
        targets = np.flatnonzero(variables["step_kind"].values.astype(str) != BETWEEN)
        place, columns = run_place(study, labels), labels._asdict()
        for varied, values in study.coords.items():
            if "varied" in values.attrs:
                unit = values.attrs["units"]
                columns[column_name(varied, unit)] = values.values[place[values.dims[0]]]
        columns["status"] = STATUS_MEANINGS[int(study["status"].isel(place))]
        of_steps, of_run = {}, {}
        for key, variable in variables.items():
            if variable.dims not in (("step",), ()) or key in LABELS:
                continue
            # The unit of a target depends on its kind.
            named = key if key == "step_target" else column_name(key, variable.attrs["units"])
            if not variable.dims:
                of_run[named] = variable.values.item()
            else:
                of_steps[named] = variable.values[targets] if len(targets) else [np.nan]
        frames.append(pd.DataFrame(columns | of_steps | of_run, index=range(max(len(targets), 1))))
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame({"study": []})


def as_csv(table: pd.DataFrame) -> str:
    """Return a table as CSV; numbers have ten digits, and missing values are empty."""
    return table.to_csv(index=False, float_format="%.10g", lineterminator="\n")
