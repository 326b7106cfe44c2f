"""A map from the mirror's view to the direct view that knows optics.

What is not known is the mirror's plane, three numbers; the camera, its joint
and the height of the marker are given. A pixel of the mirrored marker is a ray;
reflected in the plane it meets the marker's level at a place on the table;
from there the direct view follows: the yaw that centers the marker, and the
height at which it then is in the image.
"""

import dataclasses
from typing import Any

import numpy as np

from drake_affetto.common.errors import require_array
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.geometry import optics
from drake_affetto.geometry.planes import (
    normal_slopes,
    normals,
    plane_parameters,
)
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.camera_model import CameraModel, turn_points

# Rays that hardly fall are taken to fall this steeply, so that a search that
# strays meets a level far away rather than nowhere.
_LEAST_FALL = 0.03
_LEVEL_UP = np.array([0.0, 0.0, 1.0])


@dataclasses.dataclass
class PlaneExpectation:
    """Where a mirror may stand, before it has been looked into.

    Attributes:
        foot: a place [x, y, z], in the world, m, by which its plane passes.
        foot_sd: standard deviation of the plane's distance from it, m.
        lean: elevation of the mirror's normal, rad; 0 stands upright.
        lean_sd: standard deviation of it, rad.
    """

    foot: list[float] = dataclasses.field(
        default_factory=lambda: [0.35, 0.3, 0.0]
    )
    foot_sd: float = number(0.1, 1e-4, 100.0)
    lean: float = number(0.0, -1.5, 1.5)
    lean_sd: float = number(0.2, 1e-4, 10.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        require_array(f"{where}.foot", self.foot, (3,))


@dataclasses.dataclass(frozen=True)
class OpticalMap:
    """h(x; p): from τ̂ = [x_img, y_img] in the mirror to τ = [y_img, q₃*].

    The parameters p = (ψ, ε, s) are azimuth and elevation [rad] of the
    mirror's normal, n = (cos ε cos ψ, cos ε sin ψ, sin ε), and the distance s
    [m] of the camera from the mirror's plane.

    Attributes:
        target: the sight in which the mirror is looked into; its camera may
            have a lens.
        target_calibration: of x_img and y_img there.
        yaw: the fixed yaw [rad] there.
        source: the sight in which the skill was learned; its camera must be
            without distortion, its marker in the middle of the image.
        source_calibration: of y_img there.
        plane: where the mirror may stand; None if nothing is known of it.
    """

    target: CameraModel
    target_calibration: BlobCalibration
    yaw: float
    source: CameraModel
    source_calibration: BlobCalibration
    plane: PlaneExpectation | None = None

    def count(self, n_in: int, n_out: int) -> int:
        """Number of parameters, 3.

        Raises:
            ValueError: unless n_in and n_out are 2.
        """
        if (n_in, n_out) != (2, 2):
            raise ValueError(
                f"the optical map maps 2 inputs to 2, not {n_in} to {n_out}"
            )
        return 3

    def apply(self, parameters: Array, X: Array) -> Array:
        """h(X): parameters (3,), X (N, 2) to (N, 2).

        Args:
            parameters: The plane's three numbers.
        """
        return self._evaluate(parameters, X)[0]

    def derivative(self, parameters: Array, X: Array) -> Array:
        """∂h/∂p: parameters (3,), X (N, 2) to (N, 2, 3).

        Args:
            parameters: The plane's three numbers.
        """
        return self._evaluate(parameters, X)[1]

    def place(self, parameters: Array, X: Array) -> Array:
        """Where on the table, xy (N, 2) [m], the marker seen at X (N, 2) is.

        Args:
            parameters: The plane's three numbers.
        """
        eye, ray = self._rays(X)
        return self._reflect(parameters, eye, ray)[0][:, :2]

    def parameters_of(self, X_WM: Array) -> Array:
        """The parameters (3,) of a mirror at the pose X_WM (4, 4)."""
        eye = self.target.camera_pose(self.yaw)[:3, 3]
        return plane_parameters(X_WM, eye)

    def starts(
        self, target: Any, source: Any, n_starts: int, random: Any
    ) -> list[tuple[str, Array]]:
        """Planes that show the middle of one domain at that of the other.

        For a way of light of a given length there is just one such plane.

        Args:
            target: domain of X; its `mean` (2,) is used.
            source: domain of τ; its `mean` (2,) is used.
            n_starts: at most how many.
            random: not needed.

        Returns:
            Named parameters (3,).
        """
        del random
        eye, ray = self._rays(np.asarray(target.mean)[None])
        yaw = float(source.mean[1])
        u = self.source.camera.image_center[0]
        unit = self.source_calibration
        v = unit.v_min + source.mean[0] * (unit.v_max - unit.v_min)
        p = self.source.locate(np.array([u, v]), yaw)
        if not np.all(np.isfinite(p)):
            p = self.source.marker(np.array([0.25, 0.0]))
        direct = float(np.linalg.norm(p - eye))
        named = []
        # From little more than the straight way to a mirror far away.
        for way in direct * np.geomspace(1.1, 4.0, 60):
            image = eye + way * ray[0]
            n = (p - image) / np.linalg.norm(p - image)
            reflected = ray[0] - 2.0 * (ray[0] @ n) * n
            if reflected[2] > -2.0 * _LEAST_FALL:
                continue  # The light would come from below the marker.
            s = (eye - 0.5 * (p + image)) @ n
            parameters = np.array([np.arctan2(n[1], n[0]), np.arcsin(n[2]), s])
            named.append((f"way {way:.2f} m", parameters))
        if not named:
            level = np.array([0.0, 0.0, 0.3])  # straight across, 0.3 m away
            return [("across", level)]
        chosen = np.linspace(0, len(named) - 1, min(n_starts, len(named)))
        return [named[round(i)] for i in chosen]

    def unexpected(self, parameters: Array) -> tuple[Array, Array] | None:
        """How far planes are from where a mirror is expected.

        Args:
            parameters: (S, 3).

        Returns:
            Residuals (S, 2) by foot and lean, in standard deviations, and
            their derivatives (S, 2, 3); None if nothing is known.
        """
        if self.plane is None:
            return None
        azimuth, elevation, s = np.asarray(parameters, dtype=float).T
        way = self.plane.foot - self.target.camera_pose(self.yaw)[:3, 3]
        ca, sa = np.cos(azimuth), np.sin(azimuth)
        ce, se = np.cos(elevation), np.sin(elevation)
        level = ca * way[0] + sa * way[1]
        across = ca * way[1] - sa * way[0]
        zero, one = np.zeros_like(s), np.ones_like(s)
        residual = np.stack(
            [
                (ce * level + se * way[2] + s) / self.plane.foot_sd,
                (elevation - self.plane.lean) / self.plane.lean_sd,
            ],
            axis=-1,
        )
        slope = np.stack([ce * across, ce * way[2] - se * level, one], axis=-1)
        return residual, np.stack(
            [
                slope / self.plane.foot_sd,
                np.stack([zero, one, zero], axis=-1) / self.plane.lean_sd,
            ],
            axis=1,
        )

    def _rays(self, X: Array) -> tuple[Array, Array]:
        """The eye (3,) and unit vectors (N, 3) to what is seen at X, in W."""
        uv = self.target_calibration.pixels(X)
        X_WC = self.target.camera_pose(self.yaw)
        return X_WC[:3, 3], self.target.camera.direction(uv) @ X_WC[:3, :3].T

    def _reflect(
        self, parameters: Array, eye: Array, ray: Array
    ) -> tuple[Array, Array]:
        """p_W (N, 3) of the marker, and its derivative (N, 3, 3)."""
        parameters = np.asarray(parameters, dtype=float)
        n, s = normals(parameters), parameters[2]
        # Columns: by azimuth, elevation and distance.
        dn = np.zeros((3, 3))
        dn[:, :2] = normal_slopes(parameters)
        origin = eye - 2.0 * s * n
        d_origin = -2.0 * (s * dn + np.outer(n, [0.0, 0.0, 1.0]))
        along = ray @ n
        d_along = ray @ dn
        direction = ray - 2.0 * along[:, None] * n
        d_direction = -2.0 * (
            n[:, None] * d_along[:, None, :] + along[:, None, None] * dn
        )
        height = self.target.marker_height
        fall = direction[:, 2]
        steep = fall < -_LEAST_FALL
        fall = np.where(steep, fall, -_LEAST_FALL)
        d_fall = np.where(steep[:, None], d_direction[:, 2], 0.0)
        t = (height - origin[2]) / fall
        d_t = (-d_origin[2] - t[:, None] * d_fall) / fall[:, None]
        p = origin + t[:, None] * direction
        d_p = (
            d_origin
            + direction[:, :, None] * d_t[:, None, :]
            + t[:, None, None] * d_direction
        )
        # On the level, also where the ray was taken to be steeper.
        p[:, 2], d_p[:, 2] = height, 0.0
        return p, d_p

    def _evaluate(self, parameters: Array, X: Array) -> tuple[Array, Array]:
        eye, ray = self._rays(np.asarray(X, dtype=float))
        p, d_p = self._reflect(parameters, eye, ray)
        source = self.source
        yaw = source.centering_yaw(p)
        # Where nothing centers it the nearest that can be said is the bearing.
        p_A = optics.transform_points(optics.invert_pose(source.X_WA), p)
        yaw = np.where(np.isfinite(yaw), yaw, np.arctan2(p_A[:, 1], p_A[:, 0]))
        turned = turn_points(source.axis, -yaw, p_A)
        X_CA = optics.invert_pose(source.X_AC)
        p_C = optics.transform_points(X_CA, turned)
        # How p_C changes with p and with the yaw.
        by_yaw = np.cross(turned, source.axis) @ X_CA[:3, :3].T
        d_p_A = np.einsum("ij,njk->nik", source.X_WA[:3, :3].T, d_p)
        back = np.stack(
            [turn_points(source.axis, -yaw, d_p_A[:, :, k]) for k in range(3)],
            axis=-1,
        )
        by_p = np.einsum("ij,njk->nik", X_CA[:3, :3], back)
        # The middle column of a pinhole's image is the plane m·p_C = 0.
        camera = source.camera
        middle = camera.image_center[0] + 0.5 - camera.center_x
        m = np.array([camera.focal_x, 0.0, -middle])
        slope = by_yaw @ m
        slope = np.where(np.abs(slope) > 1e-9, slope, 1e-9)
        d_yaw = -np.einsum("i,nik->nk", m, by_p) / slope[:, None]
        d_p_C = by_p + by_yaw[:, :, None] * d_yaw[:, None, :]
        z = np.maximum(p_C[:, 2], 1e-3)
        v = camera.focal_y * p_C[:, 1] / z + camera.center_y - 0.5
        d_v = (camera.focal_y / z)[:, None] * (
            d_p_C[:, 1] - (p_C[:, 1] / z)[:, None] * d_p_C[:, 2]
        )
        unit = self.source_calibration.v_max - self.source_calibration.v_min
        y = (v - self.source_calibration.v_min) / unit
        return (
            np.stack([y, yaw], axis=-1),
            np.stack([d_v / unit, d_yaw], axis=1),
        )
