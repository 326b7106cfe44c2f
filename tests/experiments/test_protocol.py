"""What the experiments promise, in their own terms.

Train and test are apart, all schemes get the same samples, each repeat has a
skill of its own, and what a scenario says of the chain is in effect. Each test
here fails for a fault that would make results better, or worse, than they are.
"""

import dataclasses

import numpy as np
import pytest

from drake_affetto.experiments import drumming, mirror
from drake_affetto.experiments.drumming import run_drum
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.plans import DrumPlan, MirrorPlan
from drake_affetto.experiments.skills import fit_scheme
from drake_affetto.experiments.trials import draw_positions
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.scene import world
from drake_affetto.sound.config import load_sound_config
from drake_affetto.station.scenario import load_scenario
from support import fake_world

XY = np.array([0.235, -0.09])
DRUM = DrumPlan(demonstrations=6, evaluations=4, repeats=2)
MIRROR = MirrorPlan(
    samples=(2, 3), demonstrations=6, evaluations=4, repeats=2, pool=5
)


def specs_of(path, study, plan):
    """The specs that a study asks for."""
    asked = []

    def run(spec):
        asked.append(spec)
        return fake_world.run(spec)

    with (
        TrialStore(path) as store,
        TrialExecutor(run, store, workers=0, quiet=True) as executor,
    ):
        study(executor, plan)
    return asked


@pytest.fixture(
    scope="module", params=[(run_drum, DRUM), (mirror.run_mirror, MIRROR)]
)
def asked(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("protocol") / "trials.sqlite"
    return specs_of(path, *request.param)


def of_kind(asked, kind):
    return [spec for spec in asked if spec["kind"] == kind]


def test_unseen_places_are_not_the_taught_ones(asked):
    taught = np.array([s["xy"] for s in of_kind(asked, "demonstration")])
    tested = np.array([s["xy"] for s in of_kind(asked, "strike")])
    apart = np.linalg.norm(taught[:, None] - tested, axis=-1)
    assert apart.min() > 1e-4


def test_trials_that_teach_and_trials_that_test_share_no_noise(asked):
    seeds = [
        {spec["seed"] for spec in of_kind(asked, kind)}
        for kind in ("demonstration", "strike")
    ]
    assert not seeds[0] & seeds[1]


def test_places_fill_the_region_to_its_border():
    """Places that are drawn 10 % further in would not come near corners."""
    scenario = load_scenario("drumming")
    places = draw_positions(scenario, 512, np.random.default_rng(0))
    corners = scenario.drum_region.corners
    gap = np.linalg.norm(corners[:, None] - places, axis=-1).min(axis=1)
    assert gap.max() < 0.012
    middle = scenario.drum_region.middle
    inner = middle + 0.9 * (corners - middle)
    region = dataclasses.replace(scenario.drum_region, polygon=inner.tolist())
    outside = ~region.contains(places)
    assert 0.14 < outside.mean() < 0.24  # 1 - 0.9² of the area


def test_all_schemes_get_the_same_samples_and_each_repeat_its_own(
    tmp_path, monkeypatch
):
    given = []

    def spy(name, skill, tau, theta, *rest):
        given.append((name, skill, np.array(tau), np.array(theta), rest))
        return fit_scheme(name, skill, tau, theta, *rest)

    monkeypatch.setattr(mirror, "fit_scheme", spy)
    specs_of(tmp_path / "t.sqlite", mirror.run_mirror, MIRROR)
    by_repeat = {}
    for name, skill, tau, theta, rest in given:
        by_repeat.setdefault(id(skill), []).append((name, tau, theta, rest))
    assert len(by_repeat) == MIRROR.repeats
    for calls in by_repeat.values():
        for count in MIRROR.samples:
            same = [call for call in calls if len(call[1]) == count]
            assert [call[0] for call in same] == list(MIRROR.schemes)
            for _, tau, theta, rest in same[1:]:
                np.testing.assert_array_equal(tau, same[0][1])
                np.testing.assert_array_equal(theta, same[0][2])
                assert rest == same[0][3]
    first, second = (calls[0][2] for calls in by_repeat.values())
    assert not np.isin(first, second).any()


def test_each_repeat_of_the_drum_study_learns_its_own_demonstrations(
    tmp_path, monkeypatch
):
    learned = []
    original = drumming.skills_by_count

    def spy(config, demonstrations, seed):
        learned.append(({tuple(d.xy) for d in demonstrations}, seed))
        return original(config, demonstrations, seed)

    monkeypatch.setattr(drumming, "skills_by_count", spy)
    specs_of(tmp_path / "t.sqlite", run_drum, DRUM)
    (one, seed), (other, other_seed) = learned
    assert not one & other
    assert seed != other_seed


def test_relearning_scales_inputs_by_the_range_of_the_new_view():
    scenario = load_scenario("mirror")
    direct = load_scenario("drumming")
    assert scenario.skill.input_range != direct.skill.input_range
    from drake_affetto.experiments.skills import make_skill

    rng = np.random.default_rng(0)
    tau, theta = rng.uniform(size=(6, 2)), rng.normal(size=(6, 4))
    skill = make_skill(direct.skill, 0).fit(tau, theta)
    scheme = fit_scheme("relearn", skill, tau, theta, "mirror", "drumming")
    assert scheme.input_range == scenario.skill.input_range
    assert skill.input_range == direct.skill.input_range


def test_a_hit_is_an_impulse_that_a_touch_has_not():
    """A palm of 0.3 kg that comes down at 0.1 m/s has 30 mN s."""
    impulse = load_sound_config(load_scenario("drumming").sound).hit_impulse
    assert 1e-3 <= impulse <= 0.03


@pytest.fixture(scope="module")
def runner():
    return TrialRunner(load_scenario("drumming"))


def test_the_head_that_is_struck_is_the_one_that_sounds(runner):
    plant = runner.station.plant
    radius = world.head_radius(plant, runner._sub(plant))
    assert radius == pytest.approx(0.0369, abs=5e-4)
    sound = load_sound_config(runner.scenario.sound)
    # The hoop covers the membrane's border.
    assert radius < sound.voice.membrane.radius < 1.1 * radius


def test_the_chain_has_the_latencies_that_its_models_say(runner):
    station = runner.station
    dead = station.actuation.parameters[Row.DEAD_TIME]
    assert np.all(dead >= 0.01)
    assert station.gaze._latency == runner.scenario.camera.latency > 0.0


def test_the_camera_is_noisy_and_the_noise_is_that_of_the_seed(runner):
    assert runner.scenario.camera.effects.noise > 0.0
    found = [runner.gaze(XY, seed).task_parameter.copy() for seed in (1, 2, 1)]
    assert not np.array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_a_guided_arm_is_held_by_what_held_it_at_rest(runner):
    """Eq. 8: without its u_eq it would fall; with an integral, resist."""
    begin = runner._soften(XY, 3)
    station = runner.station
    gains = station.controller.get_gains(runner._sub(station.controller))
    assert np.all(gains.kI == 0.0)
    start = runner.port("affetto.joint_state")[: station.num_joints].copy()
    runner.advance(begin + 1.0)
    held = runner.port("affetto.joint_state")[: station.num_joints]
    assert np.abs(held - start).max() < np.deg2rad(3.0)
    begin = runner._soften(XY, 3)
    station.set_equilibrium_offset(runner.context, np.zeros(station.num_joints))
    runner.advance(begin + 1.0)
    fallen = runner.port("affetto.joint_state")[: station.num_joints]
    assert np.abs(fallen - start).max() > np.deg2rad(6.0)
