"""Measures the perception: accuracy, false alarms, cost, the gaze servo.

python analysis/benchmarks/bench_perception.py [--quick]
    [--only accuracy|false|cost|gaze|twin]

Costs are CPU times of this process, told as ratios to one bare color render
of Drake's own RgbdSensor at the same size; images that are asked for twice in
a row are made anew by moving the camera a hair.
"""

import argparse
import time

import cv2
import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    RenderCameraCore,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder

from drake_affetto.experiments.camera_preview import (
    make_gaze_geometry,
    turn_to,
)
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.view_maps import (
    CHANGED_VIEWS,
    REFERENCE,
    ViewDomain,
)
from drake_affetto.perception.blob import detect
from drake_affetto.perception.imaging import ImageEffects
from drake_affetto.perception.mirror_camera import DIRECT
from drake_affetto.scene import world
from drake_affetto.scene.parts import find_frame
from drake_affetto.station.scenario import Scenario, load_scenario
from drake_affetto.station.station import AffettoStation

LEAST_AREA = 25.0


def sized(name: str, scale: int) -> Scenario:
    """A scenario with its image `scale` times as large as 320 × 240."""
    scenario = load_scenario(name)
    factor = scale * 320 / scenario.camera.width
    scenario.camera.width = round(scenario.camera.width * factor)
    scenario.camera.height = round(scenario.camera.height * factor)
    return scenario


def view_of(scenario: Scenario, name: str) -> ViewDomain:
    """The scenario's station with its sight, without noise in the image."""
    station = AffettoStation(scenario)
    context = station.CreateDefaultContext()
    camera = station.camera.GetMyMutableContextFromRoot(context)
    station.camera.set_effects(camera, ImageEffects())
    return ViewDomain(
        name, station, context, make_gaze_geometry(station, context)
    )


def random_place(view: ViewDomain, rng: np.random.Generator) -> tuple:
    """(xy, yaw): a drum on the table about its region, and a yaw about it."""
    region = view.station.scenario.drum_region
    xy = rng.uniform(
        [region.x[0] - 0.02, region.y[0] - 0.05],
        [region.x[1] + 0.03, region.y[1] + 0.05],
    )
    middle = view.sight.fixed_yaw
    if middle is None:
        middle = view.sight.model.direct_pixels(xy)[0][0]
        middle = 0.0 if np.isnan(middle) else middle
    return xy, float(np.clip(middle + rng.uniform(-0.3, 0.3), -0.5, 0.5))


def whole_views(view: ViewDomain, xy: np.ndarray, yaw: float) -> list:
    """(kind, centroid, outline) of each image of the marker that is whole."""
    model = view.sight.model
    size = np.array([model.camera.width, model.camera.height])
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rim = xy + model.marker_radius * np.stack(
        [np.cos(angle), np.sin(angle)], -1
    )
    found = []
    for kind, mirror in (("direct", None), ("mirrored", "m")):
        if mirror is not None:
            mirror = view.sight.mirrors[0]
        seen = model.view(xy, yaw, mirror)
        outline = model.image_of(rim, yaw, mirror)
        if (
            seen.whole == 1.0
            and seen.area >= LEAST_AREA
            and np.all(outline > 3)
            and np.all(outline < size - 4)
        ):
            found.append((kind, seen, outline))
    return found


def accuracy(quick: bool) -> None:
    """Rendered against geometric centroids, over scenarios and places."""
    print("centroid, rendered against geometry [pixels]")
    for scale in (1, 2):
        errors: dict[str, list[float]] = {"direct": [], "mirrored": []}
        hidden = 0
        for k, name in enumerate((REFERENCE, *CHANGED_VIEWS)):
            view = view_of(sized(name, scale), name)
            rng = np.random.default_rng(100 + k)
            goal = (8 if quick else 45) if scale == 1 else (4 if quick else 30)
            count = 0
            while count < goal:
                xy, yaw = random_place(view, rng)
                wholes = whole_views(view, xy, yaw)
                if not wholes:
                    continue
                count += 1
                view.station.set_drum_position(view.context, xy)
                turn_to(view.station, view.context, yaw)
                image = view.station.GetOutputPort("camera.color_image").Eval(
                    view.context
                )
                for kind, seen, outline in wholes:
                    low, high = outline.min(0) - 5, outline.max(0) + 6
                    size = np.array(image.data.shape[1::-1])
                    config = view.station.scenario.blob
                    config.region = np.clip(
                        [*(low / size), *(high / size)], 0, 1
                    ).tolist()
                    blob = detect(image.data, config)
                    if blob is None or blob.area < 0.9 * seen.area:
                        hidden += 1  # by the hand
                        continue
                    errors[kind].append(
                        float(
                            np.hypot(blob.u - seen.uv[0], blob.v - seen.uv[1])
                        )
                    )
        for kind, values in errors.items():
            q = np.quantile(values, [0.5, 0.95, 1.0])
            print(
                f"  {320 * scale} x {240 * scale}, {kind:8s}: {len(values)} "
                f"images, median {q[0]:.3f}, 95 % {q[1]:.3f}, most {q[2]:.3f}"
            )
        print(f"  (left out: {hidden} that the hand hides in part)")


def false_alarms(quick: bool) -> None:
    """Images without a visible marker, of all scenarios, in many lights."""
    total, found = 0, 0
    for k, name in enumerate((REFERENCE, *CHANGED_VIEWS)):
        view = view_of(load_scenario(name), name)
        rng = np.random.default_rng(k)
        station, context = view.station, view.context
        plant = station.plant.GetMyMutableContextFromRoot(context)
        camera = station.camera.GetMyMutableContextFromRoot(context)
        names = list(station.joints.names)
        low, high = world.joint_limits(station.plant, names)
        here = 0
        while here < (8 if quick else 64):
            # Head and trunk anywhere, so that the camera looks all about.
            posture = dict(zip(names, rng.uniform(low, high), strict=True))
            posture |= {
                "neck_yaw": rng.uniform(-1.0, 1.0),
                "neck_pitch": rng.uniform(-0.5, 0.65),
            }
            xy = rng.uniform([0.2, -0.2], [0.4, 0.25])
            world.set_posture(station.plant, plant, posture)
            station.set_drum_position(context, xy)
            sight = make_gaze_geometry(station, context)
            yaw = posture[station.scenario.yaw_joint]
            views = [
                sight.model.view(xy, yaw, mirror)
                for mirror in (None, *sight.mirrors)
            ]
            if any(seen.whole > 0.0 and seen.area > 0.0 for seen in views):
                continue
            here += 1
            station.camera.set_effects(
                camera,
                ImageEffects(
                    exposure=rng.uniform(-1, 1),
                    white_balance=[
                        rng.uniform(0.7, 1.3),
                        1.0,
                        rng.uniform(0.7, 1.3),
                    ],
                    noise=rng.uniform(0, 8),
                ),
            )
            station.camera.set_seed(camera, here)
            pixels = station.GetOutputPort("camera.blob_pixels").Eval(context)
            found += int(pixels[2] > 0)
        total += here
    print(f"false alarms: {found} in {total} images without a visible marker")


def cpu_time(work, repeats: int) -> float:
    """Median CPU time [ms] of work(k), k = 0 … repeats."""
    work(-1)
    times = []
    for k in range(repeats):
        begin = time.process_time()
        work(k)
        times.append(time.process_time() - begin)
    return 1e3 * float(np.median(times))


def cost(quick: bool) -> None:
    """Cost of an image, direct and mirrored, against a bare render."""
    for scale in (1, 2):
        for name in (REFERENCE, "mirror"):
            print(_cost_of(sized(name, scale), name, 15 if quick else 60))


def _cost_of(scenario: Scenario, name: str, repeats: int) -> str:
    builder = DiagramBuilder()
    station = builder.AddSystem(AffettoStation(scenario))
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    station.reset(station.GetMyMutableContextFromRoot(root))
    camera = station.camera.GetMyMutableContextFromRoot(root)
    plant = station.plant.GetMyMutableContextFromRoot(root)
    seen = station.GetSubsystemByName("seen_scene")
    scene = seen.GetMyContextFromRoot(root)
    image_port = station.camera.get_color_image_output_port()
    config = scenario.camera
    core = RenderCameraCore(
        DIRECT,
        station.camera_info,
        ClippingRange(config.near, config.far),
        RigidTransform(),
    )
    bare_camera = ColorRenderCamera(core, False)
    frame = find_frame(station.plant, config.frame)
    parent = station.plant.GetBodyFrameIdOrThrow(frame.body().index())
    X_PC = frame.GetFixedPoseInBodyFrame() @ RigidTransform(config.X_FC())

    def move(k: int) -> None:
        # Drake makes an image anew where a pose has changed.
        yaw = scenario.look.fixed_yaw + 1e-5 * k
        world.set_posture(station.plant, plant, {scenario.yaw_joint: yaw})

    def render_bare(k: int) -> None:
        # What RgbdSensor does.
        move(k)
        query = seen.get_query_output_port().Eval(scene)
        query.RenderColorImage(bare_camera, parent, X_PC)

    def render(k: int) -> None:
        move(k)
        image_port.Eval(camera)

    idle = cpu_time(move, repeats)
    times = {"bare": [], "clean": [], "noisy": []}
    for _ in range(3):  # Turn by turn, as the machine's speed drifts.
        times["bare"].append(cpu_time(render_bare, repeats) - idle)
        for kind, noise in (("clean", 0.0), ("noisy", 2.0)):
            station.camera.set_effects(camera, ImageEffects(noise=noise))
            times[kind].append(cpu_time(render, repeats) - idle)
    bare, clean, noisy = (float(np.median(v)) for v in times.values())
    image = image_port.Eval(camera).data.copy()
    blob = cpu_time(lambda k: detect(image, scenario.blob), 200)
    return (
        f"{config.width} x {config.height}, {name:8s}: bare render "
        f"{bare:.2f} ms; image {clean / bare:.2f} x, with noise "
        f"{noisy / bare:.2f} x; blob {blob:.2f} ms"
    )


def gaze(quick: bool) -> None:
    """Time to settle, what is left, and how well τ repeats."""
    for name in (REFERENCE, "mirror"):
        scenario = load_scenario(name)
        trials = TrialRunner(scenario)
        sight = make_gaze_geometry(trials.station, trials.context)
        n = 2 if quick else 4
        region = scenario.drum_region
        places = np.stack(
            np.meshgrid(np.linspace(*region.x, n), np.linspace(*region.y, n)),
            -1,
        ).reshape(-1, 2)
        times, off, spread, wrong = [], [], [], []
        failed = 0
        for xy in places:
            taus = []
            for seed in range(2 if quick else 3):
                outcome = trials.gaze(xy, seed)
                failed += not outcome.found
                times.append(outcome.duration)
                taus.append(outcome.task_parameter)
                x = trials.port("camera.blob")[0]
                box = scenario.blob.calibration
                u = box.u_min + x * (box.u_max - box.u_min)
                off.append(
                    abs(u - sight.model.camera.image_center[0])
                    / scenario.camera.width
                )
            spread.append(np.ptp(taus, axis=0))
            truth = sight.task_parameters(xy, scenario.blob.calibration)[0]
            wrong.append(np.abs(np.mean(taus, axis=0) - truth))
        spread, wrong = np.max(spread, axis=0), np.max(wrong, axis=0)
        print(
            f"gaze, {name}: {len(times)} looks, {failed} failed; settled in "
            f"{np.median(times):.2f} s, at most {np.max(times):.2f} s"
        )
        if sight.fixed_yaw is None:
            print(
                f"  marker off the middle by at most {max(off):.2%} of the "
                f"width; q3* differs between seeds by at most "
                f"{np.rad2deg(spread[1]):.3f} deg, y_img by {spread[0]:.4f}; "
                f"from geometry {np.rad2deg(wrong[1]):.3f} deg, {wrong[0]:.4f}"
            )
        else:
            print(
                f"  x_img, y_img differ between seeds by at most {spread}, "
                f"from geometry by {wrong}"
            )


def twin(quick: bool) -> None:
    """τ of the renderer-free twin against that of rendered images."""
    for name in (REFERENCE, "mirror"):
        taus: dict[str, list] = {}
        costs = {}
        for renderer in ("vtk", "analytic"):
            scenario = load_scenario(name)
            scenario.camera.renderer = renderer
            trials = TrialRunner(scenario)
            rng = np.random.default_rng(3)
            region = scenario.drum_region
            taus[renderer] = []
            begin = time.process_time()
            for seed in range(4 if quick else 20):
                xy = rng.uniform(
                    [region.x[0], region.y[0]], [region.x[1], region.y[1]]
                )
                outcome = trials.gaze(xy, seed)
                taus[renderer].append(
                    outcome.task_parameter if outcome.found else [np.nan] * 2
                )
            costs[renderer] = time.process_time() - begin
        box = scenario.blob.calibration
        pixel = np.array([box.u_max - box.u_min, box.v_max - box.v_min])
        if scenario.look.mode == "centre":
            pixel = np.array([pixel[1], scenario.camera.model().focal_x])
        difference = (np.array(taus["analytic"]) - taus["vtk"]) * pixel
        print(
            f"twin, {name}: difference of tau [pixels] mean "
            f"{difference.mean(0).round(3)}, sd {difference.std(0).round(3)}, "
            f"most {np.abs(difference).max(0).round(3)}; a look costs "
            f"{costs['analytic'] / costs['vtk']:.2f} of the rendered one"
        )


PARTS = {
    "accuracy": accuracy,
    "false": false_alarms,
    "cost": cost,
    "gaze": gaze,
    "twin": twin,
}


def main() -> None:
    """Runs the parts and prints what they measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=PARTS, nargs="*")
    parser.add_argument("--quick", action="store_true")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    for name, part in PARTS.items():
        if not args.only or name in args.only:
            part(args.quick)


if __name__ == "__main__":
    main()
