"""`affetto report`: where the page goes."""

import argparse
from pathlib import Path

from drake_affetto.cli import main as cli
from drake_affetto.cli import report as command
from support import report_data


def test_command(tmp_path, capsys):
    folder = report_data.write(tmp_path / "toy", report_data.toy())
    assert cli.main(["report", str(folder)]) == 0
    assert (folder / "report.html").is_file()
    assert str(folder / "report.html") in capsys.readouterr().out
    out = tmp_path / "new" / "page.html"
    assert cli.main(["report", str(folder), "--out", str(out)]) == 0
    # The same results, the same page.
    assert out.read_bytes() == (folder / "report.html").read_bytes()
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "has no results.json" in capsys.readouterr().err
    assert cli.main(["report"]) == 2
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    assert parser.parse_args(["a", "b"]).folders == [Path("a"), Path("b")]


def test_a_damaged_study_is_refused_and_its_folder_left_as_it_was(
    tmp_path, capsys
):
    folder = report_data.write(tmp_path / "toy", report_data.toy())
    results = folder / "results.json"
    results.write_text(results.read_text()[:-20])
    before = sorted(folder.iterdir())
    page = folder / "page.html"
    assert cli.main(["report", str(folder), "--out", str(page)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert str(results) in err
    assert sorted(folder.iterdir()) == before
