"""What determines the trials of a scenario: the content of all that it names.

A scenario is known by content, not by name: its values, the files that it
names (parameters, sound, models) and those that these name (meshes). One
content is one scenario, wherever its files stand and however they are called;
and a process that lives on sees when a file has changed.
"""

from collections.abc import Mapping
import dataclasses
import hashlib
import os
from pathlib import Path
import time
from typing import Any

from drake_affetto import __version__
from drake_affetto.common.fingerprint import config_values, text_digest
from drake_affetto.common.named_files import named_files
from drake_affetto.common.nested import leaves, map_leaves
from drake_affetto.common.resources import is_file_name
from drake_affetto.station.scenario import (
    Scenario,
    find_scenario,
    read_scenario,
)

# What of a scenario says how a skill is learned, which no trial depends on: it
# is given the outcome.
_LEARNING = ("skill", "transfer")

# A file that has just changed may change again without its times showing it:
# file systems count in steps. Contents are remembered of older ones only, s.
_YOUNG = 2.0


@dataclasses.dataclass(frozen=True)
class Content:
    """What determines the trials of a scenario.

    Attributes:
        values: Digest of its values, without names of files.
        files: Digest of the files that it names, and of those these name.
        version: Version of this package.
    """

    values: str
    files: str
    version: str = __version__

    def changed(self, then: Mapping[str, Any]) -> list[str]:
        """What is other than in a mapping of these fields."""
        now = dataclasses.asdict(self)
        return [name for name in now if then.get(name) != now[name]]


# What was found, and the state of the files that it was found in.
_KNOWN: dict[Path, tuple[Content, list[tuple]]] = {}


def scenario_content(name: str | Path) -> Content:
    """The content of a scenario, by name or path.

    It is remembered until one of its files changes.

    Raises:
        InputError: If the scenario or a file that it names does not fit.
    """
    path = find_scenario(name).resolve()
    if path in _KNOWN:
        content, states = _KNOWN[path]
        if states == [_state(Path(state[0])) for state in states]:
            return content
        del _KNOWN[path]
    begin = time.time()
    scenario, read = read_scenario(path)
    content, named = content_of(scenario)
    states = [_state(each) for each in dict.fromkeys([*read, *named])]
    # Times in the future are no ages either.
    if all(
        state[1] is not None and 0 <= state[1] < begin - _YOUNG
        for state in states
    ):
        _KNOWN[path] = content, states
    return content


def scenario_source(name: str | Path) -> str:
    """What leads to a scenario from any folder: its name or absolute path.

    Raises:
        InputError: If there is no such scenario.
    """
    path = find_scenario(name)
    if str(name).endswith(path.suffix):
        return str(path.resolve())
    return str(name)


def content_of(scenario: Scenario) -> tuple[Content, list[Path]]:
    """The content of a loaded scenario, and all files that it names.

    Raises:
        InputError: If a file that it names is missing.
    """
    values = config_values(scenario)
    for field in _LEARNING:
        del values[field]
    # A scenario without them is what it was before there were any.
    if not scenario.faults:
        del values["faults"]
    if not scenario.supervisor.enabled:
        del values["supervisor"]
    names = [leaf for leaf in leaves(values) if is_file_name(leaf)]
    plain = map_leaves(
        values, lambda leaf: "file" if is_file_name(leaf) else leaf
    )
    digest = hashlib.sha256()
    files: list[Path] = []
    for name in names:
        # In the order of the fields: which file stands where counts.
        digest.update(b"field")
        for path, data in named_files([name]):
            digest.update(hashlib.sha256(data).digest())
            files.append(path)
    return (
        Content(text_digest(repr(plain)), digest.hexdigest()[:16]),
        files,
    )


def _state(path: Path) -> tuple[str, float | None, int, int]:
    """What of a file changes when its content does: path, times, size."""
    try:
        found = os.stat(path)
    except OSError:
        return str(path), None, 0, 0
    return (
        str(path),
        max(found.st_mtime, found.st_ctime),
        found.st_size,
        found.st_ino,
    )
