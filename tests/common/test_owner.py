"""No command overwrites what another one made."""

import json
import os
from pathlib import Path
import time

import pytest

from drake_affetto.cli.main import main
from drake_affetto.common.errors import InputError
from drake_affetto.common.owner import (
    MARK,
    check_file,
    claim_file,
    claim_folder,
)


def test_a_folder_belongs_to_who_made_it(tmp_path):
    folder = tmp_path / "a/b"
    assert claim_folder(folder, "drum") == folder
    assert claim_folder(folder, "drum") == folder
    before = (folder / MARK).read_bytes()
    with pytest.raises(InputError, match="holds what `affetto drum` made"):
        claim_folder(folder, "toy")
    assert (folder / MARK).read_bytes() == before


@pytest.mark.parametrize(
    ("study", "owner", "said"),
    [
        ("drum", "drum", "`affetto drum`"),
        ("scenarios", "mirror", "`affetto mirror`"),
        ("conditions", "when_transfer_wins.py", "`when_transfer_wins.py`"),
    ],
)
def test_a_folder_of_an_earlier_version_is_known_by_its_results(
    tmp_path, study, owner, said
):
    (tmp_path / "results.json").write_text(json.dumps({"study": study}))
    claim_folder(tmp_path, owner)
    with pytest.raises(InputError, match=f"holds what {said} made"):
        claim_folder(tmp_path, "toy")


@pytest.mark.parametrize(
    "text", ["", "[1]", "[" * 10**5, '{"files": 3}', "\xff"]
)
def test_a_damaged_mark_is_none(tmp_path, text):
    (tmp_path / MARK).write_text(text, encoding="latin-1")
    (tmp_path / "results.json").write_text(text, encoding="latin-1")
    claim_folder(tmp_path, "drum")
    with pytest.raises(InputError, match="affetto drum"):
        claim_folder(tmp_path, "toy")


def test_a_folder_of_ones_own_is_not_refused(tmp_path):
    (tmp_path / "notes.txt").touch()
    claim_folder(tmp_path, "toy")


def test_a_file_in_anothers_folder(tmp_path):
    claim_folder(tmp_path, "drum")
    (tmp_path / "replay.html").write_text("drum's")
    table = tmp_path / "table.csv"
    for _ in range(2):
        assert claim_file(table, "export") == table
        table.write_text("export's")
    link = tmp_path / "link.csv"
    link.symlink_to("table.csv")
    for path, command, maker in (
        (tmp_path / "replay.html", "report", "drum"),
        (table, "diagram", "export"),
        (link, "diagram", "export"),
    ):
        with pytest.raises(InputError, match=f"`affetto {maker}` made; name"):
            claim_file(path, command)
    claim_file(link, "export")
    # The page stands in the folder of the study that it shows.
    (tmp_path / "report.html").touch()
    claim_file(tmp_path / "report.html", "report")


def test_a_file_elsewhere_leaves_no_mark(tmp_path):
    path = tmp_path / "made/table.csv"
    claim_file(path, "export")
    path.touch()
    claim_file(path, "export")
    assert list(path.parent.iterdir()) == [path]
    with pytest.raises(InputError, match="is a folder, expected the name of"):
        claim_file(path.parent, "export")


def test_a_command_refuses_anothers_folder_in_one_line(tmp_path, capsys):
    results = tmp_path / "results.json"
    results.write_text('{"study": "drum"}')
    page = tmp_path / "replay.html"
    page.write_text("a replay")
    for words in (
        ["toy", "--seeds", "1", "--repeats", "1", "--workers", "0", "--out"],
        ["demo", "--workers", "0", "--out"],
        ["mirror", "--workers", "0", "--out"],
        ["look", "--out"],
        ["tune", "--trials", "1", "--out"],
    ):
        assert main([*words, str(tmp_path)]) == 2
        done = capsys.readouterr()
        assert done.err.count("\n") == 1
        assert "holds what `affetto drum` made; name another folder" in done.err
    assert main(["diagram", "--out", str(tmp_path / "replay.svg")]) == 0
    (tmp_path / "start.dot").write_text("a part of the results")
    assert main(["diagram", "--out", str(tmp_path / "start.dot")]) == 2
    assert "`affetto drum` made; name another file" in capsys.readouterr().err
    assert results.read_text() == '{"study": "drum"}'
    assert page.read_text() == "a replay"
    found = {path.name for path in Path(tmp_path).iterdir()}
    assert found == {
        "results.json",
        "replay.html",
        "replay.svg",
        "start.dot",
        MARK,
    }


def test_a_look_whether_a_file_may_be_written_leaves_no_trace(tmp_path):
    folder = tmp_path / "drum"
    assert check_file(folder / "table.csv", "export") == folder / "table.csv"
    assert not folder.exists()
    claim_folder(folder, "drum")
    (folder / "replay.html").touch()
    before = (folder / MARK).read_bytes()
    check_file(folder / "table.csv", "export")
    with pytest.raises(InputError, match="`affetto drum` made; name"):
        check_file(folder / "replay.html", "export")
    assert (folder / MARK).read_bytes() == before


def test_what_killed_writers_left_goes_with_time(tmp_path):
    claim_folder(tmp_path, "drum")
    ago = time.time() - 86400.0
    names = (".trial.3f14695c.png", ".trial.3f14695d.png", ".trial.png")
    for name in (*names, "trial.3f14695c.png"):
        (tmp_path / name).touch()
        # The second may be written at this moment.
        if name != names[1]:
            os.utime(tmp_path / name, (ago, ago))
    os.utime(tmp_path / MARK, (ago, ago))
    claim_folder(tmp_path, "drum")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {MARK, *names[1:], "trial.3f14695c.png"}
