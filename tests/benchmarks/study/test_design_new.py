"""New studies: what is written, and conditions that come from searches, reproductions and files."""

import json
import shutil

import pandas as pd
import pytest

from benchmarks.study.design.new import new_study
from benchmarks.study.design.sources import conditions_of, practice_layout, shipped_conditions
from benchmarks.study.design.study import check_study, load_study
from benchmarks.study.errors import StudyError
from legible_envs.overcooked.design.workspace import OvercookedWorkspace
from legible_envs.overcooked.layouts import read_layout
from legible_envs.tabletop.design.workspace import TabletopWorkspace
from legible_envs.tabletop.layout import TabletopLayout
from optimizers import load_run, search

KITCHEN = "XXTXOXX\nX     X\nC     D\nX  V  X\nF     P\nX  1  X\nXXXSXXX"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Small searches: of kitchens for two objectives, and of tables for one condition."""
    place = tmp_path_factory.mktemp("runs")
    for objective in ("legibility", "efficiency"):
        search(
            OvercookedWorkspace(shape=(6, 6)), objective=objective, evaluations=300, initial=100,
            checkpoint=place / objective, progress=False,
        )  # fmt: skip
    search(
        TabletopWorkspace(condition="placement"), evaluations=300, initial=100, checkpoint=place / "p", progress=False
    )
    return place


@pytest.mark.parametrize("domain", ["overcooked", "tabletop"])
def test_the_layouts_of_the_package_are_as_legible_as_their_names_say(domain):
    layouts = {each.name: each.layout for each in shipped_conditions(domain)}
    assert len(set(layouts.values())) == 4
    if domain == "overcooked":
        workspace = OvercookedWorkspace()
        found = {name: workspace.summary(workspace.encode(read_layout(text))) for name, text in layouts.items()}
        steps = {name: each["distance"] for name, each in found.items()}
        assert min(steps, key=steps.get) == "Efficient"
        order = ["Random", "Efficient", "Legible-Efficient", "Legible"]
    else:
        workspace = TabletopWorkspace()
        found = {name: workspace.summary(TabletopLayout.from_json(text)) for name, text in layouts.items()}
        assert found["Placement"]["num_obstacles"] == found["Baseline"]["num_obstacles"] == 0
        baseline = TabletopLayout.from_json(layouts["Baseline"])
        assert TabletopLayout.from_json(layouts["Virtual Obstacle"]).objects == baseline.objects
        order = ["Baseline", "Placement", "Virtual Obstacle", "Both"]
    scores = [found[name]["score"] for name in order]
    assert scores == sorted(scores)
    assert practice_layout(domain).layout not in layouts.values()


def test_a_folder_with_something_in_it_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    for place in (tmp_path, tmp_path / "mine.txt"):
        with pytest.raises(StudyError, match="not empty"):
            new_study(place, domain="overcooked")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    (tmp_path / "empty").mkdir()
    new_study(tmp_path / "empty", domain="overcooked")


def test_nothing_is_written_where_a_source_gives_nothing(tmp_path):
    with pytest.raises(StudyError, match=r"nowhere\.txt"):
        new_study(tmp_path / "s", domain="overcooked", sources=[str(tmp_path / "nowhere.txt")])
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("name", ["a study", "ünïcode", "x" * 120, "a#b", "trailing."])
def test_any_folder_gives_a_name_and_data_stay_out_of_version_control(tmp_path, name):
    new_study(tmp_path / name, domain="overcooked", language="en-GB")
    study = load_study(tmp_path / name)
    assert study.content.name
    assert study.content.language == "en-GB"
    assert "data/" in (tmp_path / name / ".gitignore").read_text().splitlines()


def test_conditions_of_searches_have_the_papers_names(runs, tmp_path):
    sources = [str(runs / "legibility"), str(runs / "efficiency"), f"Old={runs / 'legibility'}"]
    new_study(tmp_path / "s", domain="overcooked", sources=sources)
    study = load_study(tmp_path / "s")
    assert study.conditions == ["Legible", "Efficient", "Old"]
    best = load_run(runs / "legibility").best_layout
    assert read_layout(study.layout_of("Legible")) == read_layout(study.layout_of("Old")) == best
    assert any("have the same layout" in problem.message for problem in check_study(tmp_path / "s"))


def test_a_search_of_tables_gives_its_condition_or_all_that_were_searched_together(runs, tmp_path):
    [alone] = conditions_of(str(runs / "p"), "tabletop")
    assert alone.name == "Placement"
    assert TabletopLayout.from_json(alone.layout) == load_run(runs / "p").best_layout
    both = tmp_path / "both"
    search(TabletopWorkspace(condition="both"), evaluations=300, initial=100, checkpoint=both, progress=False)
    shutil.copytree(runs / "p", both / "placement")
    (both / "conditions.json").write_text(json.dumps({"both": ".", "placement": "placement"}))
    new_study(tmp_path / "s", domain="tabletop", sources=[str(both)])
    study = load_study(tmp_path / "s")
    assert study.conditions == ["Baseline", "Placement", "Both"]
    assert TabletopLayout.from_json(study.layout_of("Both")) == load_run(both).best_layout
    with pytest.raises(StudyError, match="leave out 'Mine'="):
        conditions_of(f"Mine={both}", "tabletop")


def test_the_best_layouts_of_a_reproduction(tmp_path):
    for name in ("people", "readings", "curves"):
        (tmp_path / f"{name}.csv").write_text("table\naccuracy\n")
    names = ("Random", "Efficient", "Legible-Efficient", "Legible")
    rows = []
    for condition in names:
        for number, score in enumerate((1.0, 3.0, 2.0)):
            drawing = KITCHEN.replace("1", " ").replace("X     X", f"X{' ' * number}1{' ' * (4 - number)}X", 1)
            rows.append(
                {"table": "layout", "condition": condition, "layout": number, "drawing": drawing, "score": score,
                 "distance": 10 - score}
            )  # fmt: skip
            rows.append({"table": "elite", "condition": condition, "layout": number, "objective": -score})
    pd.DataFrame(rows).to_csv(tmp_path / "layouts.csv", index=False)
    found = conditions_of(str(tmp_path), "overcooked")
    assert [each.name for each in found] == list(names)
    starts = {each.name: read_layout(each.layout).starts[0][1] - 1 for each in found}
    # The middle one, the one with the fewest steps, the one of the best elite, the most legible one.
    assert starts == {"Random": 2, "Efficient": 1, "Legible-Efficient": 0, "Legible": 1}


def test_the_best_tables_of_a_reproduction_are_those_of_the_papers_conditions(tmp_path):
    for name in ("readings", "curves", "spreads", "teams"):
        (tmp_path / f"{name}.csv").write_text("table,reader\naccuracy,x\n")
    layouts = {each.name: each.layout for each in shipped_conditions("tabletop")}
    other = practice_layout("tabletop").layout
    rows = [
        {"condition": condition, "layout": number, "score": 1.0, "objective": objective,
         "json": layouts.get(condition, other) if number else other}
        for condition in ("Random", *layouts)
        for number, objective in enumerate((1.0, 2.0))
    ]  # fmt: skip
    pd.DataFrame(rows).to_csv(tmp_path / "layouts.csv", index=False)
    found = {each.name: TabletopLayout.from_json(each.layout) for each in conditions_of(str(tmp_path), "tabletop")}
    assert found == {name: TabletopLayout.from_json(text) for name, text in layouts.items()}


def test_layout_files_are_conditions_of_their_name(tmp_path):
    (tmp_path / "kitchen one.layout").write_text(
        json.dumps({"grid": KITCHEN, "start_all_orders": [{"ingredients": ["onion"]}]})
    )
    [found] = conditions_of(str(tmp_path / "kitchen one.layout"), "overcooked")
    assert found.name == "kitchen one"
    assert found.file("overcooked") == "layouts/kitchen-one.txt"
    assert read_layout(found.layout) == read_layout(KITCHEN)
    [named] = conditions_of(f"Mine={tmp_path / 'kitchen one.layout'}", "overcooked")
    assert named.name == "Mine"


@pytest.mark.parametrize(
    ("sources", "domain", "message"),
    [
        (["{runs}/p"], "overcooked", "TabletopLayout"),
        (["{runs}/legibility"], "tabletop", "OvercookedLayout"),
        (["{runs}"], "overcooked", "neither the folder of a search"),
        (["=x"], "overcooked", "not NAME=PATH"),
        (["{runs}/legibility/metrics.csv"], "overcooked", "no conditions can be taken"),
        (["{runs}/legibility/best.json"], "tabletop", "no conditions can be taken"),
        (["{runs}/legibility", "{runs}/legibility"], "overcooked", "name one: NAME=PATH"),
        (["A={runs}/legibility", "a={runs}/legibility"], "overcooked", "name one: NAME=PATH"),
        (["practice={runs}/legibility"], "overcooked", "cannot be called 'practice'"),
        (["a/b={runs}/legibility"], "overcooked", "the name of a file"),
        (["a#b={runs}/legibility"], "overcooked", "without '#'"),
    ],
)
def test_sources_that_give_no_conditions_are_refused(runs, tmp_path, sources, domain, message):
    with pytest.raises(StudyError, match=message):
        new_study(tmp_path / "s", domain=domain, sources=[source.format(runs=runs) for source in sources])
    assert not (tmp_path / "s").exists()
