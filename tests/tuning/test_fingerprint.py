"""A tuning study is known by all that determines it."""

import dataclasses
import shutil

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir
from drake_affetto.tuning import environment as environments
from drake_affetto.tuning.fingerprint import fingerprint
from drake_affetto.tuning.plan import load_plan
from drake_affetto.tuning.trial import run_trial

JOINT = ("right_elbow_flexion",)


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A plan whose scenario, table, gains and tuning are files of one's own."""
    monkeypatch.setattr(environments, "_ENVIRONMENTS", {})
    for name in ("sdf/drum.sdf", "control.yaml", "tuning.yaml"):
        shutil.copy(models_dir() / name, tmp_path)
    scenario = tmp_path / "own.yaml"
    scenario.write_text(
        "extends: easy_drumming\nworld: {drum: drum.sdf}\n"
        "control: {parameters: control.yaml}\n"
    )
    return load_plan(
        JOINT, scenario=str(scenario), tuning=str(tmp_path / "tuning.yaml")
    )


def test_what_determines_a_trial_counts_and_its_own_gains_do_not(own, tmp_path):
    first = fingerprint(own)
    assert fingerprint(own) == first
    assert fingerprint(dataclasses.replace(own, seed=1)) != first
    gains = tmp_path / "control.yaml"
    text = gains.read_text()
    assert "kD: " in text
    gains.write_text(text.replace("kD: ", "kD: 1", 1))
    assert fingerprint(own) == first
    for name, more in (
        ("drum.sdf", "<!-- moved -->"),
        ("own.yaml", "joint_damping: {right_elbow_flexion: 0.2}\n"),
        ("own.yaml", "settling_duration: 1.5\n"),
        ("tuning.yaml", "settling: 0.35\n"),
    ):
        path = tmp_path / name
        before = path.read_text()
        if name == "tuning.yaml":
            lines = before.splitlines(keepends=True)
            before = "".join(x for x in lines if not x.startswith("settling:"))
        path.write_text(before + more)
        assert fingerprint(own) != first, name
        first = fingerprint(own)


def test_a_trial_of_other_files_than_the_studys_is_refused(own, tmp_path):
    mark = fingerprint(own)
    (tmp_path / "drum.sdf").write_text(
        (tmp_path / "drum.sdf").read_text() + "<!-- moved -->"
    )
    with pytest.raises(InputError, match="is not the one that the study in"):
        run_trial(str(tmp_path / "out"), own, 0, mark)
    assert not (tmp_path / "out").exists()
