"""Settings of a movement primitive."""

import dataclasses

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.motion import DmpConfig


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"n_basis": 1}, "n_basis"),
        ({"n_basis": 3.0}, "n_basis"),
        ({"duration": 0.0}, "duration"),
        ({"stiffness": -1.0}, "stiffness"),
        ({"stiffness": float("nan")}, "stiffness"),
        ({"damping": -2.0}, "damping"),
        ({"width": 0.0}, "width"),
        ({"method": "magic"}, "method"),
        ({"ridge": -1.0}, "ridge"),
        ({"smoothing": 0.0}, "smoothing"),
    ],
)
def test_config_names_what_does_not_fit(change, field):
    with pytest.raises(InputError, match=f"skill.dmp.{field}"):
        dataclasses.replace(DmpConfig(), **change).check("skill.dmp")
