"""``legible study new`` and ``check`` as a researcher types them."""

import pytest

from tests.support.command_line import legible


def test_new_then_check_says_what_is_to_be_filled_in_and_that_it_is_ready(tmp_path):
    made = legible("study", "new", tmp_path / "s", "--domain", "overcooked")
    assert made.exit_code == 0, made.output
    assert f"legible study check {tmp_path / 's'}" in made.output
    checked = legible("study", "check", tmp_path / "s")
    assert checked.exit_code == 0, checked.output
    lines = checked.output.splitlines()
    assert "warning: texts/consent.md:3: the placeholder [TITLE OF THE STUDY] is still to be filled in" in lines
    assert sum(line.startswith("rehearsed: ") for line in lines) == 5
    assert lines[-1].startswith("ready: 4 conditions, orders drawn for everyone (random), 13 screens; design ")
    assert not any(line.startswith("error") for line in lines)


def test_check_tells_every_error_with_file_and_line_and_fails(tmp_path):
    legible("study", "new", tmp_path / "s", "--domain", "tabletop")
    settings = tmp_path / "s/study.toml"
    text = settings.read_text().replace("threshold = 0.8", "threshold = 0.8\nspeed = 1").replace('"auto"', '"pink"')
    settings.write_text(text)
    lines = text.split("\n")
    numbers = [next(n for n, line in enumerate(lines, 1) if line.startswith(key)) for key in ("speed", "theme")]
    checked = legible("study", "check", tmp_path / "s")
    assert checked.exit_code == 1
    assert f"error: study.toml:{numbers[0]}: `partner` has the unknown key 'speed'" in checked.output
    assert f"error: study.toml:{numbers[1]}: `look.theme` must be one of" in checked.output
    assert checked.output.splitlines()[-1] == "2 errors, 0 warnings"


def test_check_fails_where_a_round_cannot_be_finished_in_its_steps(tmp_path):
    legible("study", "new", tmp_path / "s", "--domain", "overcooked")
    settings = tmp_path / "s/study.toml"
    settings.write_text(settings.read_text().replace("max_steps = 1200", "max_steps = 99"))
    checked = legible("study", "check", tmp_path / "s")
    assert checked.exit_code == 1
    assert "error: condition 'Legible': a simulated participant did not finish it in 99 steps" in checked.output
    assert legible("study", "check", tmp_path / "s", "--no-rehearse").exit_code == 0


def test_orders_and_sittings_are_counted(tmp_path):
    legible("study", "new", tmp_path / "s", "--domain", "tabletop")
    settings = tmp_path / "s/study.toml"
    settings.write_text(
        settings.read_text() + '[[sittings]]\nname = "a"\n[[sittings]]\nname = "b"\nobstacles = false\n'
    )
    checked = legible("study", "check", tmp_path / "s", "--no-rehearse")
    assert "ready: 4 conditions in 2 sittings, 4 orders (williams), " in checked.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["new"], "Missing argument"),
        (["new", "{there}/s"], "--domain"),
        (["new", "{there}/s", "--domain", "kitchen"], "'kitchen'"),
        (["new", "{there}", "--domain", "overcooked"], "not empty"),
        (["new", "{there}/s", "--domain", "overcooked", "--from", "{there}/file"], "no conditions can be taken"),
        (["new", "{there}/file", "--domain", "overcooked"], "where a folder must be"),
        (["check", "{there}/nowhere"], "does not exist"),
        (["chek", "{there}"], "did you mean check or code?"),
    ],
)
def test_a_wrong_call_is_one_line_and_exit_code_2(tmp_path, arguments, message):
    (tmp_path / "file").write_text("nothing of use")
    result = legible("study", *(argument.format(there=tmp_path) for argument in arguments))
    assert result.exit_code == 2
    assert message in result.output
    assert "Traceback" not in result.output


def test_what_stands_in_files_cannot_steer_the_terminal(tmp_path):
    (tmp_path / "study.toml").write_text('schema = 1\nname = "\\u001b[31mred\\u0007"\n')
    checked = legible("study", "check", tmp_path)
    assert checked.exit_code == 1
    assert "\x1b" not in checked.output
    assert "\x07" not in checked.output
