"""The station: wiring, placing, locking, and physics of the whole."""

import gc
import weakref

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import pytest

from drake_affetto.common import systems
from drake_affetto.common.errors import InputError
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.parameters import chamber_volumes
from drake_affetto.scene import world
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation


@pytest.fixture(scope="module")
def station():
    """The robot as its model is, without the variation of trials."""
    scenario = load_scenario("drumming")
    scenario.variation.enabled = False
    return AffettoStation(scenario)


def port(station, context, name):
    return station.GetOutputPort(name).Eval(context)


def test_the_contract_ports_are_there(station):
    context = station.CreateDefaultContext()
    n = station.num_joints
    assert n == 8
    sizes = {
        "affetto.estimated_state": 2 * n,
        "affetto.desired_state": 2 * n,
        "affetto.valve_opening": n,
        "affetto.actuation": n,
        "affetto.chamber_pressure": 2 * n,
        "affetto.mass_flow": 2 * n,
        "affetto.policy_parameters": 15 * n,
        "affetto.task_parameter": 2,
        "drum.contact_force": 2,
        "drum.knock_force": 2,
        "teacher.pulling_force": 3,
    }
    for name, size in sizes.items():
        assert port(station, context, name).shape == (size,), name
    color = port(station, context, "camera.color_image")
    label = port(station, context, "camera.label_image")
    assert color.data.shape[:2] == label.data.shape[:2] == (240, 320)


def test_documented_ports_are_the_declared_ones(station):
    documented = {
        line.strip(" -")
        for line in AffettoStation.__doc__.split("With n active")[0]
        .split("output_ports:")[1]
        .splitlines()
        if line.strip().startswith("- ")
    }
    declared = {
        station.get_output_port(i).get_name()
        for i in range(station.num_output_ports())
    }
    assert documented == declared


def test_the_robot_starts_where_the_scene_says_inactive_joints_welded(station):
    context = station.CreateDefaultContext()
    state = port(station, context, "affetto.estimated_state")
    np.testing.assert_array_equal(state[:8], station.start_posture)
    np.testing.assert_array_equal(
        port(station, context, "affetto.desired_state")[:8],
        station.start_posture,
    )
    assert set(world.joint_names(station.plant)) == set(station.joints.names)
    assert station.plant.num_positions() == 8


def test_the_drum_stands_where_it_is_put(station):
    context = station.CreateDefaultContext()
    for xy in ([0.2, -0.1], [0.27, -0.03]):
        station.set_drum_position(context, xy)
        np.testing.assert_allclose(station.drum_position(context), xy)
        marker = station.marker_position(context)
        np.testing.assert_allclose(marker[:2], xy, atol=1e-12)
    with pytest.raises(InputError, match="drum position"):
        station.set_drum_position(context, [5.0, 0.0])
    with pytest.raises(InputError, match="drum position"):
        station.set_drum_position(context, [np.nan, 0.0])


def test_the_image_is_of_now_not_of_an_earlier_time(station):
    context = station.CreateDefaultContext()
    station.set_drum_position(context, [0.235, -0.09])
    first = port(station, context, "camera.color_image").data.copy()
    blob = port(station, context, "camera.blob")
    assert blob[2] == 1.0
    station.set_drum_position(context, [0.26, -0.06])
    second = port(station, context, "camera.color_image").data
    assert np.any(first != second)
    assert np.linalg.norm(port(station, context, "camera.blob") - blob) > 0.05


def test_it_works_within_a_larger_diagram():
    builder = DiagramBuilder()
    inner = builder.AddSystem(AffettoStation(load_scenario("drumming")))
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    mine = inner.GetMyMutableContextFromRoot(root)
    inner.reset(mine)
    for context in (mine, root):
        inner.set_drum_position(context, [0.21, -0.12])
        np.testing.assert_allclose(inner.drum_position(root), [0.21, -0.12])


def test_it_holds_the_arm_against_gravity_and_comes_to_rest(station):
    context = station.CreateDefaultContext()
    simulator = Simulator(station, context)
    simulator.AdvanceTo(2.0)
    angles = []
    for k in range(50):
        simulator.AdvanceTo(2.0 + 0.01 * (k + 1))
        angles.append(port(station, context, "affetto.estimated_state")[:8])
    error = np.degrees(np.mean(angles, axis=0) - station.start_posture)
    assert np.abs(error).max() < 1.0
    assert np.degrees(np.std(angles, axis=0)).max() < 0.15
    # Within what the supply can give and the atmosphere leaves.
    pressure = port(station, context, "affetto.chamber_pressure")
    assert np.all(pressure > 101e3)
    assert np.all(pressure < 660e3)


def test_a_reset_context_starts_the_same_simulation_again(station):
    context = station.CreateDefaultContext()
    simulator = Simulator(station, context)
    runs = []
    for _ in range(2):
        station.reset(context)
        context.SetTime(0.0)
        simulator.Initialize()
        simulator.AdvanceTo(0.2)
        runs.append(port(station, context, "affetto.estimated_state"))
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.any(runs[0][8:] != 0.0)


def test_the_mirror_scenario_sees_the_drum_only_in_the_mirror():
    scenario = load_scenario("mirror")
    station = AffettoStation(scenario)
    context = station.CreateDefaultContext()
    q = station.start_posture.copy()
    q[2] = scenario.look.fixed_yaw
    station.set_posture(context, q)
    (X_WM, width, height), *_ = station.mirrors
    assert width > 0.05
    assert height > 0.05
    normal = X_WM.rotation().matrix()[:, 2]
    assert normal[2] < 0  # it leans forward, or the head's top is not seen
    # Where the true view shows the drum, if at all, there is no marker of it.
    blob = port(station, context, "camera.blob_pixels")
    assert blob[2] > 100.0
    label = port(station, context, "camera.label_image").data[:, :, 0]
    u, v = round(blob[0]), round(blob[1])
    panel = station.plant.GetBodyByName("panel").index()
    assert label[v, u] == int(panel)


@pytest.mark.parametrize(
    ("motion", "valves", "inputs"),
    [
        ("external", "pidf", {"affetto.desired_state"}),
        ("skill", "external", {"affetto.valve_opening"}),
        (
            "external",
            "external",
            {"affetto.desired_state", "affetto.valve_opening"},
        ),
    ],
)
def test_ones_own_policy_or_controller_goes_in_from_outside(
    motion, valves, inputs
):
    scenario = load_scenario("drumming")
    scenario.motion_source, scenario.valve_source = motion, valves
    station = AffettoStation(scenario)
    assert inputs == {
        station.get_input_port(i).get_name()
        for i in range(station.num_input_ports())
    }
    context = station.CreateDefaultContext()
    for name in inputs:
        size = station.GetInputPort(name).size()
        value = np.zeros(size)
        if size == 16:
            value[:8] = station.start_posture
        station.GetInputPort(name).FixValue(context, value)
    simulator = Simulator(station, context)
    simulator.AdvanceTo(0.02)
    assert np.all(np.isfinite(port(station, context, "affetto.actuation")))


def test_shut_valves_hold_the_air_by_the_polytropic_law():
    """p Vⁿ stays in every chamber as unequal pressures move the arm."""
    scenario = load_scenario("drumming")
    scenario.motion_source = scenario.valve_source = "external"
    scenario.variation.enabled = False
    station = AffettoStation(scenario)
    context = station.CreateDefaultContext()
    own = station.GetMutableSubsystemContext(station.actuation, context)
    parameters = station.actuation.get_parameters(own)
    for row in (Row.UNDERLAP, Row.C_LEAK):
        parameters[row] = 0.0
    station.actuation.set_parameters(own, parameters)
    station.actuation.set_pressures(own, 520e3, 400e3)
    for name, value in (
        ("affetto.valve_opening", np.zeros(8)),
        ("affetto.desired_state", np.zeros(16)),
    ):
        station.GetInputPort(name).FixValue(context, value)

    def air():
        q = port(station, context, "affetto.estimated_state")[:8]
        p = port(station, context, "affetto.chamber_pressure")
        V = np.concatenate(chamber_volumes(parameters, q))
        return p, V, q

    simulator = Simulator(station, context)
    # The chambers take their volumes at the first update.
    simulator.AdvanceTo(0.001)
    p0, V0, q0 = air()
    simulator.AdvanceTo(3.0)
    p1, V1, q1 = air()
    assert np.abs(q1 - q0).max() > 0.05
    exponent = 1.2
    np.testing.assert_allclose(p1 * V1**exponent, p0 * V0**exponent, rtol=1e-4)


def test_who_teaches_by_mouse_needs_a_browser_to_do_it_in():
    with pytest.raises(InputError, match="by_mouse"):
        AffettoStation(load_scenario("drumming"), by_mouse=True)


@pytest.fixture(scope="module")
def varying():
    return AffettoStation(load_scenario("drumming"))


def settled(station, seed, duration=0.5):
    """A robot that holds its posture, and its context after `duration`."""
    context = station.CreateDefaultContext()
    station.set_seed(context, seed)
    Simulator(station, context).AdvanceTo(duration)
    return context


def test_without_variation_the_software_knows_the_joints(station):
    context = settled(station, 1)
    np.testing.assert_array_equal(
        port(station, context, "affetto.estimated_state"),
        port(station, context, "affetto.joint_state"),
    )
    np.testing.assert_array_equal(
        port(station, context, "affetto.joint_state"),
        port(station, settled(station, 2), "affetto.joint_state"),
    )


def test_sensors_of_a_varying_robot_are_seeded_by_the_trial(varying):
    context = varying.CreateDefaultContext()
    start = port(varying, context, "affetto.estimated_state")
    np.testing.assert_array_equal(start[:8], varying.start_posture)
    runs = [settled(varying, seed) for seed in (1, 1, 2)]
    for name in ("affetto.estimated_state", "affetto.chamber_pressure"):
        one, again, other = (port(varying, run, name) for run in runs)
        np.testing.assert_array_equal(one, again)
        assert np.abs(one - other).max() > 0.0
    lower, upper = world.joint_limits(varying.plant, varying.joints.names)
    error = (
        port(varying, runs[0], "affetto.estimated_state")
        - port(varying, runs[0], "affetto.joint_state")
    )[:8] / (upper - lower)
    assert 1e-5 < np.abs(error).max() < 0.01


def test_the_seed_of_a_scenario_is_that_of_its_noise():
    station = AffettoStation(load_scenario("drumming"))
    seen = []
    for seed in (0, 1, 0):
        station.scenario.random_seed = seed
        context = station.CreateDefaultContext()
        seen.append(port(station, context, "camera.color_image").data.copy())
    first, other, again = seen
    np.testing.assert_array_equal(first, again)
    assert np.mean(first != other) > 0.1


@pytest.mark.parametrize("name", ["drumming", "mirror", "robot", "analytic"])
def test_a_station_goes_with_its_last_reference(name):
    """All of it: a study of many scenarios would fill the memory."""
    scenario = load_scenario("mirror" if name == "analytic" else name)
    if name == "analytic":
        scenario.camera.renderer = "analytic"
    station = AffettoStation(scenario)
    context = station.CreateDefaultContext()
    port(station, context, "camera.blob_pixels")
    # Before others are built they are looked for.
    assert station in systems._DIAGRAMS
    parts = [station, *station.GetSystems()]
    left = {part.get_name(): weakref.ref(part) for part in parts}
    del station, context, parts
    gc.collect()
    assert [name for name, part in left.items() if part() is not None] == []
