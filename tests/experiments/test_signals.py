"""A stored trial runs again from its row, with the same result."""

import dataclasses

import numpy as np
import pytest
from scipy.io import loadmat

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import STORE
from drake_affetto.experiments import trials
from drake_affetto.experiments.results.trial import unpack
from drake_affetto.experiments.signals import read_signals, run_again
from drake_affetto.runner.store import TrialStore, trial_key

XY = [0.235, -0.09]


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A folder with a look, a demonstration and a strike."""
    folder = tmp_path_factory.mktemp("study")
    look = trials.look("drumming", XY, 4)
    taught = trials.demonstration("drumming", XY, 1)
    keys = {}
    with TrialStore(folder / STORE) as store:
        for spec in (look, taught):
            store.put(spec, *trials.run_task(spec))
        _, arrays = store.get(taught)
        strike = trials.strike(
            "drumming", XY, 4, arrays["theta"], arrays["prototype"][None]
        )
        store.put(strike, *trials.run_task(strike))
        for spec in (look, taught, strike):
            keys[spec["kind"]] = (
                trial_key(spec),
                unpack(spec["kind"], *store.get(spec)),
            )
    yield folder, keys
    trials._RUNNERS.clear()


@pytest.mark.parametrize("kind", ["look", "demonstration", "strike"])
def test_a_trial_from_its_row_gives_the_same_result(study, kind):
    folder, keys = study
    key, before = keys[kind]
    again = run_again(folder, key)
    for field in dataclasses.fields(before):
        np.testing.assert_array_equal(
            getattr(again, field.name), getattr(before, field.name)
        )


@pytest.mark.parametrize("kind", ["demonstration", "strike"])
def test_signals_are_those_of_the_result(study, tmp_path, kind):
    folder, keys = study
    key, before = keys[kind]
    signals = read_signals(folder, key[:12])
    assert signals.key == key
    n, count = len(signals.joint_names), len(signals.t)
    assert signals.q.shape == signals.v_desired.shape == (count, n)
    assert signals.chamber_pressure.shape == (count, 2 * n)
    assert signals.valve_opening.shape == (count, n)
    assert np.abs(signals.valve_opening).max() <= 1.0
    if kind == "strike":
        assert signals.force.max() == before.max_force
    assert signals.force.max() > 0.5
    # Speeds are those of the angles.
    moved = np.trapezoid(signals.v[:, 5], signals.t)
    assert moved == pytest.approx(signals.q[-1, 5] - signals.q[0, 5], abs=0.01)
    signals.save(tmp_path / "a.mat")
    back = loadmat(tmp_path / "a.mat")
    np.testing.assert_array_equal(back["q"], signals.q)
    assert back["joint_names"][2, 0][0] == signals.joint_names[2]
    signals.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as archive:
        np.testing.assert_array_equal(archive["sound"], signals.sound)


def test_what_cannot_be_run_again_is_told(study, tmp_path, monkeypatch):
    folder, keys = study
    with pytest.raises(InputError, match="has no signals"):
        read_signals(folder, keys["look"][0])
    with pytest.raises(InputError, match="key is 'none'"):
        run_again(folder, "none")
    with pytest.raises(InputError, match=r"ends in \.mat or"):
        read_signals(folder, keys["strike"][0]).save(tmp_path / "a.csv")
    now = trials.scenario_content("drumming")
    monkeypatch.setattr(
        trials,
        "scenario_content",
        lambda name: dataclasses.replace(now, files="new"),
    )
    with pytest.raises(InputError, match=r"not the one .* other files"):
        run_again(folder, keys["strike"][0])


def test_a_skill_is_not_kept(tmp_path):
    spec = trials.drumming("drumming", XY, 1, object(), [np.ones((2, 2))])
    with TrialStore(tmp_path / STORE) as store:
        store.put(spec, {}, {})
    with pytest.raises(InputError, match="object that is not kept"):
        run_again(tmp_path, trial_key(spec))
