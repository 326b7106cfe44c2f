"""How the blob detection bears disturbances of the image.

python analysis/experiments/perception_robustness.py [--places 40]
    [--out out/perception_robustness]

For each disturbance at three strengths: how often the marker is found at its
true place (within 10 pixels), how often something else is taken for it, and
how far off the centroid is. Directly and in the mirror, at random places of
the drum and yaws. Writes table.md and a sheet of examples.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from drake_affetto.common.output import prepare_output, write_text_atomic
from drake_affetto.experiments.camera_preview import turn_to, write_image
from drake_affetto.experiments.view_maps import ViewDomain
from drake_affetto.perception.blob import BlobConfig, detect, marker_lab
from drake_affetto.perception.drawing import Canvas
from drake_affetto.perception.imaging import ImageEffects, apply_effects

Array = np.ndarray
# What the robot's skin and cloth look like, to hide the marker with.
SKIN = (212, 164, 137)


def add_disc(image: Array, uv: Array, axes: Array, color: Array) -> Array:
    """A filled ellipse with smooth edges."""
    out = image.copy()
    shift = 4
    cv2.ellipse(
        out,
        tuple(int(v) for v in np.rint(np.asarray(uv) * 2**shift)),
        tuple(int(v) for v in np.rint(np.asarray(axes) * 2**shift)),
        0,
        0,
        360,
        tuple(int(v) for v in color),
        -1,
        cv2.LINE_AA,
        shift,
    )
    return out


def add_distractors(
    image: Array,
    outline: Array,
    count: int,
    color: list[float],
    rng: np.random.Generator,
) -> Array:
    """Discs as large as the marker, of other hues, beside it."""
    hue = marker_lab(color)[2]
    middle = outline.mean(axis=0)
    size = np.ptp(outline, axis=0).max() / 2
    added = 0
    while added < count:
        rgb = rng.integers(0, 256, 3)
        _, chroma, other = marker_lab((rgb / 255).tolist())
        apart = abs((other - hue + np.pi) % (2 * np.pi) - np.pi)
        uv = rng.uniform([0, 0], image.shape[1::-1])
        axes = size * rng.uniform(0.6, 1.3, 2)
        if chroma < 25 or apart < np.deg2rad(40):
            continue
        if np.linalg.norm(uv - middle) < 2.4 * size + 4:
            continue
        image = add_disc(image, uv, axes, rgb)
        added += 1
    return image


def hide_part(
    image: Array, outline: Array, part: float, rng: np.random.Generator
) -> Array:
    """Something skin-colored and round over a part of the marker."""
    low, high = np.floor(outline.min(0)) - 1, np.ceil(outline.max(0)) + 1
    size = (high - low).astype(int) + 1
    marker = np.zeros(size[::-1], np.uint8)
    cv2.fillPoly(marker, [np.rint(outline - low).astype(np.int32)], 1)
    angle = rng.uniform(0, 2 * np.pi)
    way = np.array([np.cos(angle), np.sin(angle)])
    radius = 1.5 * np.ptp(outline, axis=0).max()
    middle = outline.mean(axis=0)
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    pixels = np.stack([u, v], -1) + low
    # As far off that it hides that part.
    near, far = 0.0, 2.0 * radius
    for _ in range(30):
        distance = 0.5 * (near + far)
        hidden = (
            np.linalg.norm(pixels - middle - distance * way, axis=-1) < radius
        )
        if hidden[marker > 0].mean() > part:
            near = distance
        else:
            far = distance
    return add_disc(
        image, middle + distance * way, np.array([radius, radius]), SKIN
    )


Disturb = Callable[[Array, Array, np.random.Generator], Array]


def disturbances(config: BlobConfig) -> dict[str, list[tuple[str, Disturb]]]:
    """Name -> three strengths, each with its label and what it does."""

    def effects(**values) -> Disturb:
        return lambda image, outline, rng: apply_effects(
            image,
            ImageEffects(**values),
            seed=int(rng.integers(2**31)),
        )

    def blur(length: float) -> Disturb:
        def apply(image, outline, rng):
            angle = rng.uniform(0, np.pi)
            way = [length * np.cos(angle), length * np.sin(angle)]
            return apply_effects(image, ImageEffects(motion_blur=way))

        return apply

    return {
        "none": [("", effects())],
        "brighter": [
            (f"+{s} stop", effects(exposure=s)) for s in (0.5, 1.0, 1.5)
        ],
        "darker": [
            (f"-{s} stop", effects(exposure=-s)) for s in (0.5, 1.0, 2.0)
        ],
        "warm light": [
            (f"{r:.2f}/1/{b:.2f}", effects(white_balance=[r, 1.0, b]))
            for r, b in ((1.15, 0.85), (1.3, 0.65), (1.5, 0.45))
        ],
        "cool light": [
            (f"{r:.2f}/1/{b:.2f}", effects(white_balance=[r, 1.0, b]))
            for r, b in ((0.85, 1.15), (0.65, 1.3), (0.45, 1.5))
        ],
        "sensor noise": [
            (f"sd {s}", effects(noise=float(s))) for s in (4, 8, 16)
        ],
        "motion blur": [(f"{s} px", blur(s)) for s in (3.0, 6.0, 12.0)],
        "distractors": [
            (
                f"{n} discs",
                lambda i, o, rng, n=n: add_distractors(
                    i, o, n, config.color, rng
                ),
            )
            for n in (2, 5, 10)
        ],
        "partly hidden": [
            (
                f"{part:.0%}",
                lambda i, o, rng, part=part: hide_part(i, o, part, rng),
            )
            for part in (0.1, 0.25, 0.4)
        ],
    }


def collect(name: str, places: int, seed: int) -> list[tuple]:
    """Images of a scenario with the marker wholly seen:

    Each is (image, uv, outline).
    """
    view = ViewDomain.of(name)
    rng = np.random.default_rng(seed)
    scenario = view.station.scenario
    camera = view.station.camera.GetMyMutableContextFromRoot(view.context)
    view.station.camera.set_effects(camera, ImageEffects())
    (x0, x1), (y0, y1) = scenario.drum_region.x, scenario.drum_region.y
    model = view.sight.model
    size = np.array([model.camera.width, model.camera.height])
    found = []
    while len(found) < places:
        xy = rng.uniform([x0, y0], [x1, y1])
        yaw = view.sight.looking_yaw(xy) + rng.uniform(-0.1, 0.1)
        view.station.set_drum_position(view.context, xy)
        turn_to(view.station, view.context, np.clip(yaw, -0.5, 0.5))
        yaw = float(np.clip(yaw, -0.5, 0.5))
        index, seen = model.seen_by(xy, yaw, view.sight.mirrors)
        mirror = None if index is None else view.sight.mirrors[index]
        angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
        rim = xy + model.marker_radius * np.stack(
            [np.cos(angle), np.sin(angle)], -1
        )
        outline = model.image_of(rim, yaw, mirror)
        if seen.whole < 1 or np.any(outline < 4) or np.any(outline > size - 5):
            continue
        image = view.station.GetOutputPort("camera.color_image").Eval(
            view.context
        )
        found.append((image.data[:, :, :3].copy(), seen.uv, outline))
    return found


def main() -> None:
    """Measures, prints and draws."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("out/perception_robustness")
    )
    parser.add_argument("--places", type=int, default=40)
    args = parser.parse_args()
    out = prepare_output(args.out)
    lines = [
        "| view | disturbance | strength | found | false | error [px]: "
        "median | 95 % |",
        "|---|---|---|---|---|---|---|",
    ]
    sheet = []
    for name in ("drumming", "mirror"):
        images = collect(name, args.places, seed=1)
        config = BlobConfig()
        row = []
        for kind, strengths in disturbances(config).items():
            for label, disturb in strengths:
                rng = np.random.default_rng(7)
                errors, false = [], 0
                for image, uv, outline in images:
                    disturbed = disturb(image, outline, rng)
                    blob = detect(disturbed, config)
                    if blob is None:
                        continue
                    error = np.hypot(blob.u - uv[0], blob.v - uv[1])
                    if error < 10:
                        errors.append(error)
                    else:
                        false += 1
                canvas = Canvas(disturbed, 1)
                canvas.blob(
                    np.zeros(4)
                    if blob is None
                    else np.array([blob.u, blob.v, blob.area, 1.0])
                )
                row.append(canvas.image)
                middle, high = (
                    np.quantile(errors, [0.5, 0.95])
                    if errors
                    else (np.nan,) * 2
                )
                lines.append(
                    f"| {name} | {kind} | {label} | "
                    f"{len(errors) / len(images):.0%} | "
                    f"{false / len(images):.0%} | {middle:.2f} | {high:.2f} |"
                )
                print(lines[-1], flush=True)
        sheet.append(row)
    columns = 7
    tiles = [image for row in sheet for image in row]
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % columns)
    write_image(
        out / "examples.png",
        np.vstack(
            [
                np.hstack(tiles[i : i + columns])
                for i in range(0, len(tiles), columns)
            ]
        ),
    )
    write_text_atomic(out / "table.md", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
