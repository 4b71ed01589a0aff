"""What a planner puts into a computer's bundle besides its certificate: configuration and group keys, by name."""

from pathlib import Path

from bootprint.config import ComputerFile, load_realm, load_toml
from bootprint.errors import ConfigError
from bootprint.keys.secret_files import next_path, read_secret


def configuration_files(path: Path, soldier: str, realm: str) -> dict[str, bytes]:
    """``computer.toml`` and the realm beside it; ConfigError if they are another's, or look for files elsewhere."""
    file = load_toml(path, ComputerFile)
    if file.soldier != soldier:
        raise ConfigError(f"{path}: is {file.soldier}'s, not {soldier}'s")
    for key, stands, wanted in (("realm", file.realm, "realm.toml"), ("keys_dir", file.keys_dir, "keys")):
        if stands != wanted:
            raise ConfigError(
                f"{path}: {key} = {stands!r}; a bundle puts it where {key} = {wanted!r} finds it"
            )
    beside = path.parent / "realm.toml"
    found = load_realm(beside)
    found.member(soldier)
    if found.id != realm:
        raise ConfigError(f"{beside}: is realm {found.id!r}, the authority is of {realm!r}")
    return {"computer.toml": path.read_bytes(), "realm.toml": beside.read_bytes()}


def group_key_files(paths: list[Path]) -> dict[str, bytes]:
    """Group keys, each with the one that follows it, if there is one."""
    following = [next_path(path) for path in paths]
    there = [*paths, *(path for path in following if path.exists())]
    return {
        f"keys/{path.name}": read_secret(path, "group key", "`bootprint keys new` makes one")
        for path in there
    }
