"""A belief that grows by drumming and listening."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.calibration.belief import PlaneBelief
from drake_affetto.calibration.plane import PlaneEstimate
from drake_affetto.geometry.region import inside_polygon, spread_inside
from support import mirror_robot
from support.mirror_robot import MIRROR, WORKSPACE, tau_of

TRUE = mirror_robot.robot()
SETTINGS = mirror_robot.settings()
EAR = dataclasses.replace(SETTINGS.ear, particles=1500)


def from_prior(seed=0, ear=EAR):
    rng = np.random.default_rng(seed)
    return PlaneBelief.from_prior(TRUE, SETTINGS.prior, WORKSPACE, ear, rng)


def around(plane, sd=1e-3):
    covariance = np.diag([sd, sd, sd]) ** 2
    estimate = PlaneEstimate(np.asarray(plane), covariance, TRUE.eye_position)
    rng = np.random.default_rng(0)
    return PlaneBelief.from_estimate(TRUE, estimate, WORKSPACE, EAR, rng)


def drum(belief, count, seed, mirror=MIRROR, explore=None):
    """Strokes that are heard within 5 cm; nine of ten, as on the robot."""
    rng = np.random.default_rng(seed)
    heard = []
    for xy in spread_inside(WORKSPACE, count, rng):
        tau = tau_of(TRUE, mirror, xy)
        belief.see(tau)
        stroke = belief.choose(tau, explore)
        off = stroke.place + 0.01 * rng.normal(size=2) - xy
        hit = bool(np.linalg.norm(off) < 0.05 and rng.random() < 0.92)
        belief.hear(tau, stroke, hit)
        heard.append(hit)
    return heard


def test_a_plane_says_where_a_drum_is():
    belief = around(MIRROR, 1e-6)
    for xy in spread_inside(WORKSPACE, 5, np.random.default_rng(1)):
        places = belief.places(tau_of(TRUE, MIRROR, xy))
        np.testing.assert_allclose(places.mean(axis=0), xy, atol=1e-3)


def test_who_knows_the_mirror_aims_at_the_drum():
    belief = around(MIRROR)
    for xy in spread_inside(WORKSPACE, 5, np.random.default_rng(1)):
        stroke = belief.choose(tau_of(TRUE, MIRROR, xy), 0.0)
        assert np.linalg.norm(stroke.place - xy) < 0.03
        assert stroke.chance > 0.85
        optical = TRUE.optical_map().source
        expected = optical.direct_task_parameters(
            stroke.place[None], TRUE.source_calibration
        )
        np.testing.assert_allclose(stroke.tau, expected[0])


def test_drums_that_cannot_be_there_are_told():
    belief = around(MIRROR)
    good = tau_of(TRUE, MIRROR, np.array([0.25, -0.1]))
    assert belief.plausible(good) == pytest.approx(1.0)
    # The mirror has been turned since.
    other = tau_of(TRUE, MIRROR + [0.35, 0.0, 0.0], np.array([0.25, 0.0]))
    assert belief.plausible(other) < 0.05


def test_strokes_are_aimed_within_the_workspace():
    belief = from_prior()
    for xy in spread_inside(WORKSPACE, 5, np.random.default_rng(2)):
        stroke = belief.choose(tau_of(TRUE, MIRROR, xy))
        assert np.isfinite(stroke.tau).all()
        assert 0.0 < stroke.chance < 1.0
        low, high = WORKSPACE.min(axis=0), WORKSPACE.max(axis=0)
        margin = EAR.beyond + 1e-9
        assert np.all(stroke.place >= low - margin)
        assert np.all(stroke.place <= high + margin)


def test_seeing_drums_alone_tells_something():
    """They stand where the robot can reach them."""
    belief = from_prior()
    before = belief.estimate
    for xy in spread_inside(WORKSPACE, 8, np.random.default_rng(3)):
        belief.see(tau_of(TRUE, MIRROR, xy))
    after = belief.estimate
    assert np.linalg.det(after.covariance) < 0.1 * np.linalg.det(
        before.covariance
    )
    assert after.distance2(MIRROR) < 20.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_from_somewhere_on_the_left_it_learns_to_hit(seed):
    belief = from_prior(seed)
    heard = drum(belief, 24, seed)
    assert np.mean(heard[12:]) >= 0.7
    assert belief.estimate.angle_sd < 0.5 * from_prior(seed).estimate.angle_sd


def test_what_is_heard_moves_the_belief():
    belief = from_prior()
    xy = np.array([0.25, -0.1])
    tau = tau_of(TRUE, MIRROR, xy)
    stroke = belief.choose(tau, 0.0)

    def chance(other):
        return other.choose(tau, 0.0).chance

    hit, miss = from_prior(), from_prior()
    hit.hear(tau, stroke, True)
    miss.hear(tau, stroke, False)
    assert chance(hit) > 3.0 * chance(belief)
    aim = miss.choose(tau, 0.0).place
    assert np.linalg.norm(aim - stroke.place) > 0.03


def test_curiosity_gives_away_some_hits():
    belief = from_prior()
    drum(belief, 4, 0)
    chances = []
    for xy in spread_inside(WORKSPACE, 6, np.random.default_rng(5)):
        tau = tau_of(TRUE, MIRROR, xy)
        greedy, curious = belief.choose(tau, 0.0), belief.choose(tau, 50.0)
        assert curious.chance <= greedy.chance
        chances.append([greedy.chance, curious.chance])
    assert np.subtract(*np.mean(chances, axis=0)) > 0.01


def test_the_cloud_keeps_its_spread_as_it_is_drawn_anew():
    belief = from_prior()
    before = belief.estimate
    for _ in range(20):
        belief._draw_anew()
    after = belief.estimate
    np.testing.assert_allclose(
        np.sqrt(np.diag(after.covariance)),
        np.sqrt(np.diag(before.covariance)),
        rtol=0.3,
    )


def test_it_is_random_by_its_seed_alone():
    first, again = (drum(from_prior(7), 6, 1) for _ in range(2))
    assert first == again


def test_places_beyond_the_table_are_nowhere():
    belief = around([MIRROR[0] + np.pi, MIRROR[1], MIRROR[2]])
    places = belief.places(tau_of(TRUE, MIRROR, np.array([0.25, -0.1])))
    assert np.isnan(places).all()
    assert not inside_polygon(WORKSPACE, [[9.0, 9.0]]).any()
