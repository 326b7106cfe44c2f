"""`affetto toy`: what it resumes, writes and prints."""

import argparse
import json

import numpy as np
import pytest

from drake_affetto.cli import toy as command
from drake_affetto.common.errors import InputError


def arguments(*words):
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return parser.parse_args(words)


def test_run_resumes_and_repeats(tmp_path, capsys):
    words = ["--repeats", "2", "--workers", "0", "--out"]
    first, second = tmp_path / "first", tmp_path / "second"
    assert command.run(arguments("--seeds", "1", *words, str(first))) == 0
    capsys.readouterr()
    # One of two seeds is there already.
    assert command.run(arguments("--seeds", "2", *words, str(first))) == 0
    assert "2 seeds were finished already" in capsys.readouterr().out
    assert command.run(arguments("--seeds", "2", *words, str(second))) == 0
    results = [(d / "results.json").read_bytes() for d in (first, second)]
    assert results[0] == results[1]


def test_results(tmp_path, capsys):
    command.run(
        arguments(
            *("--repeats", "2", "--seeds", "2", "--seed", "7"),
            *("--workers", "0", "--out", str(tmp_path)),
        )
    )
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["seed"] == 7
    assert results["repeats"] == 2
    for figures in (results, results["wide"]):
        assert {"train_mse", "test_mse", "rotated_mse"} <= set(
            figures["source"]
        )
        assert {"paper_single_start", "default"} <= set(figures["transfer"])
        assert {"relearn", "gaussian_process", "affine_regression"} <= set(
            figures["baselines"]
        )
        for group in ("transfer", "baselines"):
            for row in figures[group].values():
                for key in ("train_mse", "other_mse"):
                    for kind in ("mean", "std"):
                        value = row[f"{key}_{kind}"]
                        seeds = row["per_seed"][f"{key}_{kind}"]
                        assert value == np.median(seeds)
                        assert len(seeds) == 2
    printed = capsys.readouterr().out
    assert "41.71" in printed
    assert "linear regression" in printed


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(InputError, match="file"):
        command.run(arguments("--out", str(blocked)))
