"""`affetto diagram`: draws a station's systems and their connections."""

import argparse
from pathlib import Path

from drake_affetto.cli.options import add_scenario_argument, whole_number
from drake_affetto.common.errors import require
from drake_affetto.common.owner import check_file, claim_file
from drake_affetto.station.diagram_drawing import check_suffix, write_diagram


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    add_scenario_argument(parser, metavar="NAME")
    parser.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        default=Path("out/diagram.svg"),
        help="picture (.svg, .png, .pdf) or its source (.dot, .gv)",
    )
    parser.add_argument(
        "--depth",
        metavar="N",
        type=whole_number,
        default=1,
        help="how deep nested Diagrams are opened",
    )
    parser.add_argument(
        "--all-ports",
        action="store_true",
        help="also draw the ports that nothing is connected to",
    )


def run(args: argparse.Namespace) -> int:
    """Builds the scenario's station and draws it; returns the exit code."""
    path = check_suffix(args.out)
    require(args.depth >= 0, "--depth", args.depth, "0 or more")

    from drake_affetto.station.scenario import load_scenario
    from drake_affetto.station.station import AffettoStation

    scenario = load_scenario(args.scenario)
    check_file(path, "diagram")
    station = AffettoStation(scenario)
    claim_file(path, "diagram")
    write_diagram(station, path, args.depth, all_ports=args.all_ports)
    print(path)
    return 0
