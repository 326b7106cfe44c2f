"""A robot's body that departs from the model."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.yaml_config import load_config
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.station.body import DEFAULT_FILE, Body, BodyRanges
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation

RANGES = load_config(BodyRanges, DEFAULT_FILE)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("mirror")


def _built(scenario, body):
    station = AffettoStation(dataclasses.replace(scenario, body=body))
    context = station.CreateDefaultContext()
    return station, context, station.plant.GetMyContextFromRoot(context)


@pytest.fixture(scope="module")
def model(scenario):
    return _built(scenario, Body())


def test_a_drawn_body_is_within_its_ranges(scenario):
    rng = np.random.default_rng(0)
    bodies = [RANGES.draw(scenario.active_joints, rng) for _ in range(200)]
    for body in bodies:
        body.check("body")
        assert set(body.mass) == set(scenario.active_joints)
    for name, low, high in (
        ("mass", 0.8, 1.2),
        ("friction", 0.5, 2.0),
        ("conductance", 0.8, 1.2),
        ("volume", 0.8, 1.2),
    ):
        values = np.array([[*getattr(b, name).values()] for b in bodies])
        assert low <= values.min() < low + 0.02 < high - 0.02 < values.max()
        assert values.max() <= high
    # Twice as much is as likely as half as much.
    friction = np.array([[*b.friction.values()] for b in bodies])
    assert abs(np.median(np.log(friction))) < 0.05
    assert bodies[0] != bodies[1]
    assert all(-0.01 <= b.drum_height <= 0.01 for b in bodies)


def test_each_number_reaches_its_place_in_the_station(scenario, model):
    body = RANGES.draw(scenario.active_joints, np.random.default_rng(3))
    station, context, plant_context = _built(scenario, body)
    exact, exact_context, exact_plant_context = model

    for joint, factor in body.mass.items():
        for link in station.plant.GetBodiesWeldedTo(
            station.plant.GetJointByName(joint).child_body()
        ):
            other = exact.plant.get_body(link.index())
            assert link.get_mass(plant_context) == pytest.approx(
                factor * other.get_mass(exact_plant_context)
            )

    def row(which, number):
        return which.actuation.parameters[number]

    joints = scenario.active_joints
    for name, number in (
        ("friction", Row.COULOMB),
        ("friction", Row.BREAKAWAY),
        ("conductance", Row.C_FILL),
        ("conductance", Row.C_EXHAUST),
        ("volume", Row.V_A),
    ):
        factors = [getattr(body, name)[joint] for joint in joints]
        np.testing.assert_allclose(
            row(station, number), factors * row(exact, number)
        )
    gauge = row(station, Row.SUPPLY) - row(station, Row.ATMOSPHERE)
    expected = row(exact, Row.SUPPLY) - row(exact, Row.ATMOSPHERE)
    np.testing.assert_allclose(gauge, body.supply * expected)

    raised = station.head_center_position(context)
    raised = raised - exact.head_center_position(exact_context)
    np.testing.assert_allclose(raised, [0, 0, body.drum_height], atol=1e-12)
    moved = station.mirrors[0][0].translation()
    moved = moved - exact.mirrors[0][0].translation()
    np.testing.assert_allclose(moved, body.mirror_translation, atol=1e-12)
    turn = station.mirrors[0][0].rotation()
    turn = turn @ exact.mirrors[0][0].rotation().inverse()
    assert 0 < turn.ToAngleAxis().angle() < np.deg2rad(5 * np.sqrt(3))
    seen = exact.camera_pose(exact_context).inverse()
    seen = seen @ station.camera_pose(context)
    assert np.linalg.norm(seen.translation()) == pytest.approx(
        np.linalg.norm(body.camera_translation), rel=1e-6
    )

    def stiffness(which):
        inspector = which.scene_graph.model_inspector()
        hand = which.plant.GetBodyByName("right_hand")
        return np.array(
            [
                inspector.GetProximityProperties(each).GetProperty(
                    "material", "point_contact_stiffness"
                )
                for each in which.plant.GetCollisionGeometriesForBody(hand)
            ]
        )

    np.testing.assert_allclose(
        stiffness(station), body.hand_stiffness * stiffness(exact)
    )


def test_a_context_that_is_reset_keeps_the_body(scenario):
    station, context, plant_context = _built(
        scenario, Body(mass={"waist_roll": 1.5})
    )
    before = station.plant.CalcTotalMass(plant_context)
    station.reset(context)
    assert station.plant.CalcTotalMass(plant_context) == before


def test_the_controller_knows_the_model_only(scenario, model):
    """Gravity is compensated as the model has it, and held as it is."""
    heavy = _built(scenario, Body(mass={"right_elbow_flexion": 2.0}))
    offsets = [
        station.GetSubsystemByName("gravity_feedforward")
        .GetOutputPort("equilibrium_offset")
        .Eval(
            station.GetSubsystemByName(
                "gravity_feedforward"
            ).GetMyContextFromRoot(context)
        )
        for station, context, _ in (model, heavy)
    ]
    np.testing.assert_array_equal(*offsets)
    pressures = [
        station.GetOutputPort("affetto.chamber_pressure").Eval(context)
        for station, context, _ in (model, heavy)
    ]
    assert not np.allclose(*pressures, rtol=1e-2)


def test_every_number_has_a_name(scenario):
    body = RANGES.draw(scenario.active_joints, np.random.default_rng(1))
    numbers = body.numbers()
    assert len(numbers) == 4 * 8 + 3 + 4 * 3
    assert numbers["mass.waist_roll"] == body.mass["waist_roll"]
    assert numbers["mirror_rotation.z"] == body.mirror_rotation[2]
    assert numbers["supply"] == body.supply


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (Body(supply=9.0), "supply is 9"),
        (Body(mass={"elbow": -1.0}), "mass.elbow is -1"),
        (Body(camera_rotation=[0.0]), "camera_rotation"),
        (Body(drum_height=float("nan")), "drum_height is nan"),
    ],
)
def test_a_body_that_cannot_be_is_named(body, message):
    with pytest.raises(InputError, match=message):
        body.check("body")
