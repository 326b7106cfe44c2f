"""How the task parameters of a changed view relate to those of the first.

For each scenario of a changed view, the true map from its task parameters τ̂
to those τ that the skill was learned with is measured over the drum's region,
and maps of several kinds are fitted to it. Errors are told as the distance on
the table between the drum and where it would be taken to be.
"""

from collections.abc import Callable
import dataclasses

import numpy as np
from pydrake.systems.framework import Context
from scipy.optimize import least_squares

from drake_affetto.common.errors import require
from drake_affetto.common.typing import Array
from drake_affetto.experiments.camera_preview import (
    GazeGeometry,
    make_gaze_geometry,
    turn_to,
)
from drake_affetto.geometry.region import grid_inside
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.knowledge import CalibrationError, believed
from drake_affetto.perception.optical_map import OpticalMap
from drake_affetto.scene.parts import find_frame
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation

CHANGED_VIEWS = (
    "mirror",
    "mirror_moved",
    "mirror_and_camera",
    "camera_rolled",
    "camera_replaced",
    "robot_moved",
    "wide_angle",
)
REFERENCE = "drumming"


@dataclasses.dataclass
class ViewDomain:
    """A scenario's station, and the geometry of its seeing."""

    name: str
    station: AffettoStation
    context: Context
    sight: GazeGeometry

    @classmethod
    def of(cls, name: str) -> "ViewDomain":
        """Builds the station of the scenario `name`."""
        station = AffettoStation(load_scenario(name))
        context = station.CreateDefaultContext()
        return cls(name, station, context, make_gaze_geometry(station, context))

    @property
    def calibration(self) -> BlobCalibration:
        """The scenario's calibration of the blob."""
        return self.station.scenario.blob.calibration

    def task_parameters(self, xy: Array) -> Array:
        """(n, 2) for drums at xy (n, 2) in the world, by geometry."""
        return self.sight.task_parameters(xy, self.calibration)

    def base_pose(self) -> Array:
        """X_WB (4, 4) of the robot's base."""
        frame = find_frame(self.station.plant, "affetto_base")
        context = self.station.plant.GetMyContextFromRoot(self.context)
        return frame.CalcPoseInWorld(context).GetAsMatrix4()

    def rendered_error(self, xy: Array) -> Array:
        """(n,) distance [pixels] of the rendered blob from geometry's.

        NaN where no blob is found.
        """
        errors = np.full(len(xy), np.nan)
        for i, place in enumerate(xy):
            self.station.set_drum_position(self.context, place)
            yaw = self.sight.looking_yaw(place)
            turn_to(self.station, self.context, yaw)
            port = self.station.GetOutputPort("camera.blob_pixels")
            pixels = port.Eval(self.context)
            view = self.sight.model.seen_by(place, yaw, self.sight.mirrors)[1]
            if pixels[2] > 0:
                errors[i] = np.hypot(*(pixels[:2] - view.uv))
        return errors


@dataclasses.dataclass
class TrueMap:
    """What a changed view's task parameters stand for.

    Attributes:
        view: the changed view.
        xy: (n, 2) places of the drum, relative to the robot's base as the
            reference scenario has it [m].
        target: (n, 2) τ̂ there.
        source: (n, 2) τ there.
        reference: the view in which the skill was learned.
    """

    view: ViewDomain
    xy: Array
    target: Array
    source: Array
    reference: ViewDomain

    def distance(self, guessed: Array) -> Array:
        """(n,) distance [m] on the table of guessed τ (n, 2) from the true."""
        return np.linalg.norm(
            places_of(self.reference, guessed)
            - places_of(self.reference, self.source),
            axis=1,
        )


def places_of(view: ViewDomain, tau: Array) -> Array:
    """xy (n, 2) [m] of the drum for τ = [y_img, q₃*] (n, 2) in a view."""
    model, box = view.sight.model, view.calibration
    places = []
    for y, yaw in np.asarray(tau):
        v = box.v_min + y * (box.v_max - box.v_min)
        uv = np.array([model.camera.image_center[0], v])
        places.append(model.locate(uv, yaw)[:2])
    return np.array(places)


def measure_true_map(
    view: ViewDomain, reference: ViewDomain, n: int = 9
) -> TrueMap:
    """The true map over the changed view's drum region, a grid of n × n.

    The same task is the same place relative to the robot: where its base has
    moved, the reference is asked for the place that then corresponds.
    """
    xy = grid_inside(view.station.scenario.drum_region.corners, n)
    X_RW = reference.base_pose() @ np.linalg.inv(view.base_pose())
    in_reference = xy @ X_RW[:2, :2].T + X_RW[:2, 3]
    target = view.task_parameters(xy)
    source = reference.task_parameters(in_reference)
    seen = np.all(np.isfinite(np.hstack([target, source])), axis=1)
    return TrueMap(
        view, in_reference[seen], target[seen], source[seen], reference
    )


# Maps


@dataclasses.dataclass(frozen=True)
class Fit:
    """A fitted map.

    Attributes:
        name: of the kind of map.
        predict: from τ̂ (n, 2) to τ (n, 2).
    """

    name: str
    predict: Callable[[Array], Array]


def fit_affine(X: Array, Y: Array) -> Fit:
    """τ = H τ̂ + c by least squares."""
    return Fit("affine", _linear(X, Y, _affine_terms))


def fit_quadratic(X: Array, Y: Array) -> Fit:
    """All terms of τ̂ up to the second degree, by least squares."""
    return Fit("quadratic", _linear(X, Y, _quadratic_terms))


def fit_projective(X: Array, Y: Array) -> Fit:
    """τ = (H τ̂ + c) / (1 + g·τ̂), by least squares from the affine map."""
    terms = _affine_terms(X)
    affine = np.linalg.lstsq(terms, Y, rcond=None)[0]

    def predict(parameters: Array, X: Array) -> Array:
        linear, g = parameters[:6].reshape(3, 2), parameters[6:]
        below = 1.0 + (X - X0) @ g
        return (_affine_terms(X) @ linear) / below[:, None]

    X0 = X.mean(axis=0)
    start = np.append(affine.ravel(), [0.0, 0.0])
    scale = np.maximum(Y.std(axis=0), 1e-9)
    fit = least_squares(lambda p: ((predict(p, X) - Y) / scale).ravel(), start)
    return Fit("projective", lambda Z: predict(fit.x, Z))


def fit_optical(
    X: Array,
    Y: Array,
    optical: OpticalMap,
    noise: Array,
    n_starts: int = 6,
) -> Fit:
    """The mirror's plane that explains the samples best.

    Args:
        X: (n, 2) τ̂.
        Y: (n, 2) τ.
        optical: the map.
        noise: (2,) how exactly each of τ is known.
        n_starts: from how many planes to search.
    """
    target, source = _Mean(X.mean(axis=0)), _Mean(Y.mean(axis=0))
    fits = [
        least_squares(
            lambda p: ((optical.apply(p, X) - Y) / noise).ravel(),
            start,
            lambda p: (optical.derivative(p, X) / noise[:, None]).reshape(
                -1, 3
            ),
        )
        for _, start in optical.starts(target, source, n_starts, None)
    ]
    best = min(fits, key=lambda fit: fit.cost)
    return Fit("optical", lambda Z: optical.apply(best.x, Z))


@dataclasses.dataclass(frozen=True)
class _Mean:
    """As much of a domain as the optical map's starts need."""

    mean: Array


def _affine_terms(X: Array) -> Array:
    return np.column_stack([X, np.ones(len(X))])


def _quadratic_terms(X: Array) -> Array:
    x, y = X.T
    return np.column_stack([x, y, np.ones(len(X)), x * x, x * y, y * y])


def _linear(
    X: Array, Y: Array, terms: Callable[[Array], Array]
) -> Callable[[Array], Array]:
    # Scaled, so that with too few samples the smallest map is meant evenly.
    middle, size = X.mean(axis=0), np.maximum(np.ptp(X, axis=0), 1e-9)
    offset = Y.mean(axis=0)
    weights = np.linalg.lstsq(
        terms((X - middle) / size), Y - offset, rcond=None
    )[0]
    return lambda Z: terms((Z - middle) / size) @ weights + offset


def make_optical_map(view: ViewDomain, reference: ViewDomain) -> OpticalMap:
    """The optical map of a mirrored view, everything but the mirror known.

    Raises:
        InputError: If the view is not one from a fixed yaw.
    """
    yaw = view.sight.fixed_yaw
    require(
        yaw is not None,
        f"{view.name}.transfer.mapping",
        "optical",
        "another map where the robot turns to the drum",
    )
    assert yaw is not None
    return OpticalMap(
        view.sight.model,
        view.calibration,
        yaw,
        reference.sight.model,
        reference.calibration,
    )


def with_wrong_camera(
    optical: OpticalMap, error: CalibrationError, rng: np.random.Generator
) -> OpticalMap:
    """The optical map with the camera known wrongly, see `believed`."""
    target, source = believed((optical.target, optical.source), error, rng)
    return dataclasses.replace(optical, target=target, source=source)


@dataclasses.dataclass(frozen=True)
class SampleCurve:
    """Errors of maps learned from few samples.

    Attributes:
        name: of the map.
        samples: (k,) numbers of samples.
        errors: (k, repeats) root mean square distances [m] over the region.
    """

    name: str
    samples: Array
    errors: Array


def learn_from_few(
    true: TrueMap,
    fit: Callable[[Array, Array, np.random.Generator], Fit],
    name: str,
    samples: list[int],
    repeats: int,
    noise: tuple[Array, Array],
    seed: int = 0,
) -> SampleCurve:
    """Fits a map to a few noisy samples, many times.

    Args:
        true: the map to be learned; samples are drawn from its places.
        fit: from τ̂ (n, 2), τ (n, 2) and a generator to a map.
        name: of the map.
        samples: numbers of samples to try.
        repeats: how often each.
        noise: standard deviations of τ̂ and of τ, each (2,).
        seed: of samples and noise; the same for all maps.
    """
    errors = np.full((len(samples), repeats), np.nan)
    for i, n in enumerate(samples):
        for r in range(repeats):
            rng = np.random.default_rng([seed, n, r])
            chosen = rng.choice(len(true.target), n, replace=False)
            X = true.target[chosen] + noise[0] * rng.normal(size=(n, 2))
            Y = true.source[chosen] + noise[1] * rng.normal(size=(n, 2))
            guessed = fit(X, Y, rng).predict(true.target)
            distance = true.distance(guessed)
            # A guess that lies nowhere on the table is as wrong as can be.
            distance = np.where(np.isfinite(distance), distance, 0.3)
            errors[i, r] = np.sqrt(np.mean(np.minimum(distance, 0.3) ** 2))
    return SampleCurve(name, np.array(samples), errors)


def measurement_noise(view: ViewDomain) -> Array:
    """(2,) what the gaze servo leaves uncertain of a view's τ, as measured.

    0.1 pixels in the image and 0.001 rad of yaw.
    """
    box = view.calibration
    x = 0.1 / (box.u_max - box.u_min)
    y = 0.1 / (box.v_max - box.v_min)
    return np.array([y, 1e-3] if view.sight.fixed_yaw is None else [x, y])
