"""Two commands do not write into one folder."""

import subprocess
import sys

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.folder_lock import lock_file, lock_folder


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


def test_a_file_is_locked_once_and_nothing_is_left(tmp_path):
    path = tmp_path / "a.h5"
    link = tmp_path / "link.h5"
    link.symlink_to("a.h5")
    with lock_file(path, "affetto teach"):
        for same in (path, link):
            with (
                pytest.raises(InputError, match=r"`affetto teach` .* on"),
                lock_file(same, "affetto teach"),
            ):
                pass
        with lock_file(tmp_path / "b.h5", "affetto teach"):
            pass
    with pytest.raises(KeyError), lock_file(path, "affetto teach"):
        raise KeyError
    assert list(tmp_path.iterdir()) == [link]


def test_a_lock_file_that_is_left_over_locks_nothing(tmp_path):
    (tmp_path / ".a.h5.lock").touch()
    with lock_file(tmp_path / "a.h5", "affetto teach"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_lock_in_no_folder_is_told(tmp_path):
    with (
        pytest.raises(InputError, match=r"cannot write .*a\.h5: No such file"),
        lock_file(tmp_path / "none" / "a.h5", "affetto teach"),
    ):
        pass
