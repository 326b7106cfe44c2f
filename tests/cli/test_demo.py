"""`affetto demo`: what it prints, and its page."""

from drake_affetto.cli.main import main
from drake_affetto.common.output import write_json
from drake_affetto.experiments import demo
from support import report_data, report_page


def test_it_prints_the_results_and_writes_their_page(
    tmp_path, monkeypatch, capsys
):
    made = report_page.typed(report_data.demo())
    asked = {}

    def run_demo(out, plan, **how):
        asked.update(how, plan=plan)
        write_json(out / "results.json", made)
        return made

    monkeypatch.setattr(demo, "run_demo", run_demo)
    words = ["demo", "--seed", "5", "--restart", "--workers", "0"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    assert asked["plan"].seed == 5
    assert (asked["restart"], asked["watch"], asked["reuse"]) == (
        True,
        False,
        [],
    )
    told = capsys.readouterr().out
    assert f"{made.drumming.success_rate:.0%}" in told
    for scheme in made.mirror.schemes:
        assert scheme in told
    assert (tmp_path / "report.html").is_file()
