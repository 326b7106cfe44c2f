"""The configuration of tuning, and the errors in it."""

import dataclasses

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.tuning.config import (
    TuningConfig,
    load_tuning,
)


def test_the_default_file_is_read():
    config = load_tuning()
    assert config.cost.tracking > 0.0
    assert "right_elbow_flexion" in config.excursions


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("sample_rate: 3.0", "sample_rate"),
        ("sines: {low: 0.5, high: 0.2}", r"sines\.high"),
        ("steps: {levels: [2.0]}", r"steps\.levels"),
        ("trapezoids: {ramp: [1.0]}", r"trapezoids\.ramp"),
        ("excursions: {waist_yaw: [0.3, -0.3]}", r"excursions\.waist_yaw"),
        ("search: {population: 2}", r"search\.population"),
        ("cost: {tracking: -1.0}", r"cost\.tracking"),
        ("cots: {}", "cots"),
    ],
)
def test_a_value_that_does_not_fit_is_named(tmp_path, text, field):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=field):
        load_tuning(path)


def test_defaults_fit_themselves():
    TuningConfig().check("tuning")
    assert dataclasses.asdict(TuningConfig())["sample_rate"] > 0
