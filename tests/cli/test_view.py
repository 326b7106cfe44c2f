"""`affetto view`: the world in a browser, without a browser."""

from drake_affetto.cli.main import main


def test_it_tells_the_last_posture(capsys):
    assert main(["view", "--time-limit", "0.2"]) == 0
    told = capsys.readouterr().out
    assert "The last posture, rad:" in told
    assert "waist_yaw: " in told


def test_a_scenario_that_is_not_there_is_told(capsys):
    assert main(["view", "--scenario", "mirrow"]) == 2
    assert "did you mean 'mirror'" in capsys.readouterr().err
