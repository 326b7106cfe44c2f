"""Pictures, sounds and replay on the page."""

import pytest

from drake_affetto import report
from drake_affetto.common.errors import InputError
from support import report_data
from support.report_page import Page


@pytest.mark.parametrize("name", ["trial.png", "hit.wav", "replay.html"])
def test_damaged_media_are_named(tmp_path, name):
    folder = report_data.write(tmp_path, report_data.demo(), media=True)
    (folder / name).write_bytes(b"")
    with pytest.raises(InputError, match=name):
        report.write_report([folder], tmp_path / "page.html")


def test_sounds_of_unknown_form_still_play(tmp_path):
    folder = report_data.write(tmp_path, report_data.demo(), media=True)
    (folder / "miss.wav").write_bytes(b"RIFFnothing more")
    made = Page(report.write_report([folder], tmp_path / "page.html"))
    assert len(made.all("audio")) == 2
    assert len(made.all("svg")) == 1
