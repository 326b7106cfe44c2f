"""`affetto look`: shows what the camera sees, and calibrates it."""

import argparse
from typing import TYPE_CHECKING

from drake_affetto.cli.options import (
    add_output_argument,
    add_scenario_argument,
    add_seed_argument,
    real_number,
)
from drake_affetto.common.errors import require_range
from drake_affetto.common.owner import claim_folder

if TYPE_CHECKING:
    from pydrake.systems.framework import Context

    from drake_affetto.common.typing import Array
    from drake_affetto.experiments.camera_preview import GazeGeometry
    from drake_affetto.station.station import AffettoStation


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    add_scenario_argument(parser, "scenario", nargs="?")
    parser.add_argument(
        "--drum",
        metavar=("X", "Y"),
        nargs=2,
        type=real_number,
        help="position of the drum, m; the middle of its region by default",
    )
    add_output_argument(parser, "out/look")
    add_seed_argument(parser, "seed of the camera's noise")
    parser.add_argument(
        "--video",
        action="store_true",
        help="also simulate the gaze servo at work, as gaze.mp4",
    )
    parser.add_argument(
        "--calibrate",
        action="store_true",
        help="print the calibration that fits the drum's region, as YAML for "
        "the scenario; draws nothing",
    )


def run(args: argparse.Namespace) -> int:
    """Draws what the scenario's camera sees; returns the exit code."""
    require_range("--seed", args.seed, 0, 2**31 - 1)

    import numpy as np

    from drake_affetto.experiments.camera_preview import (
        calibration_yaml,
        draw_view,
        make_gaze_geometry,
        turn_to,
        write_gaze_video,
        write_image,
    )
    from drake_affetto.station.scenario import load_scenario
    from drake_affetto.station.station import AffettoStation

    scenario = load_scenario(args.scenario)
    if args.calibrate:
        station = AffettoStation(scenario)
        sight = make_gaze_geometry(station, station.CreateDefaultContext())
        print(calibration_yaml(sight.calibration()))
        return 0
    station = AffettoStation(scenario)
    context = station.CreateDefaultContext()
    xy = np.array(args.drum or scenario.drum_region.middle)
    station.set_drum_position(context, xy)
    station.camera.set_seed(
        station.camera.GetMyMutableContextFromRoot(context), args.seed
    )
    sight = make_gaze_geometry(station, context)
    yaw = sight.looking_yaw(xy)
    # Nothing is written for a drum that cannot be looked at.
    out = claim_folder(args.out, "look")
    for name, angle in (("start", None), ("look", yaw)):
        if angle is not None:
            turn_to(station, context, angle)
        at = station.start_posture[
            station.joints.names.index(scenario.yaw_joint)
        ]
        canvas = draw_view(
            station.GetOutputPort("camera.color_image").Eval(context).data,
            station.GetOutputPort("camera.blob_pixels").Eval(context),
            sight,
            float(at if angle is None else angle),
            scenario,
        )
        path = out / f"{name}.png"
        write_image(path, canvas.image)
        print(path)
    _print_findings(station, context, sight, xy, yaw)
    if args.video:
        path = out / "gaze.mp4"
        write_gaze_video(path, scenario, xy, args.seed)
        print(path)
    return 0


def _print_findings(
    station: "AffettoStation",
    context: "Context",
    sight: "GazeGeometry",
    xy: "Array",
    yaw: float,
) -> None:
    pixels = station.GetOutputPort("camera.blob_pixels").Eval(context)
    blob = station.GetOutputPort("camera.blob").Eval(context)
    seen_in, view = sight.model.seen_by(xy, yaw, sight.mirrors)
    how = "directly" if seen_in is None else "in the mirror"
    print(f"drum at {xy[0]:.3f}, {xy[1]:.3f} m, seen {how}, yaw {yaw:.4f} rad")
    if blob[2] < 0.5:
        print("blob: not found")
        return
    print(
        f"blob: u {pixels[0]:.2f}, v {pixels[1]:.2f} pixels, area "
        f"{pixels[2]:.0f}, confidence {pixels[3]:.2f}; by geometry u "
        f"{view.uv[0]:.2f}, v {view.uv[1]:.2f}, area {view.area:.0f}"
    )
    if sight.fixed_yaw is None:
        print(f"tau: y_img {blob[1]:.4f}, q3* {yaw:.4f} rad")
    else:
        print(f"tau: x_img {blob[0]:.4f}, y_img {blob[1]:.4f}")
