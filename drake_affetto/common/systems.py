"""What systems of this package have in common: ports and their connections.

Importing it imports Drake, as `scalars` does and no other module of this room.
"""

from collections.abc import Callable
import gc
from typing import Any, cast
import weakref

from pydrake.systems.framework import (
    DiagramBuilder,
    InputPort,
    OutputPort,
    System,
)


def input_port(
    doc: str, *, index: int | None = None
) -> Callable[[Any], InputPort]:
    """A method that returns the input port for which it is named.

    `get_blob_input_port = input_port("The marker (3).")` in the class of a
    system makes the method `get_blob_input_port()`, as `def` would, which
    returns the input port "blob".

    Args:
        doc: Docstring of the method: what the port takes, shape and units.
        index: Index of the port, where it has another name than the method.

    Raises:
        TypeError: If the method is not called `get_..._input_port`.
    """

    def find(system: Any, port: str) -> InputPort:
        if index is not None:
            return system.get_input_port(index)
        return system.GetInputPort(port)

    return cast(Callable[[Any], InputPort], _Getter(find, InputPort, doc))


def output_port(doc: str) -> Callable[[Any], OutputPort]:
    """A method that returns the output port for which it is named.

    Args:
        doc: Docstring of the method: what the port gives, shape and units.

    Raises:
        TypeError: If the method is not called `get_..._output_port`.
    """

    def find(system: Any, port: str) -> OutputPort:
        return system.GetOutputPort(port)

    return cast(Callable[[Any], OutputPort], _Getter(find, OutputPort, doc))


def connect(
    builder: DiagramBuilder, source: System, target: System, *ports: str
) -> None:
    """Connects outputs of `source` to the inputs of `target` of their names.

    Args:
        builder: Builder that has both systems.
        source: System with the output ports.
        target: System with the input ports.
        ports: Names that both ports of a connection have.
    """
    for name in ports:
        builder.Connect(source.GetOutputPort(name), target.GetInputPort(name))


def export(builder: DiagramBuilder, part: str, *ports: OutputPort) -> None:
    """Exports outputs as `part.name`, under the names that they have.

    Args:
        builder: Builder that has their systems.
        part: Part of the robot or the scene to which they belong.
        ports: Outputs.
    """
    for port in ports:
        builder.ExportOutput(port, f"{part}.{port.get_name()}")


def weakly(method: Callable[..., Any]) -> Callable[..., Any]:
    """A system's own method, for Drake to call, that does not keep the system.

    What `DeclareAbstractOutputPort` and `DeclareCacheEntry` are given lives as
    long as the system, which a bound method keeps alive in its turn: neither
    ever goes, nor does the diagram around them. The other declarations take
    bound methods. For the same reason a system keeps the index of a cache
    entry, not the entry.

    Args:
        method: Bound method of the system.
    """
    found = weakref.WeakMethod(method)

    def call(*args: Any) -> Any:
        bound = found()
        assert bound is not None, "the system is gone"
        return bound(*args)

    return call


# Diagrams that somebody uses, or that wait to be collected.
_DIAGRAMS: weakref.WeakSet[Any] = weakref.WeakSet()

# So many of them may wait: a collection takes a tenth of a second.
_MOST_WAITING = 4


def make_room_for(diagram: Any) -> None:
    """Frees the diagrams that nobody uses, before another one is built.

    A diagram and its systems refer to each other in a circle. Python collects
    circles by their number, and sees nothing of the tens of MiB that Drake
    keeps behind each: a process that builds one after the other grows.

    Args:
        diagram: Diagram that is about to be built.
    """
    if len(_DIAGRAMS) >= _MOST_WAITING:
        gc.collect()
    _DIAGRAMS.add(diagram)


class _Getter:
    """Stands for a method until its class gives it a name."""

    def __init__(
        self, find: Callable[[Any, str], Any], kind: type, doc: str
    ) -> None:
        self._find, self._kind, self._doc = find, kind, doc

    def __set_name__(self, owner: type, name: str) -> None:
        """Puts a plain function in its own place, as `def` would have."""
        find = self._find
        ending = "_input_port" if self._kind is InputPort else "_output_port"
        port = name.removeprefix("get_").removesuffix(ending)
        if name != f"get_{port}{ending}":
            raise TypeError(f"{name} should be get_<port>{ending}")

        def get(self):
            return find(self, port)

        get.__name__, get.__doc__ = name, self._doc
        get.__annotations__["return"] = self._kind
        get.__module__ = owner.__module__
        get.__qualname__ = f"{owner.__qualname__}.{name}"
        setattr(owner, name, get)
