"""A scenario's supervisor as YAML has it."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.station.supervision import SupervisionConfig


def test_what_does_not_fit_is_named(tmp_path):
    with pytest.raises(InputError, match=r"s\.supervisor\.on_invalid is 'run'"):
        SupervisionConfig(on_invalid="run").check("s.supervisor")
    file = tmp_path / "mine.yaml"
    file.write_text("tracking: -1.0\n")
    config = SupervisionConfig(overlays=[str(file)])
    with pytest.raises(InputError, match="tracking is -1"):
        config.check("s.supervisor")


def test_actions_differ():
    vent, hold = (SupervisionConfig(on_invalid=a) for a in ("vent", "hold"))
    assert vent.action != hold.action
    assert 0 not in (vent.action, hold.action)
