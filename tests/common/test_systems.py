import gc
import inspect
import pydoc
import weakref

from pydrake.common.value import Value
from pydrake.systems.framework import (
    InputPort,
    LeafSystem,
    OutputPort,
    ValueProducer,
)
import pytest

from drake_affetto.common.systems import (
    input_port,
    make_room_for,
    output_port,
    weakly,
)


class Source(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("first", 1)
        self.DeclareVectorInputPort("second", 2)
        self.DeclareVectorOutputPort("sum", 3, lambda *_: None)

    get_either_input_port = input_port("The first (1), m.", index=0)
    get_second_input_port = input_port("The second (2), m.")
    get_sum_output_port = output_port("The sum (3), m.")


def test_getters_return_the_ports_of_their_names():
    dut = Source()
    assert dut.get_second_input_port() is dut.get_input_port(1)
    assert dut.get_sum_output_port() is dut.get_output_port(0)


def test_getter_with_an_index_returns_that_port_whatever_its_name():
    dut = Source()
    assert dut.get_either_input_port() is dut.get_input_port(0)


def test_getters_are_methods_with_signature_and_help():
    method = Source.get_second_input_port
    assert inspect.isfunction(method)
    assert inspect.signature(method).return_annotation is InputPort
    signature = inspect.signature(Source.get_sum_output_port)
    assert list(signature.parameters) == ["self"]
    assert signature.return_annotation is OutputPort
    assert method.__module__ == __name__
    assert method.__qualname__ == "Source.get_second_input_port"
    shown = pydoc.plain(pydoc.render_doc(Source))
    assert "get_second_input_port(self)" in shown
    assert "The second (2), m." in shown


def test_getter_refuses_a_name_that_tells_no_port():
    # Before Python 3.12 such an error comes as the cause of a RuntimeError.
    with pytest.raises((TypeError, RuntimeError)):

        class _(LeafSystem):
            get_blob = output_port("The marker (3).")


class Abstract(LeafSystem):
    """An output and a cache entry that call the system's own methods."""

    def __init__(self):
        super().__init__()
        entry = self.DeclareCacheEntry(
            "seven",
            ValueProducer(Value(0.0).Clone, weakly(self._calc_entry)),
            {self.nothing_ticket()},
        )
        self._entry = entry.cache_index()
        self.DeclareAbstractOutputPort(
            "seven", Value(0.0).Clone, weakly(self._calc)
        )

    def _calc_entry(self, context, output):
        output.set_value(7.0)

    def _calc(self, context, output):
        output.set_value(self.get_cache_entry(self._entry).Eval(context))


def test_a_system_that_gives_its_methods_weakly_works_and_goes():
    dut = Abstract()
    assert dut.get_output_port(0).Eval(dut.CreateDefaultContext()) == 7.0
    left = weakref.ref(dut)
    del dut
    gc.collect()
    assert left() is None


class Circle:
    """As a diagram and its systems: they know each other."""

    def __init__(self):
        make_room_for(self)
        self.myself = self


def test_diagrams_that_nobody_uses_go_before_another_is_built():
    gc.collect()
    gc.disable()
    try:
        built = [weakref.ref(Circle()) for _ in range(20)]
        assert sum(each() is not None for each in built) <= 5
        used = Circle()
        for _ in range(10):
            Circle()
        assert used.myself is used
    finally:
        gc.enable()
