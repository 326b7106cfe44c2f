"""Two commands do not write into one folder."""

import subprocess
import sys

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.folder_lock import lock_folder


def test_a_folder_is_locked_once_and_free_afterwards(tmp_path):
    with lock_folder(tmp_path, "affetto tune"):
        with (
            pytest.raises(InputError, match="another `affetto tune`"),
            lock_folder(tmp_path, "affetto tune"),
        ):
            pass
        (tmp_path / "other").mkdir()
        with lock_folder(tmp_path / "other", "affetto tune"):
            pass
    with lock_folder(tmp_path, "affetto tune"):
        pass


def test_a_killed_process_leaves_no_lock(tmp_path):
    code = (
        "import sys, time; from pathlib import Path;"
        "from drake_affetto.common.folder_lock import lock_folder\n"
        "with lock_folder(Path(sys.argv[1]), 'probe'):\n"
        "    print('locked', flush=True); time.sleep(60)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE
    )
    assert process.stdout.readline() == b"locked\n"
    with (
        pytest.raises(InputError, match="another `probe`"),
        lock_folder(tmp_path, "probe"),
    ):
        pass
    process.kill()
    process.communicate()
    with lock_folder(tmp_path, "probe"):
        pass
