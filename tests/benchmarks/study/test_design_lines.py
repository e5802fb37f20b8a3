"""In which line of a TOML file a value stands."""

import json
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.study.design.toml_lines import line_of, lines_of

FILE = '''\
# [no table]
schema = 1
dotted.key = [
  1, # ] not the end
  "]", """x = 1
[y]"""
]
"quoted.key" = 'z = 3'

[one]
inline = {a = 1, b = [2]}
text = \'\'\'
[[fake]]
key = 3\'\'\'
[[many]]
name = "x = y # z"
[many.below]
e = 1
[[many]]
name = 'y' # [[many]]
[[many.deep]]
g = 1
[[many.deep]]
g = 2
[one.more]
last = "\\"[" '''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("schema",), 2),
        (("dotted",), 3),
        (("dotted", "key"), 3),
        (("dotted", "key", 1), 3),
        (("quoted.key",), 8),
        (("one",), 10),
        (("one", "inline", "b", 0), 11),
        (("one", "text"), 12),
        (("many", 0, "name"), 16),
        (("many", 0, "below", "e"), 18),
        (("many", 1), 19),
        (("many", 1, "name"), 20),
        (("many", 1, "missing"), 19),
        (("many", 1, "deep", 1, "g"), 24),
        (("one", "more", "last"), 26),
        (("fake",), 0),
        ((), 0),
    ],
)
def test_values_have_the_line_of_their_key_or_of_what_is_around_them(path, line):
    tomllib.loads(FILE)
    assert line_of(FILE, path) == line


VALUES = st.sampled_from(
    [
        '"a"',
        '"[x]"',
        "'#'",
        '"""\n[t]\nk = 1\n"""',
        "[\n1,\n 2 # ]\n]",
        "{a = 1}",
        '"\\""',
        "'''\n''x'''",
        "3.5",
        "[[1],[2]]",
    ]
)
TABLES = st.lists(
    st.tuples(
        st.sampled_from(["t", "u"]),
        st.lists(st.tuples(st.sampled_from("kmn"), VALUES), unique_by=lambda p: p[0], max_size=3),
    ),
    max_size=4,
)


@given(TABLES, st.sampled_from(["", "# a comment with [[t]] and k = 1\n", "\n\n"]))
def test_every_key_of_lists_of_tables_is_found_where_it_was_written(tables, between):
    text, written, counts = between, {}, {}
    for table, entries in tables:
        number = counts[table] = counts.get(table, -1) + 1
        text += f"[[{table}]]\n"
        for key, value in entries:
            text += between
            written[table, number, key] = text.count("\n") + 1
            text += f"{key} = {value}\n"
    parsed = tomllib.loads(text)
    assert sum(len(entry) for entries in parsed.values() for entry in entries) == len(written)
    found = lines_of(text)
    assert {path: found[path] for path in written} == written


def test_the_longest_file_is_scanned_at_once():
    text = (
        "\n".join(f"k{n} = [{', '.join(map(str, range(50)))}]" for n in range(2000))
        + "\nlong = "
        + json.dumps([0] * 60_000)
    )
    assert line_of(text, ("long",)) == 2001
