"""Put all runs of a campaign into one dataset; analyse and check the dataset."""

from pathlib import Path

from job import job_context

from icha.analysis.checks import check_campaign, worst, write_checks
from icha.analysis.common_loads import compare_campaign
from icha.analysis.model_error import model_error
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_run, write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.stamp import refuse_outdated
from icha.datasets.table import as_csv, tidy_table
from icha.support.atomic_files import whole_file
from icha.uncertainty.estimates import estimate_campaign
from icha.uncertainty.sensitivity import sensitivity_of_campaign


def analyse(runs, outputs, *, stamps, compared, varied, samples, attributes, described):
    """Write campaign dataset, table, comparison, model error, answers, sensitivity and checks.

    Parameters
    ----------
    runs, outputs : labels of each run, by path; files to write, by name, without those that the campaign does not have.
    stamps : expected stamp of each run, in the order of `runs`.
    compared : paths of the runs with boundary elements that the asperity model is compared with.
    varied, samples : varied and sampled parameters of the studies.
    attributes, described : attributes of all datasets, and further ones of the campaign dataset.
    """
    refuse_outdated(dict(zip(runs, stamps, strict=True)))

    def described_as(name):
        return {
            "id": f"{attributes['campaign']}/{Path(outputs[name]).parent.name}/{Path(outputs[name]).stem}"
        } | attributes

    pairs = [(labels, path) for path, labels in runs.items()]
    tree = campaign_tree(pairs, design=runs.values(), attrs=described_as("dataset") | described, varied=dict(varied))
    write_dataset(tree, outputs["dataset"])
    with whole_file(outputs["table"]) as temporary:
        temporary.write_text(as_csv(tidy_table(tree)), encoding="utf-8")
    write_dataset(compare_campaign(tree, attrs=described_as("comparison")), outputs["comparison"])
    if "model_error" in outputs:
        truths = ((runs[path], read_run(path)) for path in compared)
        write_dataset(model_error(tree, truths, attrs=described_as("model_error")), outputs["model_error"])
    if "answers" in outputs:
        write_dataset(estimate_campaign(tree, attrs=described_as("answers")), outputs["answers"])
    if "sensitivity" in outputs:
        found = sensitivity_of_campaign(tree, samples, attrs=described_as("sensitivity"))
        write_dataset(found, outputs["sensitivity"])
    checks = check_campaign(tree)
    for check in worst(checks):
        print(f"{check.name}: {check.value:.3g}, at most {check.limit:g} ({check.subject})")
    write_checks(checks, outputs["checks"])


if "snakemake" in globals():
    with job_context(snakemake):
        params = snakemake.params
        files = {name: path if isinstance(path, str) else "".join(path) for name, path in snakemake.output.items()}
        analyse(
            {path: RunLabels(*labels) for path, *labels in params.runs},
            {name: path for name, path in files.items() if path},
            stamps=params.stamps,
            compared=params.compared,
            varied=params.varied,
            samples=params.samples,
            attributes=params.attributes,
            described=params.described,
        )
