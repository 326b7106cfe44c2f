"""What holds for all tests, before anything heavy is imported."""

import os

# One thread a process, no display, no colors in what programs say (some add
# them where CI is set), and what Drake will drop is an error.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ["NO_COLOR"] = "1"
os.environ.pop("FORCE_COLOR", None)
os.environ.setdefault("DRAKE_DEPRECATION_RUNTIME_SEVERITY", "error")

import hypothesis
import pytest

from support import headless_browser

# The same examples in every run, and none fails for a slow machine.
hypothesis.settings.register_profile(
    "project", deadline=None, derandomize=True, database=None
)
hypothesis.settings.load_profile("project")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """A real browser; tests that need one are skipped where there is none."""
    program = headless_browser.find()
    if program is None:
        pytest.skip("no Chromium or Chrome on this machine")
    profile = tmp_path_factory.mktemp("profile")
    with headless_browser.Browser(program, profile) as found:
        yield found
