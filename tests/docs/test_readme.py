"""The README's examples do what it says."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
import small_campaign as small

from icha.configuration.cases import solution_cases
from icha.configuration.load import load_configuration
from icha.datasets.campaign import campaign_tree
from icha.datasets.files import write_dataset

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def blocks(language, containing=""):
    found = re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)
    return [block for block in found if containing in block]


def test_the_model_runs_without_the_workflow():
    (code,) = blocks("python", "icha.simulate")
    names = {}
    exec(compile(code, "README", "exec"), names)
    assert list(names["run"].reduced_pressure.values) == pytest.approx([1e-3, 3e-3, 1e-2], rel=1e-9)


def test_figure_5_is_redrawn_from_the_dataset_in_ten_lines(tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.chdir(tmp_path)
    runs = [(labels._replace(study="multi_slope"), run) for labels, run in small.runs() if labels.study == "slopes"]
    tree = campaign_tree(runs, attrs={"campaign": "paper"})
    write_dataset(tree, tmp_path / "results/paper/dataset/paper.nc")
    (code,) = blocks("python", "open_datatree")
    statements = [line for line in code.splitlines() if line and not line.startswith("import")]
    assert len(statements) <= 11
    plt.close("all")  # of other tests
    names = {}
    exec(compile(code, "README", "exec"), names)
    lines = names["plt"].gca().get_lines()
    assert len(lines) == len(runs)
    drawn = sorted(tuple(line.get_ydata()) for line in lines)
    assert drawn == sorted(tuple(run.contact_area_fraction.values) for _, run in runs)
    assert (tmp_path / "fig5.png").stat().st_size > 0
    names["plt"].close()


@pytest.fixture
def campaign(tmp_path):
    def loaded(text):
        (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
        return load_configuration(tmp_path / "mine.yaml").campaign

    return loaded


def test_the_campaign_of_the_five_minutes_is_a_valid_one(campaign):
    (text,) = blocks("yaml", "name: mine")
    assert set(campaign(text).studies) == {"load"}


def test_boundary_elements_can_be_added_to_it(campaign):
    (text,), (more,) = blocks("yaml", "name: mine"), blocks("yaml", "finite_range:")
    cases = solution_cases(campaign(text + "\n" + more))
    assert len(cases) == 3 * 2 and {case.material for case in cases} == {"bare"}


def test_a_way_back_can_be_added_to_it(campaign):
    (text,), (more,) = blocks("yaml", "name: mine"), blocks("yaml", "unload: true")
    study = campaign(text.replace("studies:\n", f"studies:\n{more}")).studies["pull"]
    assert study.unload and [point.target[1] for point in study.turning_points] == [0.0, 1e-2]
