"""The files that a model or configuration file names, and those they name.

They are found in the text, not by parsing: what determines a result must be
known before anything is built.
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
import re

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import resolve

_XML = re.compile(
    r"<uri>\s*([^<]+?)\s*</uri>|\b(?:filename|url)\s*=\s*[\"']([^\"']+)[\"']"
)
_YAML = re.compile(
    r"(?m)^\s*(?:-\s*)?file\s*:\s*[\"']?([^\s\"'#]+)|"
    r"(package://[^\s\"'#,\]}]+)"
)
_MATERIALS = re.compile(
    r"(?m)^\s*(?:mtllib|map_\w+|bump|disp|norm|refl)\s+(?:.*\s)?(\S+)\s*$"
)
_GLTF = re.compile(r"\"uri\"\s*:\s*\"((?!data:)[^\"]+)\"")

# How files of each suffix name others.
_PATTERNS = {
    ".sdf": _XML,
    ".urdf": _XML,
    ".xml": _XML,
    ".xacro": _XML,
    ".yaml": _YAML,
    ".yml": _YAML,
    ".obj": _MATERIALS,
    ".mtl": _MATERIALS,
    ".gltf": _GLTF,
}


def named_files(
    paths: Iterable[str | Path],
    read: Callable[[Path], bytes] = Path.read_bytes,
) -> Iterator[tuple[Path, bytes]]:
    """Files and their contents, then those that they name, each once.

    Names that lead nowhere are passed over: whoever parses the file says so.

    Args:
        paths: Files, or their package:// URIs.
        read: Function that reads a file.

    Raises:
        InputError: If one of `paths` is missing or cannot be read.
    """
    waiting = [resolve(path) for path in paths]
    seen: set[Path] = set()
    while waiting:
        path = waiting.pop(0)
        if path.resolve() in seen:
            continue
        seen.add(path.resolve())
        try:
            content = read(path)
        except OSError as error:
            raise InputError(f"cannot read {path}: {error.strerror}") from error
        yield path, content
        pattern = _PATTERNS.get(path.suffix.lower())
        if pattern is None:
            continue
        for match in pattern.finditer(content.decode("utf-8", "replace")):
            name = next(each for each in match.groups() if each)
            waiting.extend(_found(name, path.parent))


def _found(name: str, folder: Path) -> list[Path]:
    """The file that a text names, if there is one."""
    name = name.removeprefix("file://")
    try:
        if "://" in name:
            return [resolve(name)]
        path = folder / name
        return [path] if path.is_file() else []
    except (InputError, OSError, ValueError):
        return []
