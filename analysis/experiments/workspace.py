"""Computes and draws where the drum can be struck and seen, from above.

python analysis/experiments/workspace.py [--out out/workspace.png] [--step 0.01]
"""

import argparse
import dataclasses
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib.patches import Circle, Ellipse, Patch, Polygon, Rectangle
import matplotlib.pyplot as plt
import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_affetto.experiments.workspace import (
    Workspace,
    WorkspaceConfig,
    compute_workspace,
    usable_polygon,
)
from drake_affetto.geometry.optics import polygon_area
from drake_affetto.scene import world
from drake_affetto.station.drum_region import DrumRegion
from drake_affetto.station.scenario import Scenario, load_scenario

_REGIONS = (
    ("reach", "the hand strikes it from above", "#1f77b4"),
    ("sees", "the camera sees the marker", "#2ca02c"),
    ("sees_mirror", "the mirror shows the marker", "#9467bd"),
)


def workspace_config(
    direct: Scenario, mirror: Scenario, step: float
) -> WorkspaceConfig:
    """What the two scenarios ask of a position of the drum."""
    return WorkspaceConfig(
        active_joints=direct.active_joints,
        yaw_joint=direct.yaw_joint,
        direct_posture=direct.world.default_posture,
        mirror_posture={
            **mirror.world.default_posture,
            mirror.yaw_joint: mirror.look.fixed_yaw,
        },
        width=direct.camera.width,
        height=direct.camera.height,
        fov_y=direct.camera.fov_y,
        step=step,
    )


def draw(
    plant,
    context,
    workspace: Workspace,
    region: DrumRegion,
    path: Path,
) -> None:
    """Draws the scene from above, x (forward) up and y (left) to the left."""
    fig, ax = plt.subplots(figsize=(8.2, 7.6), layout="constrained")
    low, high = world.table_extents(plant, context)
    ax.add_patch(
        Rectangle(
            (low[1], low[0]),
            high[1] - low[1],
            high[0] - low[0],
            facecolor="#f1e2cf",
            edgecolor="#8a6238",
        )
    )
    ax.text(high[1] - 0.01, high[0] - 0.012, "table", color="#8a6238", va="top")
    handles = []
    x, y = workspace.x, workspace.y
    ax.contourf(
        y, x, workspace.usable, levels=[0.5, 1.5], colors=["#ffd92f"], alpha=0.7
    )
    handles.append(Patch(facecolor="#ffd92f", alpha=0.7, label="all of them"))
    for name, label, color in _REGIONS:
        mask = np.asarray(getattr(workspace, name), dtype=float)
        padded = np.pad(mask, 1)
        step = x[1] - x[0]
        xs = np.concatenate([[x[0] - step], x, [x[-1] + step]])
        ys = np.concatenate([[y[0] - step], y, [y[-1] + step]])
        ax.contour(ys, xs, padded, levels=[0.5], colors=[color], linewidths=2)
        handles.append(
            Patch(facecolor="none", edgecolor=color, lw=2, label=label)
        )
    ax.add_patch(
        Polygon(
            region.corners[:, ::-1],
            fill=False,
            edgecolor="k",
            linestyle="--",
            lw=1.5,
        )
    )
    handles.append(
        Patch(
            facecolor="none",
            edgecolor="k",
            ls="--",
            label="where trials put it",
        )
    )
    center = region.middle
    ax.add_patch(
        Circle(
            center[::-1],
            world.drum_radius(plant, context),
            facecolor="#b22222",
            alpha=0.18,
            edgecolor="none",
        )
    )
    ax.text(center[1], center[0], "drum", ha="center", va="center")
    # Mirror: where the glass stands and how far it leans
    X_WM = plant.GetFrameByName("mirror").CalcPoseInWorld(context)
    w, h = 0.5 * world.mirror_size(plant, context)
    corners = np.array([[-w, -h, 0], [w, -h, 0], [w, h, 0], [-w, h, 0]])
    p = X_WM.rotation().matrix() @ corners.T + X_WM.translation()[:, None]
    ax.fill(p[1], p[0], color="#a9c4d4", alpha=0.8)
    ax.plot(p[1, :2], p[0, :2], color="#4a2f1a", lw=3)
    ax.text(p[1].mean(), p[0].mean(), "mirror", ha="center", va="center")
    # Robot
    position = {
        name: plant.GetFrameByName(name).CalcPoseInWorld(context).translation()
        for name in (
            "right_elbow_flexion_link",
            "right_palm",
            "right_shoulder_flexion_link",
            "left_shoulder_flexion_link",
            "eye_camera",
        )
    }
    skin = "#e3a687"
    arm = np.array(
        [
            position["right_shoulder_flexion_link"],
            position["right_elbow_flexion_link"],
            position["right_palm"],
        ]
    )
    ax.add_patch(Ellipse((0, 0.01), 0.17, 0.11, color="#c9ccd1"))
    ax.plot(arm[:, 1], arm[:, 0], color=skin, lw=11, solid_capstyle="round")
    ax.plot(
        *position["left_shoulder_flexion_link"][1::-1], "o", color="#c9ccd1"
    )
    eye = position["eye_camera"]
    ax.add_patch(Ellipse((eye[1], eye[0] - 0.05), 0.14, 0.16, color="#5b4030"))
    ax.plot(eye[1], eye[0], "o", color="w", mec="k", ms=6)
    ax.text(position["right_palm"][1], arm[2, 0] + 0.02, "hand", ha="center")
    ax.set(
        xlim=(high[1] + 0.03, low[1] - 0.03),
        ylim=(-0.10, high[0] + 0.02),
        xlabel="y [m] (left is left)",
        ylabel="x [m] (forwards)",
        aspect="equal",
        title="Where the drum's center can be",
    )
    ax.legend(handles=handles, loc="lower left", framealpha=0.95)
    path.parent.mkdir(parents=True, exist_ok=True)
    fig.savefig(path, dpi=130)
    plt.close(fig)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/workspace.png"))
    parser.add_argument("--step", type=float, default=0.01, help="grid [m]")
    parser.add_argument(
        "--margin", type=float, default=0.015, help="off the limits [m]"
    )
    args = parser.parse_args()
    direct, mirror = load_scenario("drumming"), load_scenario("mirror")
    # The direct view's scene, but with the mirror in its place.
    scene = dataclasses.replace(direct.world, frames=mirror.world.frames)
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(direct.plant_config, builder)
    world.add_world(plant, scene)
    plant.Finalize()
    root = builder.Build().CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    result = compute_workspace(
        plant, context, workspace_config(direct, mirror, args.step)
    )
    usable = result.usable
    yaw = np.degrees(result.yaw[usable])
    area = result.mirror_area[usable]
    print(f"usable: {usable.sum() * (1e2 * args.step) ** 2:.0f} cm² of table")
    print(f"yaw that centers the marker: {yaw.min():.1f} .. {yaw.max():.1f}°")
    print(f"marker in the mirror: {area.min():.0f} .. {area.max():.0f} px²")
    corners = usable_polygon(result.x, result.y, usable, args.margin)
    print(
        f"with {1e2 * args.margin:g} cm to spare: "
        f"{1e4 * polygon_area(corners):.0f} cm², corners"
    )
    for corner in corners:
        print(f"- [{corner[0]:.3f}, {corner[1]:.3f}]")
    region = direct.drum_region
    print(
        f"the scenario's region: {1e4 * polygon_area(region.corners):.0f} cm²"
    )
    draw(plant, context, result, region, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
