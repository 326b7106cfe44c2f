"""The simulation's parameters, identified from its own logs at the wire.

Makes logs over the wire (`tests/support/record_over_wire.py`), fits them as a
robot's,

    affetto identify --fit LOG... --test LOG... --out DIR \
        --overlay package://drake_affetto/robot_pneumatics.yaml

and then lays what was found beside what the scenario has:

    python analysis/experiments/wire_identification.py DIR [--out FILE]
"""

import argparse
import json
from pathlib import Path

from drake_affetto.pneumatics.parameters import load_parameters
from drake_affetto.station.scenario import load_scenario


def true_values(scenario_name: str, joint: str) -> dict[str, float]:
    """What the scenario has, by the names that the fit uses."""
    scenario = load_scenario(scenario_name)
    pneumatics = scenario.pneumatics
    parameters = load_parameters(pneumatics.parameters, pneumatics.overlays)
    values = dict(vars(parameters.actuator_of(joint)))
    if joint in scenario.joint_damping:
        values["viscous_friction"] = scenario.joint_damping[joint]
    # A command waits for the next tick: half a period in the mean.
    values["dead_time"] += 0.5 * scenario.control.period
    return values


def main() -> None:
    """Prints and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", metavar="DIR", help="of `affetto identify`")
    parser.add_argument("--scenario", default="robot")
    parser.add_argument("--out", metavar="FILE", help="write the table there")
    args = parser.parse_args()
    path = Path(args.results) / "results.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    true = true_values(args.scenario, found["joint"])
    lines = [
        "| parameter | true | identified | deviations | determined |",
        "|---|---|---|---|---|",
    ]
    for name, each in found["parameters"].items():
        if name not in true or each["std"] is None:
            continue
        apart = abs(each["value"] - true[name]) / each["std"]
        lines.append(
            f"| {name} [{each['unit']}] | {true[name]:.4g} | "
            f"{each['value']:.4g} ± {each['std']:.2g} | {apart:.1f} | "
            f"{'yes' if each['determined'] else 'no'} |"
        )
    table = "\n".join(lines)
    print(table)
    if args.out:
        Path(args.out).write_text(table + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
