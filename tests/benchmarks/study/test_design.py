"""A study's folder, as it is written, read and checked: whatever a researcher breaks is named, with file and line."""

import json
import os
import shutil
from pathlib import Path

import pytest

from benchmarks.study.design.new import new_study
from benchmarks.study.design.package_files import default_words
from benchmarks.study.design.settings_checks import contrast
from benchmarks.study.design.study import check_study, load_study
from benchmarks.study.design.text_names import TEXTS
from benchmarks.study.errors import StudyError
from benchmarks.study.timeline import ENDINGS, timeline


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """A new study of each domain, its placeholders filled in."""
    place = tmp_path_factory.mktemp("studies")
    for domain in ("overcooked", "tabletop"):
        new_study(place / domain, domain=domain)
        for text in (place / domain / "texts").glob("*.md"):
            text.write_text(text.read_text("utf-8").replace("[", "(").replace("]", ")"), "utf-8")
    return place


@pytest.fixture
def kitchens(originals, tmp_path):
    return Path(shutil.copytree(originals / "overcooked", tmp_path / "kitchens"))


@pytest.fixture
def tables(originals, tmp_path):
    return Path(shutil.copytree(originals / "tabletop", tmp_path / "tables"))


def edit(folder, old, new, file="study.toml"):
    text = (folder / file).read_text("utf-8")
    assert old in text, f"{old!r} is not in {file}"
    (folder / file).write_text(text.replace(old, new, 1), "utf-8")


def line_with(folder, text, file="study.toml"):
    return next(n for n, line in enumerate((folder / file).read_text("utf-8").split("\n"), 1) if text in line)


def problem_with(folder, message):
    """The one problem whose message has these words."""
    found = [problem for problem in check_study(folder) if message in problem.message]
    assert len(found) == 1, check_study(folder)
    return found[0]


@pytest.mark.parametrize("domain", ["overcooked", "tabletop"])
def test_a_new_study_with_its_placeholders_filled_in_is_in_order(originals, domain):
    assert check_study(originals / domain) == []
    study = load_study(originals / domain)
    assert study.words == default_words()
    assert set(ENDINGS) <= study.texts.keys() < TEXTS.keys() | {""}
    assert study.layout_of("") != study.layout_of(study.conditions[0])
    screens = timeline(study, study.conditions)
    assert {screen.text for screen in screens if screen.text} <= study.texts.keys()
    assert {screen.questionnaire for screen in screens if screen.questionnaire} == study.questionnaires.keys()


def test_the_new_studies_are_those_of_the_paper(originals):
    kitchens, tables = (load_study(originals / domain) for domain in ("overcooked", "tabletop"))
    assert kitchens.conditions == ["Random", "Efficient", "Legible-Efficient", "Legible"]
    assert tables.conditions == ["Baseline", "Placement", "Virtual Obstacle", "Both"]
    assert (kitchens.content.orders.policy, tables.content.orders.policy) == ("random", "williams")
    assert len(kitchens.content.kitchen.soups) == 3
    assert (tables.content.rounds.reaches, tables.content.rounds.per_condition) == (8, 4)
    assert tables.content.partner is not None
    for study in (kitchens, tables):
        assert study.content.practice is not None
        after = {(use.name, use.after) for use in study.content.questionnaires}
        assert {("nasa-tlx", "condition"), ("comments", "study")} <= after
    assert "fluency" in tables.questionnaires
    assert "fluency" not in kitchens.questionnaires


def test_a_new_study_warns_of_its_placeholders_and_of_nothing_else(tmp_path):
    new_study(tmp_path / "s", domain="overcooked")
    problems = check_study(tmp_path / "s")
    assert problems
    assert all(
        not p.is_error and p.file.startswith("texts/") and "still to be filled in" in p.message for p in problems
    )
    consent = [p for p in problems if p.file == "texts/consent.md"]
    assert all("[" in (tmp_path / "s" / p.file).read_text().split("\n")[p.line - 1] for p in consent)
    load_study(tmp_path / "s")


# -- what is wrong is named, with key and line ------------------------------------------------------------------------

SETTINGS = [
    # what was there, what is there now, key, words of the message
    ("schema = 1", "schema = 2", "schema", "must be 1, got 2"),
    ('name = "Random"', 'name = "a/b"', "conditions[0].name", "the name of a file"),
    ('name = "Efficient"', 'name = "random"', "conditions[1].name", "unique"),
    ("cook_time = 20", 'cook_time = "long"', "kitchen.cook_time", "must be an integer from 1 to 1000"),
    ("cook_time = 20", "cooktime = 20", "kitchen.cooktime", "did you mean `cook_time`?"),
    ('layout = "layouts/legible.txt"', 'layout = "/etc/passwd"', "conditions[3].layout", "a path within the study"),
    ('layout = "layouts/legible.txt"', 'layout = "layouts/../x"', "conditions[3].layout", "a path within the study"),
    ('layout = "layouts/legible.txt"', 'layout = "layouts/x.txt"', "conditions[3].layout", "no file layouts/x.txt"),
    ('layout = "layouts/practice.txt"', 'layout = "texts"', "practice.layout", "not a plain file"),
    ('predictor = "bayesian"', 'predictor = "bayes"', "predictor", "did you mean 'bayesian'?"),
    ('predictor = "bayesian"', 'predictor = "reach-gaussian"', "predictor", "reaches at tables"),
    ('policy = "random"', 'policy = "latin"', "orders.policy", "an order policy is one of"),
    ('policy = "random"', 'policy = "os:getcwd"', "orders.policy", "cannot be used"),
    ('language = "en"', 'language = "English!"', "language", "a tag such as"),
    ('name = "comments"', 'name = "coments"', "questionnaires[1].name", "there is no questionnaire 'coments'"),
    ('after = "study"', 'after = "never"', "questionnaires[1].after", "must be one of"),
    ("idle_warning = 120", "idle_warning = 300", "limits.idle_warning", "must be less than `idle_timeout`"),
    ("# complete = ", "compleet = ", "recruitment.codes.compleet", "unknown ending 'compleet'"),
    ("# complete = ", "complete = ' C '#", "recruitment.codes.complete", "without blanks at its ends"),
    ('accent = "#1f7a4d"', 'accent = "green"', "look.accent", "must be a colour"),
    ('north = ["ArrowUp", "KeyW"]', 'north = ["Up"]', "look.keys.north[0]", "no `KeyboardEvent.code`"),
    ('north = ["ArrowUp", "KeyW"]', 'north = ["KeyS"]', "look.keys.south[1]", "is both north and south"),
    ('interact = ["Space", "KeyE"]', "", "look.keys", "no key for interact"),
    ('interact = ["Space", "KeyE"]', 'jump = ["KeyJ"]', "look.keys.jump", "must be one of"),
]


@pytest.mark.parametrize(("old", "new", "key", "message"), SETTINGS)
def test_a_wrong_setting_is_named_with_key_and_line(kitchens, old, new, key, message):
    line = line_with(kitchens, old)
    edit(kitchens, old, new)
    problem = problem_with(kitchens, message)
    assert (problem.file, problem.key, problem.is_error) == ("study.toml", key, True)
    if new and "south" not in key:
        assert problem.line == line
    with pytest.raises(StudyError) as refusal:
        load_study(kitchens)
    assert problem in refusal.value.problems


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("http://study.example/{code}", "begins with https://"),
        ("javascript:alert(1)", "begins with https://"),
        ("https://a.example/?x={worker}", "unknown placeholder {worker}"),
        ("https://a.example/?x={code", "without its other one"),
        ("https://{code}.example/", "placeholder in its host"),
        ("https://user:secret@a.example/", "no user and password"),
        ("https://a.example/a b", "no blanks"),
        ("https://a.example:99999/", "is no address"),
        ("https:///path", "begins with https://"),
        ("https://app.prolific.com/submissions/complete?cc={code}", ""),
        ("http://localhost:8000/{participant}?e={ending}", ""),
    ],
)
def test_where_participants_are_sent_is_an_address_that_a_browser_may_open(kitchens, url, message):
    edit(kitchens, 'completion_url = ""', f'completion_url = "{url}"')
    if not message:
        assert check_study(kitchens) == []
    else:
        assert problem_with(kitchens, message).line == line_with(kitchens, url)


WARNINGS = [
    ('source = "none"', 'source = "prolific"', "take nothing back"),
    ('source = "none"', 'source = "mturk"', "take nothing back"),
    ('accent = "#1f7a4d"', 'accent = "#ffee00"', "contrast of 1.2"),
    ('north = ["ArrowUp", "KeyW"]', 'north = ["Tab"]', "people without a mouse need"),
    ("idle_warning = 120", "idle_warning = 0", "without a warning"),
    ("idle_timeout = 300", "idle_timeout = 0", "no session ever ends"),
    ("[rounds]", "[table]\ncontact = 'slow'\n[rounds]", "how tables are played"),
    ('layout = "layouts/legible.txt"', 'layout = "layouts/efficient.txt"', "have the same layout"),
    ("# complete = ", 'refused = "C1ABCDEF"\ncomplete = ', "two endings have the same code"),
    ('layout = "layouts/legible.txt"', 'layout = "layouts/efficient.txt"', "uses this file"),
]


@pytest.mark.parametrize(("old", "new", "message"), WARNINGS)
def test_what_a_study_can_run_with_is_a_warning(kitchens, old, new, message):
    edit(kitchens, old, new)
    assert not problem_with(kitchens, message).is_error
    load_study(kitchens)


def test_wanted_participants_should_be_a_multiple_of_the_orders(tables):
    edit(tables, "wanted = 0", "wanted = 22")
    assert "no multiple of the 4 orders" in problem_with(tables, "multiple").message
    edit(tables, "wanted = 22", "wanted = 24")
    assert check_study(tables) == []


def test_all_problems_are_told_at_once_and_the_settings_come_first(kitchens):
    edit(kitchens, 'accent = "#1f7a4d"', 'accent = "green"')
    edit(kitchens, "idle_warning = 120", "idle_warning = 300")
    (kitchens / "texts/round.md").unlink()
    (kitchens / "layouts/random.txt").write_text("XXX\nX X\nXXX\n")
    found = [(problem.file, bool(problem.line)) for problem in check_study(kitchens)]
    assert found == [
        ("study.toml", True), ("study.toml", True), ("layouts/random.txt", False), ("texts/round.md", False),
    ]  # fmt: skip
    with pytest.raises(StudyError, match=r"study\.toml:\d+: .* \(3 more are wrong\)"):
        load_study(kitchens)


# -- sittings ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sittings", "key", "message"),
    [
        (
            '[[sittings]]\nname = "a"\nconditions = ["Legible", "Legibel"]',
            "sittings[0].conditions[1]",
            "names 'Legibel'",
        ),
        ('[[sittings]]\nname = "a"\nconditions = ["Legible", "Legible"]', "sittings[0].conditions[1]", "twice"),
        ('[[sittings]]\nname = "a"\n[[sittings]]\nname = "A"', "sittings[1].name", "unique"),
        (
            '[[sittings]]\nname = "a"\n[[sittings]]\nname = "b"\nmin_gap_hours = 9\nmax_gap_hours = 8',
            "sittings[1].max_gap_hours",
            "at least `min_gap_hours`",
        ),
    ],
)
def test_sittings_that_do_not_fit_are_named(kitchens, sittings, key, message):
    (kitchens / "study.toml").write_text((kitchens / "study.toml").read_text() + sittings)
    problem = problem_with(kitchens, message)
    assert (problem.key, problem.is_error) == (key, True)


def test_a_sitting_without_obstacles_is_checked_bare(kitchens):
    walled = "XXTXOXX\nX  V  X\nC  V  D\nX  V  X\nF 1V  P\nX  V  X\nXXXSXXX\n"
    (kitchens / "layouts/random.txt").write_text(walled)
    assert "cannot be reached" in problem_with(kitchens, "cannot be reached").message
    (kitchens / "study.toml").write_text(
        (kitchens / "study.toml").read_text() + '[[sittings]]\nname = "bare"\nobstacles = false\n'
    )
    assert check_study(kitchens) == []


def test_a_pause_has_its_text_where_there_is_one(kitchens):
    (kitchens / "texts/pause.md").unlink()
    assert check_study(kitchens) == []
    two = '[[sittings]]\nname = "a"\n[[sittings]]\nname = "b"\n'
    (kitchens / "study.toml").write_text((kitchens / "study.toml").read_text() + two)
    assert problem_with(kitchens, "the text `pause`").file == "texts/pause.md"


# -- layouts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("XXXXXXX\nX     X\nXXXXXXX\n", "no tomato station"),
        ("XXTXOXX\nX  V  X\nC  V  D\nX  V  X\nF 1V  P\nX  V  X\nXXXSXXX\n", "cannot be reached"),
        ("XXTXOXX\nX  ?  X\nC     D\nX     X\nF 1   P\nX     X\nXXXSXXX\n", "'?'"),
        ('{"schema": 1}', "LayoutError"),
        ("", "empty"),
    ],
)
def test_a_kitchen_that_cannot_be_played_is_named_by_file(kitchens, text, message):
    (kitchens / "layouts/legible.txt").write_text(text)
    [problem] = check_study(kitchens)
    assert (problem.file, problem.is_error) == ("layouts/legible.txt", True)
    assert "condition 'Legible'" in problem.message
    if message not in ("LayoutError", "empty"):
        assert message in problem.message


def test_obstacles_that_can_be_crossed_do_not_shut_a_kitchen(kitchens):
    (kitchens / "layouts/legible.txt").write_text("XXTXOXX\nX  V  X\nC  V  D\nX  V  X\nF 1V  P\nX  V  X\nXXXSXXX\n")
    edit(kitchens, 'virtual_obstacles = "hard"', 'virtual_obstacles = "soft"')
    assert check_study(kitchens) == []


def test_a_kitchen_whose_cells_are_small_on_a_phone_is_a_warning(kitchens):
    rows = ["XTOCFDPSX" + "X" * 21, *["X" + " " * 28 + "X"] * 5, "X" * 30]
    (kitchens / "layouts/legible.txt").write_text("\n".join(rows))
    assert not problem_with(kitchens, "small on a phone").is_error


def test_the_practice_must_have_what_its_own_soups_need(kitchens):
    edit(kitchens, 'soups = [["onion", "onion", "onion"]]', 'soups = [["fish"]]')
    assert "no fish station" in problem_with(kitchens, "fish").message
    assert problem_with(kitchens, "fish").file == "layouts/practice.txt"


def change_table(folder, file, change):
    path = folder / "layouts" / file
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d["objects"].pop(), "in this order"),
        (lambda d: d["objects"][0].update(at=[5, 5]), "lies outside the region"),
        (lambda d: d.update(obstacles=[{"at": [0.95, 0.45], "angle": 1.57, "size": [0.4, 0.1]}]), "start 'assembly'"),
        (
            lambda d: d.update(obstacles=[{"at": [0.95, 0.57], "angle": 0.0, "size": [0.2, 0.14]}]),
            "the place of red-circle",
        ),
        (lambda d: d.update(hobstacles=[]), "hobstacles"),
    ],
)
def test_a_table_that_cannot_be_played_is_named_by_file(tables, change, message):
    change_table(tables, "placement.json", change)
    problem = problem_with(tables, message)
    assert (problem.file, problem.is_error) == ("layouts/placement.json", True)


def test_obstacles_over_places_do_no_harm_where_they_can_be_crossed(tables):
    over = [{"at": [0.95, 0.57], "angle": 0.0, "size": [0.2, 0.14]}]
    change_table(tables, "placement.json", lambda d: d.update(obstacles=over))
    edit(tables, 'virtual_obstacles = "hard"', 'virtual_obstacles = "soft"')
    assert check_study(tables) == []


TABLE_SETTINGS = [
    ('task = "columns"', 'task = "colums"', "table.task", "no task 'colums'"),
    ('task = "columns"', 'task = "tasks/own.yaml"', "table.task", "no file tasks/own.yaml"),
    ('kind = "robot"', 'kind = "robt"', "partner.kind", "'module:Class'"),
    ('kind = "robot"', 'kind = "os:getcwd"', "partner.kind", "`reset` and `step`"),
    (
        'predictor = "bayesian"       # Or',
        'predictor = "x" # Or',
        "partner.predictor",
        "no predictor named 'x'",
    ),
    ('predictor = "bayesian"       # Or', 'predictor = "grid-knn" # Or', "partner.predictor", "where cooks go"),
]


@pytest.mark.parametrize(("old", "new", "key", "message"), TABLE_SETTINGS)
def test_a_wrong_setting_of_a_table_is_named(tables, old, new, key, message):
    line = line_with(tables, old)
    edit(tables, old, new)
    problem = problem_with(tables, message)
    assert (problem.key, problem.line, problem.is_error) == (key, line, True)


def test_a_robot_needs_a_task_that_says_where_objects_belong(tables):
    edit(tables, 'task = "columns"', 'task = "bins"')
    assert problem_with(tables, "the task 'bins' has none").key == "partner"


def test_a_task_of_ones_own_lies_in_the_folder_and_counts_for_the_design(tables):
    from legible_envs.tabletop.task import read_task

    before = load_study(tables).design_hash
    (tables / "own.yaml").write_text(read_task("columns").to_yaml())
    edit(tables, 'task = "columns"', 'task = "own.yaml"')
    assert check_study(tables) == []
    own = load_study(tables).design_hash
    (tables / "own.yaml").write_text("# mine\n" + (tables / "own.yaml").read_text())
    assert len({before, own, load_study(tables).design_hash}) == 3


def test_a_task_with_work_for_a_robot_alone_needs_the_robot(tables):
    from legible_envs.tabletop.task import TabletopTask, read_task

    plan = read_task("columns").to_dict()
    for subtask in plan["task"]["subtasks"][:2]:
        subtask["agents"] = ["robot"]
    TabletopTask.from_dict(plan).to_yaml(tables / "own.yaml")
    edit(tables, 'task = "columns"', 'task = "own.yaml"')
    assert check_study(tables) == []
    edit(tables, "reaches = 8 ", "reaches = 25 ")
    assert not problem_with(tables, "cannot be made in 4 rounds with 6 objects each").is_error
    study = (tables / "study.toml").read_text("utf-8")
    start = study.index("[partner]")
    (tables / "study.toml").write_text(study[:start] + study[study.index("\n[", start) + 1 :], "utf-8")
    assert any("only a robot can perform, and there is none" in problem.message for problem in check_study(tables))


def test_a_robot_is_for_tables_only(kitchens):
    edit(kitchens, "[rounds]", "[partner]\nthreshold = 0.9\n[rounds]")
    assert problem_with(kitchens, "in kitchens there is none").key == "partner"


def test_soups_that_cannot_be_told_apart_are_named_once_with_their_setting(kitchens):
    edit(kitchens, 'soups = [["tomato", "tomato", "onion"]', 'soups = [["fish"]')
    problem = problem_with(kitchens, "is contained in")
    assert (problem.key, problem.is_error) == ("kitchen.soups", True)
    assert check_study(kitchens) == [problem]


def test_no_more_reaches_are_wanted_than_can_be_made(tables):
    edit(tables, "reaches = 8 ", "reaches = 33 ")
    assert not problem_with(tables, "cannot be made in 4 rounds with 8 objects each").is_error
    edit(tables, "reaches = 3 ", "reaches = 9 ")
    assert problem_with(tables, "nobody could finish the practice").key == "practice.reaches"


# -- texts, words, questionnaires -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(set(TEXTS) - {"pause"}))
def test_every_text_must_be_there(kitchens, name):
    (kitchens / f"texts/{name}.md").unlink()
    [problem] = check_study(kitchens)
    assert (problem.file, problem.is_error) == (f"texts/{name}.md", True)
    assert TEXTS[name] in problem.message


@pytest.mark.parametrize(
    ("data", "message", "is_error"),
    [
        (b" \n", "empty", True),
        (b"a\xffb", "0xff is not UTF-8", True),
        (b"\0\0", "not text", True),
        (b"x" * 2_000_000, "more than 1,000,000 bytes", True),
        (b"x" * 200_000, "at most 100,000 are shown", True),
        (b"# Hi\n\n<b>x</b>", "HTML is shown as it is written", False),
        (b"![a](https://b.example/c.png)", "pictures are not shown", False),
        (b"we pay [AMOUNT]", "[AMOUNT] is still to be filled in", False),
    ],
)
def test_a_text_that_participants_would_stumble_over_is_named(kitchens, data, message, is_error):
    (kitchens / "texts/consent.md").write_bytes(data)
    problem = problem_with(kitchens, message)
    assert (problem.file, problem.is_error) == ("texts/consent.md", is_error)


def test_links_and_boxes_are_no_placeholders(kitchens):
    (kitchens / "texts/consent.md").write_text(
        "[a link](https://x.example) and [another][1] and \\[this]\n\n[1]: https://y.example\n"
    )
    assert check_study(kitchens) == []


def test_a_file_that_leads_out_of_the_folder_is_not_read(kitchens, tmp_path):
    (tmp_path / "secret.md").write_text("secret")
    (kitchens / "texts/consent.md").unlink()
    (kitchens / "texts/consent.md").symlink_to(tmp_path / "secret.md")
    assert "leads out of the study's folder" in problem_with(kitchens, "leads out").message


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_and_not_waited_for(kitchens):
    (kitchens / "texts/consent.md").unlink()
    os.mkfifo(kitchens / "texts/consent.md")
    assert "not a plain file" in problem_with(kitchens, "plain file").message


def test_a_translation_is_another_folder(kitchens):
    shutil.copytree(kitchens / "texts", kitchens / "texte")
    edit(kitchens, 'texts = "texts"', 'texts = "texte"')
    edit(kitchens, 'language = "en"', 'language = "de"')
    words = "".join(f"{key} = {json.dumps('~' + text)}\n" for key, text in default_words().items())
    (kitchens / "texte/words.toml").write_text(words)
    for text in (kitchens / "texte").glob("*.md"):
        text.write_text(f"Hallo {text.stem}")
    for problem in check_study(kitchens):
        assert "questionnaire" in problem.message
        assert not problem.is_error
    (kitchens / "texte/questionnaires").mkdir()
    for name in ("nasa-tlx", "comments"):
        (kitchens / f"texte/questionnaires/{name}.toml").write_text(
            'title = "T"\n[[items]]\nname = "i"\nkind = "text"\ntext = "Wie?"\n'
        )
    assert check_study(kitchens) == []
    study = load_study(kitchens)
    assert study.words["begin"] == "~Begin"
    assert study.texts["consent"] == "Hallo consent"
    assert study.questionnaires["nasa-tlx"].items[0].text == "Wie?"


def test_texts_that_nobody_translated_are_named(kitchens):
    edit(kitchens, 'language = "en"', 'language = "de"')
    shutil.rmtree(kitchens / "texts")
    new_study(kitchens / "x", domain="overcooked")
    shutil.move(kitchens / "x/texts", kitchens / "texts")
    warned = {problem.file for problem in check_study(kitchens) if "still in English" in problem.message}
    assert {"texts/words.toml", "texts/welcome.md", "texts/instructions.md"} <= warned


@pytest.mark.parametrize(
    ("old", "new", "key", "message"),
    [
        ('begin = "Begin"', 'begin = "Begin"\nbegn = "x"', "begn", "did you mean `begin`?"),
        ('begin = "Begin"', "begin = 3", "begin", "must be a text, got 3"),
        ('begin = "Begin"', 'begin = " "', "begin", "must be a text of 1 to"),
        ("within {seconds} seconds", "soon", "idle_warning", "must hold {seconds}"),
        ("within {seconds} seconds", "within {second} seconds", "idle_warning", "must hold {seconds}"),
    ],
)
def test_words_are_complete_and_known_and_hold_their_values(kitchens, old, new, key, message):
    edit(kitchens, old, new, "texts/words.toml")
    problem = problem_with(kitchens, message)
    assert (problem.file, problem.key, problem.is_error) == ("texts/words.toml", key, True)


def test_english_words_may_be_left_to_the_package_others_not(kitchens):
    (kitchens / "texts/words.toml").write_text('begin = "Start"\n')
    assert load_study(kitchens).words == {**default_words(), "begin": "Start"}
    (kitchens / "texts/words.toml").unlink()
    assert load_study(kitchens).words == default_words()
    edit(kitchens, 'language = "en"', 'language = "pt-BR"')
    assert any(problem.file == "texts/words.toml" and problem.is_error for problem in check_study(kitchens))
    (kitchens / "texts/words.toml").write_text('begin = "Começar"\n')
    missing = {problem.key for problem in check_study(kitchens) if "is missing; in English it is" in problem.message}
    assert missing == default_words().keys() - {"begin"}


def test_a_questionnaire_of_ones_own_replaces_that_of_the_package_and_is_checked(kitchens):
    (kitchens / "questionnaires").mkdir()
    own = kitchens / "questionnaires/comments.toml"
    own.write_text('title = "Mine"\n[[items]]\nname = "a"\nkind = "text"\ntext = "?"\n')
    assert load_study(kitchens).questionnaires["comments"].title == "Mine"
    own.write_text(own.read_text() + '[[items]]\nname = "a"\nkind = "slidr"\ntext = "?"\n')
    problem = problem_with(kitchens, "items[1].kind")
    assert (problem.file, problem.line) == ("questionnaires/comments.toml", 8)
    own.write_text("title = ")
    assert problem_with(kitchens, "not valid TOML").file == "questionnaires/comments.toml"


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[[questionnaires]]\nname = "comments"\nafter = "study"\n', "asked twice"),
        ('[[questionnaires]]\nname = "fluency"\nafter = "study"\n', "the study has no [partner]"),
    ],
)
def test_questionnaires_are_asked_once_and_about_what_is_there(kitchens, more, message):
    (kitchens / "study.toml").write_text((kitchens / "study.toml").read_text() + more)
    assert problem_with(kitchens, message).file == "study.toml"


def test_questions_after_the_practice_need_one(kitchens):
    text = (kitchens / "study.toml").read_text()
    begin, end = text.index("[practice]"), text.index("[rounds]")
    text = text[:begin] + text[end:] + '[[questionnaires]]\nname = "comments"\nafter = "practice"\n'
    (kitchens / "study.toml").write_text(text)
    assert problem_with(kitchens, "no [practice]").key == "questionnaires[2].after"


# -- the design hash ---------------------------------------------------------------------------------------------------

SAME = [
    ("wanted = 0", "wanted = 40"),
    ('source = "none"', 'source = "prolific"'),
    ("idle_warning = 120", "idle_warning = 60"),
    ("resume_hours = 24", "resume_hours = 48"),
    ("recent_minutes = 60", "recent_minutes = 5"),
    ('predictor = "bayesian"', 'predictor = "grid-knn"'),
    ("# Sittings", "# Comments and Sittings"),
]
OTHER = [
    ("cook_time = 20", "cook_time = 21"),
    ('name = "Random"', 'name = "Chance"'),
    ('policy = "random"', 'policy = "williams"'),
    ('resume = "resume"', 'resume = "restart"'),
    ("waiting = 0.25", "waiting = 0.5"),
    ('theme = "auto"', 'theme = "dark"'),
    ('after = "condition"', 'after = "study"'),
]


@pytest.mark.parametrize(("old", "new", "is_same"), [(*s, True) for s in SAME] + [(*o, False) for o in OTHER])
def test_the_design_hash_is_of_what_participants_meet(originals, kitchens, old, new, is_same):
    before = load_study(originals / "overcooked").design_hash
    edit(kitchens, old, new)
    assert (load_study(kitchens).design_hash == before) == is_same
    assert len(before) == 16
    int(before, 16)


@pytest.mark.parametrize(
    "file", ["texts/welcome.md", "texts/words.toml", "layouts/legible.txt", "layouts/practice.txt"]
)
def test_the_design_hash_is_of_every_file(originals, kitchens, file):
    change = {"texts/words.toml": ("Begin", "Start"), "texts/welcome.md": ("Welcome", "Hello")}.get(
        file, ("XX", "XX\n")
    )
    if file.startswith("layouts"):
        rows = (kitchens / file).read_text().split("\n")
        (kitchens / file).write_text("\n".join(row[::-1] for row in rows))
    else:
        edit(kitchens, *change, file)
    assert load_study(kitchens).design_hash != load_study(originals / "overcooked").design_hash


def test_a_copy_in_another_place_is_the_same_design(originals, kitchens):
    assert load_study(kitchens).design_hash == load_study(originals / "overcooked").design_hash


# -- folders that are none --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("content", [None, "", "schema = ", "x = 1979-05-27", "[" * 200, "schema = 1\nschema = 1"])
def test_what_is_no_study_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "study.toml").write_text(content)
    with pytest.raises(StudyError, match=r"study\.toml") as refusal:
        load_study(tmp_path)
    assert list(refusal.value.problems) == check_study(tmp_path)
    assert all(problem.is_error for problem in refusal.value.problems)


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(StudyError, match="legible study new"):
        load_study(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("a", "b", "expected"), [("#000000", "#ffffff", 21), ("#767676", "#ffffff", 4.54), ("#123456", "#123456", 1)]
)
def test_contrast_is_that_of_the_guidelines(a, b, expected):
    assert contrast(a, b) == contrast(b, a) == pytest.approx(expected, abs=0.005)
