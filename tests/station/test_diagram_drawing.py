import re
import xml.etree.ElementTree as ET

from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Adder, ConstantVectorSource, Gain
import pygraphviz
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.station.diagram_drawing import (
    STAGE_COLORS,
    graphviz_source,
    write_diagram,
)


class Valve(LeafSystem):
    """Stands in for a stage's system: one port of each kind is not used."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("opening", 1)
        self.DeclareVectorInputPort("unused_input", 1)
        self.DeclareVectorOutputPort("flow", 1, lambda context, output: None)
        self.DeclareVectorOutputPort("spare", 1, lambda context, output: None)


Valve.__module__ = "drake_affetto.pneumatics.valve"


@pytest.fixture(scope="module")
def diagram():
    inner = DiagramBuilder()
    valve = inner.AddNamedSystem("valve<1>", Valve())
    inner.ExportInput(valve.get_input_port(0), "command")
    inner.ExportOutput(valve.get_output_port(0), "flow")
    builder = DiagramBuilder()
    unit = builder.AddNamedSystem("unit", inner.Build())
    adder = builder.AddNamedSystem("adder", Adder(2, 1))
    gain = builder.AddNamedSystem("gain", Gain(0.5, 1))
    bias = builder.AddNamedSystem("bias", ConstantVectorSource([1.0]))
    builder.Connect(unit.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), adder.get_input_port(0))
    builder.Connect(bias.get_output_port(), adder.get_input_port(1))
    builder.ExportInput(unit.get_input_port(), "affetto.command")
    builder.ExportOutput(adder.get_output_port(), "affetto.flow")
    diagram = builder.Build()
    diagram.set_name("station")
    return diagram


@pytest.mark.parametrize("depth", [0, 1, 2])
@pytest.mark.parametrize("all_ports", [False, True])
def test_every_connection_ends_at_a_port_that_is_drawn(
    diagram, depth, all_ports
):
    source = graphviz_source(diagram, max_depth=depth, all_ports=all_ports)
    graph = pygraphviz.AGraph(string=source)
    assert len(graph.edges()) == {0: 0, 1: 3, 2: 5}[depth]
    for edge in graph.edges():
        for node, end in zip(edge, ("tailport", "headport"), strict=True):
            port = edge.attr[end].split(":")[0]
            assert f'PORT="{port}"' in graph.get_node(node).attr["label"]


def test_ports_without_a_connection_are_left_out(diagram):
    few = graphviz_source(diagram, max_depth=2)
    everything = graphviz_source(diagram, max_depth=2, all_ports=True)
    for port in ("unused_input", "spare"):
        assert port not in few
        assert port in everything
    for port in ("opening", "flow", "command"):
        assert f">{port}<" in few


def test_own_ports_are_named_where_they_are(diagram):
    graph = pygraphviz.AGraph(string=graphviz_source(diagram, max_depth=1))
    labels = {
        re.search(r"name=(.*)", node.attr["label"])[1]: node.attr["label"]
        for node in graph.nodes()
    }
    assert set(labels) == {"unit", "adder", "gain", "bias"}
    for name, label in labels.items():
        assert ("affetto.command" in label) == (name == "unit")
        assert ("affetto.flow" in label) == (name == "adder")


def test_class_stands_without_its_module(diagram):
    source = graphviz_source(diagram, max_depth=2)
    assert "<B>Valve</B>" in source
    assert "drake_affetto.pneumatics" not in source


def test_stage_gives_the_color(diagram):
    colored = f'BGCOLOR="{STAGE_COLORS["pneumatics"]}"'
    assert graphviz_source(diagram, max_depth=1).count(colored) == 0
    opened = graphviz_source(diagram, max_depth=2)
    assert opened.count(colored) == 1
    assert opened.split(colored)[1].split("</TD>")[0].count("valve&lt;1&gt;")


@pytest.mark.parametrize("suffix", [".svg", ".png", ".pdf", ".dot", ".SVG"])
def test_suffix_chooses_the_form(diagram, tmp_path, suffix):
    path = tmp_path / f"station{suffix}"
    assert write_diagram(diagram, path, max_depth=1) == path
    data = path.read_bytes()
    if suffix.lower() == ".svg":
        text = "".join(ET.fromstring(data).itertext())
        for word in ("station", "adder", "affetto.flow"):
            assert word in text
    else:
        start = {".png": b"\x89PNG", ".pdf": b"%PDF", ".dot": b"digraph"}
        assert data.startswith(start[suffix])


def test_same_diagram_same_picture(diagram, tmp_path):
    for name in ("a.svg", "b.svg"):
        write_diagram(diagram, tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (
        tmp_path / "b.svg"
    ).read_bytes()


@pytest.mark.parametrize("name", ["station.jpeg2", "station", "svg"])
def test_other_suffixes_are_refused_before_anything_is_drawn(tmp_path, name):
    with pytest.raises(InputError, match=r"\.svg"):
        write_diagram(None, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_depth_below_zero_is_refused(diagram, tmp_path):
    with pytest.raises(InputError, match="max_depth is -1"):
        write_diagram(diagram, tmp_path / "x.svg", -1)
