"""The graph of what was made of what."""

from __future__ import annotations

from icha.report.inline_svg import Node, flow_graph
from icha.report.surfaces import sources

# More studies than this share one box of the graph.
_MOST_STUDIES = 8


def provenance(studies, surfaces, figures, model_error, files, dataset):
    """The graph of what was made of what, with how many there are of each."""

    def counted(number, one, many):
        return f"{number} {one if number == 1 else many}"

    begin = {"configuration": Node("Configuration", "as used", files.get("Configuration"))}
    if measured := sources(surfaces):
        count = len({source["source_sha256"] for source in measured})
        begin["measured"] = Node("Measurements", counted(count, "file", "files"), "#surfaces")
    # A study may have the name of any other box: names of studies hold no blanks.
    middle = {
        f"study {study['name']}": Node(
            _short(study["name"]),
            counted(study["complete"], "run", "runs") + (f", {study['failed']} failed" if study["failed"] else ""),
            f"#study-{study['name']}",
        )
        for study in studies
    }
    if len(middle) > _MOST_STUDIES:
        runs = sum(study["complete"] for study in studies)
        middle = {"studies": Node(counted(len(studies), "study", "studies"), counted(runs, "run", "runs"), "#studies")}
    made: dict[str, Node] = {}
    columns = [
        begin,
        {"surfaces": Node("Surfaces", counted(len(surfaces), "topography", "topographies"), "#surfaces")}
        if surfaces
        else {},
        middle,
        {"dataset": Node("Campaign dataset", "all runs", dataset)},
        made,
        {"report": Node("Report", "this page")},
    ]
    if figures:
        made["figures"] = Node("Figures", counted(len(figures), "figure", "figures"), "#figures")
    if "Comparison" in files:
        made["comparison"] = Node("Comparison", "at common loads", files["Comparison"])
    made["checks"] = Node("Checks", "of the data", "#checks")
    arrows = [(each, "surfaces" if surfaces else study) for each in begin for study in middle]
    arrows += [("surfaces", study) for study in middle] if surfaces else []
    arrows += [(study, "dataset") for study in middle]
    if model_error is not None:
        states = sum(int(node["area_error"].count()) for node in model_error.children.values())
        columns[2]["boundary elements"] = Node("Boundary elements", counted(states, "state", "states"), "#error")
        made["error"] = Node("Error of the model", "against them", "#error")
        arrows += [("surfaces", "boundary elements")] if surfaces else []
        arrows += [("boundary elements", "error")]
    arrows += [("dataset", each) for each in made] + [(each, "report") for each in made]
    return flow_graph(columns, list(dict.fromkeys(arrows)), "What was made of what")


def _short(name, most=19):
    return name if len(name) <= most else name[: most - 1] + "…"
