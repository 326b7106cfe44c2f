"""Scenarios: what loads, and how what does not fit is told."""

import copy
import dataclasses
import pickle
import re
import shutil
import sys
import typing

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.skills import fit_scheme, make_skill
from drake_affetto.experiments.trials import draw_positions
from drake_affetto.motion import Dmp, DmpConfig
from drake_affetto.robot.simulated_robot import check_served
from drake_affetto.robot.wire import load_wire
from drake_affetto.station.scenario import (
    Scenario,
    load_scenario,
    scenario_names,
)


@pytest.mark.parametrize("name", scenario_names())
def test_every_scenario_loads(name):
    scenario = load_scenario(name)
    assert isinstance(scenario, Scenario)
    if scenario.wire:
        assert scenario.active_joints == load_wire(scenario.wire).names
        return
    assert len(scenario.active_joints) == 8
    assert scenario.active_joints[2] == scenario.yaw_joint == "waist_yaw"


def test_a_scenario_extends_another():
    direct, mirror = load_scenario("drumming"), load_scenario("mirror")
    assert direct.look.mode == "centre"
    assert mirror.look.mode == "fixed_yaw"
    assert mirror.drum_region == direct.drum_region
    assert mirror.dmp == direct.dmp


def test_a_file_of_ones_own_extends_by_name_and_by_path(tmp_path):
    first = tmp_path / "first.yaml"
    first.write_text("extends: mirror\nrandom_seed: 5\ndmp:\n  duration: 2.0\n")
    second = tmp_path / "second.yaml"
    second.write_text("extends: first.yaml\nrandom_seed: 6\n")
    scenario = load_scenario(second)
    assert scenario.random_seed == 6
    assert scenario.dmp.duration == 2.0
    assert scenario.look == load_scenario("mirror").look


def test_drakes_own_configs_are_read(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_text(
        "plant_config:\n  discrete_contact_approximation: similar\n"
        "simulator_config:\n  target_realtime_rate: 1.0\n"
    )
    scenario = load_scenario(path)
    assert scenario.plant_config.discrete_contact_approximation == "similar"
    assert scenario.simulator_config.target_realtime_rate == 1.0
    # What the file is silent on keeps the scenario's default, not Drake's.
    assert scenario.plant_config.contact_model == "point"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("gase:\n  gain: 1", "s has no field 'gase'; did you mean 'gaze'"),
        ("gaze:\n  gian: 1", "s.gaze has no field 'gian'; did you mean 'gain'"),
        ("gaze:\n  gain: fast", "s.gaze.gain is 'fast', expected a number"),
        ("gaze: 3", "s.gaze is 3, expected a mapping"),
        ("active_joints: waist_yaw", "s.active_joints is 'waist_yaw'"),
        ("dmp:\n  duration: -1", "s.dmp.duration is -1"),
        ("simulation_duration: 8.0", "s has no field 'simulation_duration'"),
        ("wire: none.yaml", "s.wire: no such file: "),
        ("random_seed: 1.5", "s.random_seed is 1.5, expected a whole number"),
        ("look:\n  mode: sideways", "s.look.mode is 'sideways'"),
        ("teaching:\n  lift: {mean: 9.0}", "s.teaching.lift.mean is 9.0"),
        ("a: [1, 2", "is not YAML"),
        ("- 1\n- 2", "holds no mapping"),
        ("extends: drumning", "s.extends: no scenario 'drumning'; did you"),
        ("extends: s.yaml", "extends itself"),
        ("extends: 4", "s.extends is 4"),
        ("mirrors: 7", "s.mirrors is 7, expected a list"),
        (
            "plant_config:\n  time_step: 0.5",
            "s.plant_config.time_step is 0.5",
        ),
        (
            "plant_config:\n  time_step: 0.002",
            "a divisor of the period of s.control.period, 0.005 s",
        ),
        ("camera:\n  rate: 0.0", "s.camera.rate is 0"),
        ("teaching:\n  update_rate: 0.0", "s.teaching.update_rate is 0"),
        ("camera:\n  rate: 30.0", "divisor of the period of s.camera.rate"),
        (
            "teaching:\n  update_rate: 300.0",
            "divisor of the period of s.teaching.update_rate",
        ),
        (
            "teaching:\n  recording_rate: 30.0",
            "divisor of the period of s.teaching.recording_rate",
        ),
        (
            "plant_config:\n  timestep: 0.5",
            "s.plant_config has no field 'timestep'",
        ),
        ("yaw_joint: left_elbow", "s.yaw_joint is 'left_elbow'"),
        (
            "world:\n  drum: package://drake_affetto/sdf/drumm.sdf",
            "no such file: package://drake_affetto/sdf/drumm.sdf",
        ),
        # YAML that two readers take differently.
        ("", "s.yaml is empty"),
        ("# nothing\n", "s.yaml is empty"),
        ("world: {}\ngaze: {}\nworld: {}", "world is given twice, in lines 1"),
        (
            "gaze:\n  gain: 1.0\n  gain: 2.0",
            "s.yaml: gaze.gain is given twice, in lines 2 and 3",
        ),
        ("random_seed: 010", "random_seed is 010 in line 1"),
        ("random_seed: 1:30", "random_seed is 1:30 in line 1"),
        ("random_seed: 1_0", "random_seed is 1_0 in line 1"),
        ("random_seed: '10'", "s.random_seed is '10', expected a whole"),
        ("variation:\n  enabled: yes", "is 'yes', expected true or false"),
        ("look:\n  mode: off", "s.look.mode is 'off', expected 'centre'"),
        ("gaze:\n  gain: .inf", "s.gaze.gain is inf, expected a finite"),
        ("gaze:\n  gain: 1e999", "s.gaze.gain is inf, expected a finite"),
        ("random_seed: .nan", "s.random_seed is nan, expected a whole"),
        ("a: " + "[" * 3000, "nested more than 40 deep"),
        ("a: " + "{a: " * 3000, "nested more than 40 deep"),
        # Regions and depths that cannot be.
        ("drum_region: {x: [.inf, 1]}", "s.drum_region.x[0] is inf"),
        ("drum_region: {x: [0.2, 30]}", "s.drum_region.x[1] is 30"),
        (
            "drum_region: {x: [0.2, 3]}",
            "s.drum_region is [3.0, -0.15], expected x from 0.129",
        ),
        (
            "drum_region: {polygon: [[0.2, -0.2], [0.3, -0.2], [0.2, 0.9]]}",
            "s.drum_region.polygon is [0.2, 0.9], expected x from 0.129",
        ),
        (
            "camera: {near: 1.0, far: 0.5}",
            "s.camera.near is 1.0, expected less than s.camera.far, 0.5",
        ),
        # What is not in the models.
        ("yaw_joint: right_elbow_flexion", "s.yaw_joint is 'right_elbow_fl"),
        ("yaw_joint: waist_pitch", "s.yaw_joint is 'waist_pitch'"),
        ("camera: {frame: nose}", "s: camera.frame is 'nose', expected one"),
        ("camera: {frame: 'a::b'}", "s: camera.frame is 'a::b', expected one"),
        ("mirrors: [{frame: pond}]", "s: mirrors[0].frame is 'pond'"),
        (
            "mirrors: [{frame: 'drum::marker'}]",
            "s: mirrors[0].width is not given",
        ),
        ("active_joints: [waist_yaw, knee]", "s.active_joints: model affetto"),
        ("joint_damping: {knee: 1.0}", "s: joint_damping: model affetto"),
        (
            "joint_damping: {neck_yaw: 1.0}",
            "s: joint_damping.neck_yaw is 1.0, expected the damping of an act",
        ),
        ("sound: nowhere.yaml", "s.sound: no such file: "),
        (
            "variation: {overlays: [nowhere.yaml]}",
            "s.variation: no such file: ",
        ),
        (
            "pneumatics: {overlays: [nowhere.yaml]}",
            "s.pneumatics.overlays[0]: no such file: ",
        ),
        (
            "control: {parameters: nowhere.yaml}",
            "s.control.parameters: no such file: ",
        ),
        ("extends: nowhere.yaml", "s.extends: no such scenario file"),
        ("sound: 5", "s.sound is 5, expected text"),
        ("active_joints: [1]", "s.active_joints[0] is 1, expected text"),
        ("joint_damping: {5: 1.0}", "s.joint_damping has the key 5"),
        (
            "world: {frames: {pond: {}}}",
            "s: world.frames: package://drake_affetto/scenes/drumming.dmd",
        ),
        (
            "world: {default_posture: {neck_yaw: 3.0}}",
            "s: world.default_posture.neck_yaw is 3.0",
        ),
        # What Drake would refuse in words of its own, or by ending.
        ("plant_config: {contact_model: jelly}", "plant_config.contact_model"),
        (
            "plant_config: {stiction_tolerance: 0}",
            "s.plant_config.stiction_tolerance is 0.0",
        ),
        (
            "simulator_config: {integration_scheme: guess}",
            "s.simulator_config.integration_scheme is 'guess'",
        ),
        ("simulator_config: {start_time: 5.0}", "simulator_config.start_time"),
        # What fails only after work otherwise.
        (
            "extends: mirror\nmirrors: []",
            "s.mirrors is [], expected one mirror for s.transfer.mapping",
        ),
        ("transfer: {mapping: optical}", "s.look.mode is 'centre', expected"),
        ("wire: nowhere.yaml", "s.wire: no such file: "),
        ("hardware: true", "s.wire: no such file"),
    ],
)
def test_what_does_not_fit_is_named_in_one_line(tmp_path, text, message):
    path = tmp_path / "s.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(message)) as raised:
        load_scenario(path)
    assert "\n" not in str(raised.value)


def test_an_unknown_name_offers_the_known_ones():
    with pytest.raises(InputError, match="did you mean 'mirror'"):
        load_scenario("miror")
    with pytest.raises(InputError, match=r"known are .*drumming"):
        load_scenario("../scenarios/drumming")
    with pytest.raises(InputError, match="no such scenario file"):
        load_scenario("nothing.yaml")


def test_a_missing_sound_file_is_named(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_text("sound: nowhere.yaml")
    with pytest.raises(InputError, match=r"nowhere\.yaml"):
        load_scenario(path)


# A file that each field can name, and how a scenario names it.
NAMED = {
    "world.directives": (
        "scenes/drumming.dmd.yaml",
        "world: {{directives: {}}}",
    ),
    "world.drum": ("sdf/drum.sdf", "world: {{drum: {}}}"),
    "sound": ("sound.yaml", "sound: {}"),
    "wire": ("robot_wire.yaml", "wire: {}"),
    "control.parameters": ("control.yaml", "control: {{parameters: {}}}"),
    "control.overlays": (
        "control_strokes.yaml",
        "control: {{overlays: [{}]}}",
    ),
    "pneumatics.parameters": (
        "pneumatics.yaml",
        "pneumatics: {{parameters: {}}}",
    ),
    "pneumatics.overlays": (
        "pneumatics_robot.yaml",
        "pneumatics: {{overlays: [{}]}}",
    ),
    "supervisor.parameters": (
        "supervisor.yaml",
        "supervisor: {{enabled: true, parameters: {}}}",
    ),
    "supervisor.overlays": (
        "supervisor.yaml",
        "supervisor: {{enabled: true, overlays: [{}]}}",
    ),
    "variation.parameters": ("variation.yaml", "variation: {{parameters: {}}}"),
    "variation.overlays": (
        "variation_robot.yaml",
        "variation: {{overlays: [{}]}}",
    ),
}


def file_fields(schema, where=""):
    """The fields that name files, by their place."""
    for field in dataclasses.fields(schema):
        place = f"{where}{field.name}"
        if field.metadata.get("file"):
            yield place
        elif dataclasses.is_dataclass(field.type):
            yield from file_fields(field.type, f"{place}.")


def test_all_fields_that_name_files_are_known_here():
    assert set(file_fields(Scenario)) == set(NAMED)


@pytest.mark.parametrize("place", NAMED)
def test_a_file_is_relative_to_the_file_that_names_it(
    tmp_path, monkeypatch, place
):
    """Not to where one stands, even if a file of that name is there."""
    source, text = NAMED[place]
    # Drake knows models by their suffixes.
    file = "a." + source.split("/")[-1].split(".", 1)[1]
    for folder in ("mine/parts", "other/parts", "mine/below"):
        (tmp_path / folder).mkdir(parents=True)
    mine = tmp_path / "mine/parts" / file
    shutil.copy(models_dir() / source, mine)
    (tmp_path / "other/parts" / file).write_text("no such thing: 1")
    (tmp_path / "mine/s.yaml").write_text(
        f"extends: drumming\n{text.format(f'parts/{file}')}\n"
    )
    (tmp_path / "mine/below/t.yaml").write_text("extends: ../s.yaml\n")
    monkeypatch.chdir(tmp_path / "other")
    for name in ("../mine/s.yaml", "../mine/below/t.yaml"):
        value = load_scenario(name)
        for part in place.split("."):
            value = getattr(value, part)
        (found,) = [value] if isinstance(value, str) else value
        assert found == str(mine)
    mine.unlink()
    with pytest.raises(InputError, match=r"no such file: .*mine/parts/a\."):
        load_scenario("../mine/s.yaml")


@pytest.mark.parametrize("name", ["drumming", "mirror", "robot"])
def test_a_scenario_is_copied_pickled_and_compared(name):
    scenario = load_scenario(name)
    assert copy.deepcopy(scenario) == scenario
    again = pickle.loads(pickle.dumps(scenario))
    assert again == scenario == load_scenario(name)
    assert type(again.plant_config) is type(scenario.plant_config)
    assert scenario != "drumming"
    for change in (
        lambda s: setattr(s.plant_config, "time_step", 0.001),
        lambda s: setattr(s.simulator_config, "target_realtime_rate", 0.5),
        lambda s: setattr(s.dmp, "n_basis", 7),
        lambda s: s.world.drum_position.reverse(),
    ):
        other = copy.deepcopy(scenario)
        change(other)
        assert other != scenario
        assert pickle.loads(pickle.dumps(other)) == other
    assert load_scenario("easy_drumming") != load_scenario("drumming")


def schemas(schema, found):
    """All dataclasses of a scenario."""
    if schema in found or not dataclasses.is_dataclass(schema):
        return
    found.add(schema)
    waiting = list(typing.get_type_hints(schema).values())
    while waiting:
        kind = waiting.pop()
        waiting += typing.get_args(kind)
        if isinstance(kind, type):
            schemas(kind, found)


@pytest.mark.slow
def test_every_field_is_read_by_what_it_configures(monkeypatch, tmp_path):
    """By more than its own check: a field without effect goes."""
    found = set()
    schemas(Scenario, found)
    read = set()
    passing = ("dataclasses.py", "fields.py", "fingerprint.py", "copy.py")

    def watch(schema):
        own = {field.name for field in dataclasses.fields(schema)}

        def get(self, name):
            caller = sys._getframe(1).f_code
            if (
                name in own
                and caller.co_name not in ("check", "_check_periods")
                and not caller.co_filename.endswith(passing)
            ):
                read.add(f"{schema.__name__}.{name}")
            return object.__getattribute__(self, name)

        monkeypatch.setattr(schema, "__getattribute__", get)

    for schema in found:
        watch(schema)
    fisheye = tmp_path / "fisheye.yaml"
    fisheye.write_text("extends: mirror\ncamera: {lens: {k1: 0.05}}\n")
    xy = np.array([0.235, -0.09])
    runner = TrialRunner(load_scenario("drumming"))
    runner.gaze(xy, 1)
    # Out of sight: it searches, and loses what it has seen.
    runner.gaze(np.array([0.36, 0.1]), 2)
    theta = runner.teach(xy, 1).theta
    runner.strike(xy, theta, 1)
    TrialRunner(load_scenario(fisheye)).gaze(xy, 1)
    faulted = tmp_path / "faulted.yaml"
    faulted.write_text(
        "extends: supervised\nfaults:\n- {kind: joint_offset, size: 0.1, "
        "joint: right_elbow_flexion, onset: 0.02}\n"
        "- {kind: pressure_stuck, channel: b, joint: right_elbow_flexion}\n"
    )
    TrialRunner(load_scenario(faulted)).gaze(xy, 1)
    easy = load_scenario("easy_drumming")
    draw_positions(easy, 2, np.random.default_rng(0))
    t = np.linspace(0.0, 3.0, 50)
    Dmp(DmpConfig(method="forcing")).encode(t, np.sin(t)[:, None])
    skill = make_skill(easy.skill, 0).fit(np.eye(2), np.eye(2))
    fit_scheme(
        "transfer_default", skill, np.eye(2), np.eye(2), "mirror", "drumming"
    )
    robot = load_scenario("robot")
    robot.hardware = True
    with pytest.raises(InputError, match="hardware is True"):
        check_served(robot, 200.0)
    robot.hardware = False
    check_served(robot, 200.0)
    every = {
        f"{schema.__name__}.{field.name}"
        for schema in found
        for field in dataclasses.fields(schema)
    }
    assert sorted(every - read) == []
