"""The real robot's own programs, where they are installed, on `affetto serve`.

They are on no package registry: install affctrllib and affetto-nn-ctrl beside
this package, and let AFFETTO_NN_CTRL name the latter's checkout.
"""

import importlib.util
import os
from pathlib import Path
import re
import subprocess
import sys

import pytest

from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.log import read_log
from support.serving import serving
from support.wire_client import HOST

CHECKOUT = os.environ.get("AFFETTO_NN_CTRL", "")
MISSING = [
    name
    for name in ("affctrllib", "affetto_nn_ctrl")
    if importlib.util.find_spec(name) is None
]
JOINT = 5

pytestmark = [
    pytest.mark.robot_software,
    pytest.mark.slow,
    pytest.mark.skipif(
        bool(MISSING), reason=f"not installed: {', '.join(MISSING)}"
    ),
    pytest.mark.skipif(
        not Path(CHECKOUT, "apps/collect_data.py").is_file(),
        reason="AFFETTO_NN_CTRL names no checkout of affetto-nn-ctrl",
    ),
]


def own_config(folder, server):
    """The robot's configuration, but with the server's addresses."""
    text = Path(CHECKOUT, "apps/config/affetto.toml").read_text("utf-8")
    for part, port in (
        ("remote", server.command_port),
        ("local", server.sensor_port),
    ):
        text, count = re.subn(
            rf'(\[affetto\.comm\.{part}\]\s*)host = ".*"\s*port = \d+',
            rf'\g<1>host = "{HOST}"\nport = {port}',
            text,
        )
        assert count == 1
    path = folder / "affetto.toml"
    path.write_text(text)
    return path


def test_its_data_collection_runs_unmodified(tmp_path):
    with serving() as server:
        done = subprocess.run(
            [
                sys.executable,
                str(Path(CHECKOUT, "apps/collect_data.py")),
                f"--config={own_config(tmp_path, server)}",
                f"--base-dir={tmp_path}",
                f"--output={tmp_path / 'data'}",
                f"--joint={JOINT}",
                "--duration=4",
            ],
            capture_output=True,
            text=True,
            timeout=120,
        )
        code, out, _ = server.end()
    assert done.returncode == 0, done.stderr
    assert code == 0
    assert " 0 bad" in out
    (path,) = (tmp_path / "data").rglob("*.csv")
    log = read_log(path, JOINT, load_robot_controller())
    assert log.t[-1] > 3.0
