"""`affetto look`."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.experiments.camera_preview import make_gaze_geometry
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.geometry.region import grid_inside
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.station.scenario import load_scenario, scenario_names
from drake_affetto.station.station import AffettoStation


def relative_box(name):
    """The calibration as shares of the image's width and height."""
    scenario = load_scenario(name)
    box, camera = scenario.blob.calibration, scenario.camera
    return [
        round((edge + 0.5) / size, 4)
        for edge, size in (
            (box.u_min, camera.width),
            (box.u_max, camera.width),
            (box.v_min, camera.height),
            (box.v_max, camera.height),
        )
    ]


def keeps_calibration(name):
    """Whether a scenario has the calibration of the one it extends."""
    return name != "drumming" and relative_box(name) == relative_box("drumming")


@pytest.mark.parametrize(
    "name", [n for n in scenario_names() if not keeps_calibration(n)]
)
def test_the_scenarios_calibration_is_the_computed_one(name):
    scenario = load_scenario(name)
    station = AffettoStation(scenario)
    sight = make_gaze_geometry(station, station.CreateDefaultContext())
    computed = sight.calibration()
    for field in dataclasses.fields(BlobCalibration):
        assert getattr(scenario.blob.calibration, field.name) == pytest.approx(
            getattr(computed, field.name), abs=0.02
        ), f"run `affetto look {name} --calibrate`"
    # So that all of the region has task parameters from 0 to 1.
    places = grid_inside(scenario.drum_region.corners, 4)
    tau = sight.task_parameters(places, computed)
    image = tau if sight.fixed_yaw is not None else tau[:, :1]
    assert np.all((image > 0) & (image < 1))


@pytest.mark.parametrize("name", ["drumming", "mirror"])
def test_the_gaze_settles_on_the_true_task_parameter(name):
    scenario = load_scenario(name)
    trials = TrialRunner(scenario)
    sight = make_gaze_geometry(trials.station, trials.context)
    xy = np.array([0.333, 0.003])
    taus = []
    for seed in (0, 1):
        outcome = trials.gaze(xy, seed)
        assert outcome.found
        # It turns by up to 45° at 0.8 rad/s at most, and settles.
        assert outcome.duration < 3.0
        taus.append(outcome.task_parameter)
    truth = sight.task_parameters(xy, scenario.blob.calibration)[0]
    assert np.all(np.abs(np.array(taus) - truth) < 0.02)
    # The images differ by their noise; the task parameter hardly.
    assert np.any(taus[0] != taus[1])
    if name == "drumming":
        assert abs(taus[0][1] - taus[1][1]) < np.deg2rad(0.3)
    # The renderer-free twin gives the same, to a fraction of a pixel.
    scenario.camera.renderer = "analytic"
    outcome = TrialRunner(scenario).gaze(xy, seed=0)
    assert outcome.found
    tau = outcome.task_parameter
    box = scenario.blob.calibration
    pixel = np.array([box.u_max - box.u_min, box.v_max - box.v_min])
    if name == "drumming":
        pixel = np.array([pixel[1], scenario.camera.model().focal_x])
    assert np.abs((tau - taus[0]) * pixel).max() < 0.4
