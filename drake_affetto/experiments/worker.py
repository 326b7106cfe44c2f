"""What worker processes of the studies call.

Nothing heavy is imported here, so that a study's own process can start its
workers before it imports Drake itself.
"""

import contextlib

from drake_affetto.common.errors import InputError
from drake_affetto.runner.executor import Result, Spec


def prepare(scenario: str) -> None:
    """Imports what trials need and builds the station of a scenario.

    Args:
        scenario: Scenario of the first trials, by name or path.
    """
    from drake_affetto.experiments.trials import runner

    # The study's own process reports a scenario that does not fit.
    with contextlib.suppress(InputError):
        runner(scenario)


def run_task(spec: Spec) -> Result:
    """Runs one trial, see `drake_affetto.experiments.trials.run_task`."""
    from drake_affetto.experiments import trials

    return trials.run_task(spec)
