"""Digests of what determines a result.

They are stored in the studies' files. For a stored study to continue, a digest
keeps its value: the text and the files that it is computed from stay.
"""

from collections.abc import Iterable
import dataclasses
import hashlib
from pathlib import Path
from typing import Any

from drake_affetto.common.nested import map_leaves


def text_digest(text: str, *, length: int | None = 16) -> str:
    """SHA-256 of a text in UTF-8, as hexadecimal digits.

    Args:
        text: The text.
        length: Number of digits; None for all 64.
    """
    return hashlib.sha256(text.encode()).hexdigest()[:length]


def files_digest(
    paths: Iterable[str | Path], *, text: str = "", length: int | None = 16
) -> str:
    """SHA-256 of names and contents of files, as hexadecimal digits.

    Args:
        paths: The files. Their folders do not count, their order does.
        text: Text that counts before them.
        length: Number of digits; None for all 64.
    """
    digest = hashlib.sha256(text.encode())
    for path in map(Path, paths):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:length]


def config_values(config: Any) -> Any:
    """The values of a configuration, as dicts and lists.

    Args:
        config: A nest of dataclasses, Drake's own structs, mappings and
            sequences.
    """

    def values_of(leaf: Any) -> Any:
        if dataclasses.is_dataclass(leaf) and not isinstance(leaf, type):
            fields: Any = dataclasses.fields(leaf)
        else:
            # Drake's structs have theirs under this name.
            fields = getattr(leaf, "__fields__", ())
        if not fields:
            return leaf
        return config_values({f.name: getattr(leaf, f.name) for f in fields})

    return map_leaves(config, values_of)
