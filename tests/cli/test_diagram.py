"""`affetto diagram`: the picture of a scenario's station."""

from drake_affetto.cli.main import main


def test_it_draws_the_stations_systems(tmp_path, capsys):
    path = tmp_path / "new" / "station.dot"
    assert main(["diagram", "--out", str(path)]) == 0
    assert str(path) in capsys.readouterr().out
    source = path.read_text()
    for system in ("plant", "camera", "microphone"):
        assert system in source


def test_what_does_not_fit_is_told_before_anything_is_built(tmp_path, capsys):
    for words, word in (
        (["--out", str(tmp_path / "a.jpeg2")], ".svg"),
        (["--depth", "-1"], "--depth is -1"),
        (["--scenario", "drummin"], "did you mean 'drumming'"),
    ):
        given = ["--out", str(tmp_path / "new" / "a.dot"), *words]
        assert main(["diagram", *given]) == 2
        assert word in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
