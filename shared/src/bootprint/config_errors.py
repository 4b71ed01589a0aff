"""Why a configuration was refused, in one sentence: the place, what stands there, and what would be right.

msgspec says what it expected and at which path; this module follows that path through the values and the types.
"""

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass

import msgspec
from msgspec import inspect

_MESSAGE = re.compile(r"(?P<what>.*?)(?: - at `(?P<at>\$[^`]*)`)?\Z", re.DOTALL)
_UNKNOWN = re.compile(r"Object contains unknown field `(.*)`\Z")
_MISSING = re.compile(r"Object missing required field `(.*)`\Z")
_STEP = re.compile(r"\.(?P<name>[A-Za-z0-9_-]+)|\[(?P<index>\d+)\]|(?P<any>\[\.\.\.\])")
_PLAIN = {"object": "a table", "array": "a list", "str": "text", "bool": "true or false"}


@dataclass(frozen=True, slots=True)
class Misfit:
    """What is wrong: the key at fault as one writes it in TOML (``rooms[2].name``; empty: the file), and why."""

    key: str
    reason: str


@dataclass(frozen=True, slots=True)
class _Place:
    """A value, what may stand there, and its path as one writes it in TOML."""

    value: object
    types: tuple[inspect.Type, ...]
    path: str

    def step(self, name: str | None, index: str | None) -> "_Place":
        """One step down: into a table by name, into a list by index, into a table of any names by trying."""
        if name is not None:
            return self._named(name)
        if index is not None:
            return self._indexed(int(index))
        return self._culprit()

    def _named(self, name: str) -> "_Place":
        value = self.value.get(name) if isinstance(self.value, dict) else None
        types = [
            found.type for struct in self.structs() for found in struct.fields if found.encode_name == name
        ]
        return _Place(value, _flat(types), f"{self.path}.{name}" if self.path else name)

    def _indexed(self, index: int) -> "_Place":
        value = self.value[index] if isinstance(self.value, list) and index < len(self.value) else None
        types = [item for type_ in self.types for item in _items(type_, index)]
        return _Place(value, _flat(types), f"{self.path}[{index}]")

    def _culprit(self) -> "_Place":
        """The first entry of a table of any names that does not convert; msgspec does not name it."""
        types = _flat([type_.value_type for type_ in self.types if isinstance(type_, inspect.DictType)])
        structs = [type_.cls for type_ in types if isinstance(type_, inspect.StructType)]
        for name, value in self.value.items() if isinstance(self.value, dict) else ():
            if not structs or not any(_converts(value, struct) for struct in structs):
                return _Place(value, types, f"{self.path}.{name}" if structs else f"{self.path}[...]")
        return _Place(None, types, f"{self.path}[...]")

    def structs(self) -> list[inspect.StructType]:
        """The kinds of table that may stand here; of several, the one that the value's tag chooses."""
        structs = [type_ for type_ in self.types if isinstance(type_, inspect.StructType)]
        tags = self.value if isinstance(self.value, dict) else {}
        chosen = [
            struct
            for struct in structs
            if struct.tag is not None and tags.get(struct.tag_field) == struct.tag
        ]
        return chosen or structs

    def choices(self) -> list[str]:
        """The words of which one must stand here."""
        return [
            str(word)
            for type_ in self.types
            if isinstance(type_, inspect.LiteralType)
            for word in type_.values
        ]


def explain(message: str, values: object, type_: type) -> Misfit:
    """msgspec's validation message as a key and a sentence for the one who wrote the file."""
    match = _MESSAGE.match(message)
    assert match is not None
    what, at = match["what"], match["at"] or "$"
    place = parent = _Place(values, _flat([inspect.type_info(type_)]), "")
    for step in _STEP.finditer(at):
        parent, place = place, place.step(step["name"], step["index"])
    if unknown := _UNKNOWN.match(what):
        key = f"{place.path}.{unknown[1]}" if place.path else unknown[1]
        return Misfit(key, _unknown_key(unknown[1], place))
    if missing := _MISSING.match(what):
        lacks = f"{place.path + ' lacks ' if place.path else 'missing '}the key {missing[1]!r}"
        return Misfit(place.path, lacks)
    return Misfit(place.path, _wrong_value(what, place, parent))


def _unknown_key(key: str, place: _Place) -> str:
    known = [field.encode_name for struct in place.structs() for field in struct.fields]
    nearest = difflib.get_close_matches(key, known, n=1)
    hint = f"did you mean {nearest[0]!r}?" if nearest else f"known keys: {', '.join(known)}"
    return f"unknown key {key!r}{f' in {place.path}' if place.path else ''}; {hint}"


def _wrong_value(what: str, place: _Place, parent: _Place) -> str:
    tags = [str(struct.tag) for struct in parent.structs() if place.path.endswith(f".{struct.tag_field}")]
    choices = place.choices() or tags
    expected = f"one of {', '.join(choices)}" if choices else _expected(what)
    shown = "" if isinstance(place.value, dict | list) else f" is {place.value!r}"
    if not expected:  # a sentence of the table's own check
        return f"{place.path}: {what}" if place.path else what
    return f"{f'{place.path}{shown}' if place.path else 'the file'}: expected {expected}"


def _expected(what: str) -> str:
    """``Expected `int`, got `str``` as "int"; empty if the message is of another kind."""
    match = re.match(r"Expected (?P<kind>.*?)(?:, got .*)?\Z", what)
    return (
        re.sub(r"`([\w |]+)`", lambda words: _in_plain_words(words[1]), match["kind"]).replace("`", "")
        if match
        else ""
    )


def _in_plain_words(types: str) -> str:
    return " or ".join(_PLAIN.get(word, word) for word in types.split(" | "))


def _flat(types: Iterable[inspect.Type]) -> tuple[inspect.Type, ...]:
    """Types with unions and annotations taken apart."""
    flat: list[inspect.Type] = []
    for type_ in types:
        if isinstance(type_, inspect.UnionType):
            flat.extend(_flat(type_.types))
        elif isinstance(type_, inspect.Metadata):
            flat.extend(_flat([type_.type]))
        else:
            flat.append(type_)
    return tuple(flat)


def _items(type_: inspect.Type, index: int) -> list[inspect.Type]:
    if isinstance(type_, inspect.TupleType):
        return list(type_.item_types[index : index + 1])
    if isinstance(type_, inspect.VarTupleType | inspect.ListType):
        return [type_.item_type]
    return []


def _converts(value: object, type_: type) -> bool:
    try:
        msgspec.convert(value, type_)
    except msgspec.ValidationError:
        return False
    return True
