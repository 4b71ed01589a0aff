"""The tables of keys in docs/scenarios.md, made from the schema itself.

``python -m proving_ground.scenario.keys_page docs/scenarios.md`` writes them anew between their two marks.
"""

import sys
from pathlib import Path
from typing import Any

import msgspec
from msgspec import inspect

from proving_ground.scenario.schema import faults, people, site, tasks, world
from proving_ground.scenario.schema.scenario import ScenarioFile

BEGIN, END = "<!-- keys: generated -->\n", "<!-- keys: end -->\n"
_TABLES: tuple[tuple[str, type], ...] = (
    ("The file", ScenarioFile),
    ("[site]", site.SiteTable),
    ("site.floors", site.Floor),
    ("site.buildings", site.Building),
    ("rooms of a building", site.Room),
    ("doors of a building", site.Door),
    ("stairs of a building", site.Stairs),
    ("lifts of a building", site.Lift),
    ("site.places", site.Place),
    ("site.obstacles", site.Obstacle),
    ("site.hills", site.Hill),
    ("units", people.Unit),
    ("posts", people.Post),
    ("kits", people.Kit),
    ("imus of a kit", people.Imu),
    ("teams", people.Team),
    ("formation of a team", people.Formation),
    ("weather", world.Weather),
    ("nets", world.Net),
    ("outages of a net", world.Span),
)
_TAGGED: tuple[tuple[str, str, str, type, tuple[Any, ...]], ...] = (
    ("Tasks", "do", "Every task has", tasks.TaskTable, tasks.Task.__args__),
    ("Zones", "kind", "Every zone has", world.ZoneTable, world.Zone.__args__),
    ("Magnetic bodies", "kind", "", msgspec.Struct, world.Magnetic.__args__),
    ("Faults", "kind", "Every fault has", faults.FaultTable, faults.Fault.__args__),
)


def tables() -> str:
    """All tables as Markdown."""
    parts = [f"### {title}\n\n{_purpose(type_)}\n\n{_table(type_)}" for title, type_ in _TABLES]
    parts += [_tagged(*row) for row in _TAGGED]
    return "\n".join(parts)


def page_with(text: str) -> str:
    """A page with the tables anew between its marks."""
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return f"{head}{BEGIN}\n{tables()}\n{END}{tail}"


def _tagged(title: str, tag: str, every: str, base: type, kinds: tuple[Any, ...]) -> str:
    """A group of tables told apart by a tag; keys of the base stand there once."""
    shared = {field.encode_name for field in _fields(base)} if every else set()
    lines = [f"### {title}\n"]
    if every:
        lines.append(f"{every}:\n\n{_table(base)}")
    for kind in kinds:
        own = [field for field in _fields(kind) if field.encode_name not in shared]
        name = kind.__struct_config__.tag
        lines.append(f'`{tag} = "{name}"`: {_purpose(kind)}\n')
        if own:
            lines.append(_rows(own))
    return "\n".join(lines)


def _purpose(type_: type) -> str:
    return " ".join((type_.__doc__ or "").split())


def _fields(type_: type) -> tuple[inspect.Field, ...]:
    info = inspect.type_info(type_)
    return info.fields if isinstance(info, inspect.StructType) else ()


def _table(type_: type) -> str:
    return _rows(list(_fields(type_)))


def _rows(fields: list[inspect.Field]) -> str:
    lines = ["| key | value | default | |", "|---|---|---|---|"]
    lines += [
        f"| `{field.encode_name}` | {_words(field.type)} | {_default(field)} | {_meaning(field.type)} |"
        for field in fields
    ]
    return "\n".join(lines) + "\n"


def _meaning(type_: inspect.Type) -> str:
    if isinstance(type_, inspect.Metadata):
        return str((type_.extra_json_schema or {}).get("description", "")) or _meaning(type_.type)
    return ""


def _default(field: inspect.Field) -> str:
    if field.default is msgspec.NODEFAULT and field.default_factory is msgspec.NODEFAULT:
        return "required"
    value = field.default
    if value is None or value in ((), "") or isinstance(value, msgspec.Struct):
        return "–"
    if isinstance(value, tuple) and value and isinstance(value[0], msgspec.Struct):
        return "one, see below"
    shown = list(value) if isinstance(value, tuple) else value
    return f"`{str(shown).lower() if isinstance(value, bool) else shown}`"


def _words(type_: inspect.Type) -> str:
    """A type as a person says it."""
    match type_:
        case inspect.Metadata():
            return _words(type_.type)
        case inspect.UnionType():
            kinds = [inner for inner in type_.types if not isinstance(inner, inspect.NoneType)]
            if all(isinstance(inner, inspect.StructType) for inner in kinds):
                return "table"
            return " or ".join(_words(inner) for inner in kinds)
        case inspect.LiteralType():
            return ", ".join(f"`{word}`" for word in type_.values)
        case inspect.TupleType():
            return f"[{', '.join(_words(item) for item in type_.item_types)}]"
        case inspect.VarTupleType():
            item = _words(type_.item_type)
            return f"list of {item}{'' if item.startswith(('[', '`')) else 's'}"
    plain = {
        inspect.StrType: "text",
        inspect.FloatType: "number",
        inspect.IntType: "whole number",
        inspect.BoolType: "true or false",
        inspect.DateTimeType: "date and time",
        inspect.StructType: "table",
    }
    return plain[type(type_)]


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(page_with(path.read_text(encoding="utf-8")), encoding="utf-8")
