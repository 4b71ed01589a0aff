"""Every key of a TOML text is found on the line where a plain search for its value finds it."""

import tomllib
from typing import Any

import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from proving_ground.scenario.toml_lines import Key, KeyLines, parse_key

ODD = """\
# comment with = and [
title = "a # no comment [ nor a table"
"quoted.key" = 1
long = '''
first = "not a key"
''' # [no.table]
end = \"\"\"two quotes: \"\" and
[not.a.header]
\"\"\"\"\"
a.b.c = 5
list = [
  1, # one
  [2, 3],
  { x = 4, y = { z = [
    5, "]" ] } },
]
when = 2026-06-01 08:00:00

[table]
key = 1
  [[table.rows]]
  name = "first"
  [table.rows.inner]
  deep = true
[[table.rows]]
name = "second"
inner.deep = false
[table.other."x y"]
z = {}
"""


def test_odd_but_valid_texts() -> None:
    tomllib.loads(ODD)  # it is valid
    lines = KeyLines(ODD)
    assert {key: lines.of(key) for key in EXPECTED} == EXPECTED


EXPECTED: dict[Key, int] = {
    ("title",): 2,
    ("quoted.key",): 3,
    ("long",): 4,
    ("end",): 7,
    ("a", "b", "c"): 10,
    ("a", "b"): 10,
    ("list",): 11,
    ("list", 0): 12,
    ("list", 1, 1): 13,
    ("list", 2, "x"): 14,
    ("list", 2, "y", "z", 0): 15,
    ("list", 2, "y", "z", 1): 15,
    ("when",): 17,
    ("table",): 19,
    ("table", "rows", 0): 21,
    ("table", "rows", 0, "name"): 22,
    ("table", "rows", 0, "inner", "deep"): 24,
    ("table", "rows", 1): 25,
    ("table", "rows", 1, "name"): 26,
    ("table", "rows", 1, "inner", "deep"): 27,
    ("table", "other", "x y", "z"): 29,
}


def test_a_key_that_is_not_there_is_told_by_the_table_around_it() -> None:
    lines = KeyLines(ODD)
    assert lines.of(("table", "rows", 1, "missing", 3)) == 25
    assert lines.of(("nowhere",)) == 1


def test_lines_end_as_on_windows() -> None:
    lines = KeyLines("a = 1\r\n\r\n[t]\r\nb = [\r\n2]\r\n")
    assert [lines.of(key) for key in [("a",), ("t",), ("t", "b"), ("t", "b", 0)]] == [1, 3, 4, 5]


def test_paths() -> None:
    assert parse_key("teams[0].tasks[12].to") == ("teams", 0, "tasks", 12, "to")
    assert parse_key("") == ()


_NAMES = st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]), min_size=1, max_size=6)
_LEAVES = st.one_of(st.none(), st.text("#[]{}=,.'\"\\\n é", max_size=8))


def _trees(leaves: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    def nested(inner: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
        return st.lists(inner, max_size=3) | st.dictionaries(_NAMES, inner, max_size=3)

    tables = st.recursive(leaves, nested, max_leaves=12)
    return st.dictionaries(_NAMES, tables, max_size=4)


@given(_trees(_LEAVES), st.booleans())
def test_every_value_is_on_the_line_of_its_sentinel(tree: dict[str, Any], multiline: bool) -> None:
    sentinels: dict[Key, str] = {}
    text = tomli_w.dumps(_marked(tree, (), sentinels), multiline_strings=multiline)
    lines = KeyLines(text)
    for key, sentinel in sentinels.items():
        assert sentinel in text.split("\n")[lines.of(key) - 1]


def _marked(value: Any, key: Key, sentinels: dict[Key, str]) -> Any:
    """The tree with a number at the head of every text that is nowhere else."""
    if isinstance(value, dict):
        return {name: _marked(inner, (*key, name), sentinels) for name, inner in value.items()}
    if isinstance(value, list):
        return [_marked(inner, (*key, index), sentinels) for index, inner in enumerate(value)]
    sentinel = f"@{len(sentinels):05d}@"
    sentinels[key] = sentinel
    # A multi-line text begins on the line below its key: keep it on one line there.
    return sentinel if value is None else sentinel + value.replace("\n", "\\")
