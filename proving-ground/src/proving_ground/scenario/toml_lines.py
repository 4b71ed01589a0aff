"""On which line of a TOML text each key stands: the standard reader does not say, and an error should.

The text is valid TOML (tomllib has read it), so this scanner only has to follow the structure: headers, dotted
keys, arrays, inline tables, and the four kinds of strings, whatever brackets and newlines they hold.
"""

import bisect
import re
import tomllib

Key = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_STRING = re.compile(
    r'"""(?:\\.|(?!""")[^\\])*"{3,5}' r"|'''(?:(?!''').)*'{3,5}" r'|"(?:\\.|[^"\\])*"' r"|'[^']*'", re.DOTALL
)
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_BARE_VALUE = re.compile(r"[^,\]}#\n]+")
_STEP = re.compile(r"(?P<name>[^.\[\]]+)|\[(?P<index>\d+)\]")


class KeyLines:
    """The line (from 1) of every key, element and table of a valid TOML text."""

    def __init__(self, text: str) -> None:
        self._lines = _Scanner(text).scan()

    def of(self, key: Key) -> int:
        """The key's line, or that of the nearest table or list around it that stands in the text; at least 1."""
        return next((self._lines[key[:end]] for end in range(len(key), 0, -1) if key[:end] in self._lines), 1)


def parse_key(path: str) -> Key:
    """``rooms[2].name`` as ("rooms", 2, "name")."""
    return tuple(
        step["name"] if step["index"] is None else int(step["index"]) for step in _STEP.finditer(path)
    )


class _Scanner:
    """One pass over the text; `scan` returns the lines by key."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._line_starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self._lines: dict[Key, int] = {}
        self._tables_in: dict[Key, int] = {}  # arrays of tables: how many so far

    def scan(self) -> dict[Key, int]:
        """All the text."""
        table: Key = ()
        self._skip_blank()
        while self._at < len(self._text):
            if self._text[self._at] == "[":
                table = self._header()
            else:
                self._pair(table)
            self._skip_blank()
        return self._lines

    def _skip_blank(self) -> None:
        """White space, newlines and comments."""
        self._take(_BLANK)

    def _take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self._text, self._at)
        assert match is not None, f"not valid TOML at character {self._at}"
        self._at = match.end()
        return match[0]

    def _note(self, key: Key) -> None:
        """The key stands here, unless it has been seen before."""
        self._lines.setdefault(key, bisect.bisect_right(self._line_starts, self._at))

    def _header(self) -> Key:
        """``[table]`` or ``[[array.of.tables]]``: the key that what follows belongs to."""
        brackets = 2 if self._text.startswith("[[", self._at) else 1
        here = self._at
        self._at += brackets
        names = self._dotted()
        self._skip_blank()
        after, self._at = self._at + brackets, here
        key: Key = ()
        for depth, name in enumerate(names, start=1):
            key = (*key, name)
            self._note(key)
            if brackets == 2 and depth == len(names):
                self._tables_in[key] = self._tables_in.get(key, 0) + 1
            if key in self._tables_in:
                key = (*key, self._tables_in[key] - 1)
                self._note(key)
        self._at = after
        return key

    def _dotted(self) -> list[str]:
        """A key's names; the cursor ends behind the last."""
        names = []
        while True:
            self._skip_blank()
            names.append(self._name())
            self._skip_blank()
            if not self._text.startswith(".", self._at):
                return names
            self._at += 1

    def _name(self) -> str:
        if self._text[self._at] not in "\"'":
            return self._take(_BARE_KEY)
        quoted: str = tomllib.loads(f"name = {self._take(_STRING)}")["name"]
        return quoted

    def _pair(self, table: Key) -> None:
        """``key = value``."""
        here = self._at
        names = self._dotted()
        after, self._at = self._at, here
        for depth in range(1, len(names) + 1):
            self._note((*table, *names[:depth]))
        self._at = after + 1  # behind the equals sign
        self._skip_blank()
        self._value((*table, *names))

    def _value(self, key: Key) -> None:
        first = self._text[self._at]
        if first in "\"'":
            self._take(_STRING)
        elif first == "[":
            self._array(key)
        elif first == "{":
            self._inline_table(key)
        else:
            self._take(_BARE_VALUE)

    def _array(self, key: Key) -> None:
        index = 0
        while self._next_item("]"):
            self._note((*key, index))
            self._value((*key, index))
            index += 1

    def _inline_table(self, key: Key) -> None:
        while self._next_item("}"):
            self._pair(key)

    def _next_item(self, closing: str) -> bool:
        """Step over the opening bracket or a comma to the next item; False, behind ``closing``, if none is left."""
        self._skip_blank()
        if self._text[self._at] in "[{,":
            self._at += 1
            self._skip_blank()
        if self._text[self._at] == closing:
            self._at += 1
            return False
        return True
