"""Nests of mappings and sequences, such as configurations and results."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any


def map_leaves(value: Any, change: Callable[[Any], Any]) -> Any:
    """Copies a nest with each leaf changed.

    Args:
        value: A nest of mappings, lists and tuples.
        change: Function of a leaf: of anything else.

    Returns:
        A nest of dicts, whose keys are texts, and lists.
    """
    if isinstance(value, Mapping):
        return {str(k): map_leaves(v, change) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [map_leaves(v, change) for v in value]
    return change(value)


def leaves(value: Any) -> Iterator[Any]:
    """All leaves of a nest, in their order."""
    if isinstance(value, Mapping):
        for each in value.values():
            yield from leaves(each)
    elif isinstance(value, (list, tuple)):
        for each in value:
            yield from leaves(each)
    else:
        yield value
