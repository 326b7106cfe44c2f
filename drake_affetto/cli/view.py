"""`affetto view`: the robot in a browser, with a slider for each joint."""

import argparse

from drake_affetto.cli.options import add_scenario_argument, real_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    add_scenario_argument(parser)
    parser.add_argument(
        "--frames",
        action="store_true",
        help="draw the frames of camera, palm, mirror and drum",
    )
    parser.add_argument(
        "--time-limit",
        type=real_number,
        default=None,
        metavar="SECONDS",
        help="stop by itself after this time",
    )


def run(args: argparse.Namespace) -> int:
    """Shows the scenario's world until told to stop; returns the exit code."""
    from drake_affetto.scene.view import view_model
    from drake_affetto.station.scenario import load_scenario

    posture = view_model(
        load_scenario(args.scenario).world,
        time_limit=args.time_limit,
        frames=args.frames,
    )
    print("The last posture, rad:")
    for name, angle in posture.items():
        print(f"  {name}: {angle:.3f}")
    return 0
