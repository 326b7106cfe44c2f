"""A scenario is known by all that determines its trials."""

import dataclasses
import os
import shutil
import time

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir
from drake_affetto.station import content as module
from drake_affetto.station.content import (
    Content,
    scenario_content,
    scenario_source,
)


@pytest.fixture
def own(tmp_path):
    """A scenario with a drum and a mesh of one's own."""
    shutil.copy(models_dir() / "sdf/drum.sdf", tmp_path / "drum.sdf")
    text = (tmp_path / "drum.sdf").read_text()
    shutil.copy(models_dir() / "meshes/drum_hoop.obj", tmp_path / "hoop.obj")
    text = text.replace("package://drake_affetto/meshes/drum_hoop", "hoop")
    assert "<uri>hoop.obj</uri>" in text
    (tmp_path / "drum.sdf").write_text(text)
    (tmp_path / "base.yaml").write_text("extends: drumming\n")
    path = tmp_path / "own.yaml"
    path.write_text("extends: base.yaml\nworld: {drum: drum.sdf}\n")
    return path


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize("aged", [False, True])
@pytest.mark.parametrize(
    ("name", "old", "new", "field"),
    [
        ("own.yaml", "world", "settling_duration: 1.25\nworld", "values"),
        ("base.yaml", "drumming\n", "drumming\nyaw_joint: waist_yaw\n", None),
        ("base.yaml", "drumming\n", "drumming\ndmp: {n_basis: 10}\n", "values"),
        ("base.yaml", "drumming", "mirror", "values"),
        ("drum.sdf", "</sdf>", "<!-- moved --></sdf>", "files"),
        ("hoop.obj", "v ", "v 0 0 0\nv ", "files"),
    ],
)
def test_an_edit_is_seen_by_a_living_process(
    own, monkeypatch, aged, name, old, new, field
):
    """At once, and also where contents are remembered of older files."""
    if aged:
        monkeypatch.setattr(module, "_YOUNG", -3600.0)
    first = scenario_content(own)
    assert scenario_content(own) == first
    edit(own.parent / name, old, new)
    second = scenario_content(own)
    if field is None:
        assert second == first
    else:
        assert second.changed(dataclasses.asdict(first)) == [field]


def test_contents_of_older_files_are_remembered(own, monkeypatch):
    for path in own.parent.iterdir():
        os.utime(path, (1e9, 1e9))
    later = time.time() + 60.0
    monkeypatch.setattr(module.time, "time", lambda: later)
    scenario_content(own)

    def never(path):
        raise AssertionError("read again")

    monkeypatch.setattr(module, "read_scenario", never)
    scenario_content(own)
    # The content is another one, but neither its size nor its time is.
    text = (own.parent / "hoop.obj").read_text()
    (own.parent / "hoop.obj").write_text(text[:-2] + "9\n")
    os.utime(own.parent / "hoop.obj", (1e9, 1e9))
    with pytest.raises(AssertionError, match="read again"):
        scenario_content(own)


def test_files_count_by_content_not_by_place(own, tmp_path):
    first = scenario_content(own)
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    for path in list(tmp_path.glob("*.*")):
        shutil.move(path, moved / path.name)
    (moved / "own.yaml").rename(moved / "other name.yaml")
    (moved / "drum.sdf").rename(moved / "trommel.sdf")
    edit(moved / "other name.yaml", "drum.sdf", "trommel.sdf")
    assert scenario_content(moved / "other name.yaml") == first


def test_which_file_stands_where_counts(tmp_path):
    gains = "gains: {{waist_yaw: {{kP: {}, kI: 1e+5, kD: 1e+4, kF: 4e-6}}}}\n"
    (tmp_path / "a.yaml").write_text(gains.format("1.0e+6"))
    (tmp_path / "b.yaml").write_text(gains.format("2.0e+6"))
    found = set()
    for order in ("a.yaml, b.yaml", "b.yaml, a.yaml", "a.yaml"):
        path = tmp_path / "c.yaml"
        path.write_text(
            f"extends: drumming\ncontrol: {{overlays: [{order}]}}\n"
        )
        found.add(scenario_content(path))
    assert len(found) == 3


def test_the_version_is_a_part_of_it():
    content = scenario_content("drumming")
    then = dataclasses.asdict(dataclasses.replace(content, version="0.0.1"))
    assert content.changed(then) == ["version"]
    assert Content(**then) != content
    assert content.changed({}) == ["values", "files", "version"]


def test_what_leads_to_a_scenario_serves_from_any_folder(
    own, monkeypatch, tmp_path
):
    assert scenario_source("mirror") == "mirror"
    monkeypatch.chdir(tmp_path)
    assert scenario_source("own.yaml") == str(own.resolve())
    with pytest.raises(InputError, match="no scenario 'drum'"):
        scenario_source("drum")


def test_a_named_file_that_is_missing_is_told(own):
    (own.parent / "drum.sdf").unlink()
    with pytest.raises(InputError, match=r"own\.world\.drum: no such file"):
        scenario_content(own)
