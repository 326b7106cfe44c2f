"""The robots of a study."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.bodies import draw_robots
from drake_affetto.station.content import scenario_content
from drake_affetto.station.scenario import load_scenario


def test_without_bodies_all_repeats_have_the_scenario_itself(tmp_path):
    robots = draw_robots(0, "mirror", (0, 1), None)
    assert robots.scenario(3, "mirror") == "mirror"
    assert robots.numbers() == []
    with pytest.raises(InputError, match="folder"):
        draw_robots(1, "mirror", (0, 1), None)


def test_each_repeat_has_one_body_in_all_scenarios(tmp_path):
    robots = draw_robots(3, "mirror", (0, 1), tmp_path)
    names = [robots.scenario(r, "mirror") for r in range(3)]
    loaded = [load_scenario(name) for name in names]
    assert [each.body for each in loaded] == list(robots.bodies)
    assert loaded[0].body != loaded[1].body
    direct = load_scenario(robots.scenario(1, "drumming"))
    assert direct.body == loaded[1].body
    assert direct.look.mode == "centre"
    assert loaded[1].look.mode == "fixed_yaw"
    contents = {scenario_content(name) for name in (*names, "mirror")}
    assert len(contents) == 4


def test_more_bodies_leave_the_others_as_they_are(tmp_path):
    few = draw_robots(2, "mirror", (0, 1), tmp_path)
    many = draw_robots(4, "mirror", (0, 1), tmp_path)
    assert many.bodies[:2] == few.bodies
    assert draw_robots(2, "mirror", (1, 1), tmp_path).bodies != few.bodies


def test_a_body_that_is_asked_for_again_is_not_written_again(tmp_path):
    robots = draw_robots(1, "mirror", (0, 1), tmp_path)
    path = robots.scenario(0, "mirror")
    (tmp_path / "bodies").chmod(0o500)
    try:
        assert robots.scenario(0, "mirror") == path
    finally:
        (tmp_path / "bodies").chmod(0o700)
