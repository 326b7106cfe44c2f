"""Maps from changed views to the first one."""

import numpy as np
import pytest

from drake_affetto.experiments import view_maps
from drake_affetto.geometry.region import grid_inside
from drake_affetto.perception.knowledge import CalibrationError


@pytest.fixture(scope="module")
def reference():
    return view_maps.ViewDomain.of(view_maps.REFERENCE)


@pytest.fixture(scope="module")
def mirror(reference):
    return view_maps.measure_true_map(
        view_maps.ViewDomain.of("mirror"), reference, n=6
    )


def some(n=30, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (n, 2))


def test_each_fit_finds_a_map_of_its_kind():
    X, Z = some(), some(seed=1)
    H, c = np.array([[1.0, 0.4], [-0.3, 2.0]]), np.array([0.2, -1.0])

    def affine(X):
        return X @ H.T + c

    def projective(X):
        return affine(X) / (1 + X @ [0.2, -0.1])[:, None]

    def quadratic(X):
        return affine(X) + np.stack([X[:, 0] ** 2, X[:, 0] * X[:, 1]], -1)

    for true, fits, others in (
        (
            affine,
            (
                view_maps.fit_affine,
                view_maps.fit_projective,
                view_maps.fit_quadratic,
            ),
            (),
        ),
        (projective, (view_maps.fit_projective,), (view_maps.fit_affine,)),
        (
            quadratic,
            (view_maps.fit_quadratic,),
            (view_maps.fit_affine, view_maps.fit_projective),
        ),
    ):
        for fit in fits:
            predicted = fit(X, true(X)).predict(Z)
            np.testing.assert_allclose(predicted, true(Z), atol=1e-5)
        for fit in others:
            predicted = fit(X, true(X)).predict(Z)
            assert np.abs(predicted - true(Z)).max() > 0.01


@pytest.mark.parametrize("name", view_maps.CHANGED_VIEWS)
def test_each_changed_view_sees_all_of_its_region(name, reference):
    view = view_maps.ViewDomain.of(name)
    true = view_maps.measure_true_map(view, reference, n=3)
    corners = view.station.scenario.drum_region.corners
    assert len(true.target) == len(grid_inside(corners, 3))
    # Rendered and geometric pixels agree: nothing hides the marker.
    assert np.all(view.rendered_error(corners) < 0.5)


@pytest.mark.parametrize(
    ("name", "affine"),
    [
        ("camera_rolled", True),
        ("camera_replaced", True),
        ("head_turned", True),
        ("mirror", False),
        ("mirror_moved", False),
        ("mirror_and_camera", False),
        ("wide_angle", False),
    ],
)
def test_each_view_is_a_change_and_affine_or_clearly_not(
    name, affine, reference
):
    true = view_maps.measure_true_map(
        view_maps.ViewDomain.of(name), reference, n=6
    )
    # Beyond the head and most of the hand that sounds it.
    beside = true.distance(true.target)
    assert np.mean(~(beside < 0.045)) > 0.5
    best = view_maps.fit_affine(true.target, true.source)
    worst = true.distance(best.predict(true.target)).max()
    # A stroke's own scatter is 1 cm.
    assert worst < 0.01 if affine else worst > 0.04


def test_places_are_those_of_the_drum(reference):
    xy = reference.sight.positions[::7]
    tau = reference.task_parameters(xy)
    # The centroid is not quite the center: a millimeter.
    np.testing.assert_allclose(
        view_maps.places_of(reference, tau), xy, atol=3e-3
    )


def test_the_optical_map_explains_the_mirror_and_the_affine_does_not(mirror):
    optical = view_maps.make_optical_map(mirror.view, mirror.reference)
    noise = view_maps.measurement_noise(mirror.reference)
    few = [0, 5, 12, 20]
    X, Y = mirror.target[few], mirror.source[few]
    fit = view_maps.fit_optical(X, Y, optical, noise)
    assert mirror.distance(fit.predict(mirror.target)).max() < 0.003
    affine = view_maps.fit_affine(mirror.target, mirror.source)
    assert mirror.distance(affine.predict(mirror.target)).max() > 0.01


def test_more_samples_are_no_worse_and_the_same_seed_gives_the_same(mirror):
    noise = (
        view_maps.measurement_noise(mirror.view),
        view_maps.measurement_noise(mirror.reference),
    )
    curves = [
        view_maps.learn_from_few(
            mirror,
            lambda X, Y, rng: view_maps.fit_affine(X, Y),
            "affine",
            [3, 12],
            15,
            noise,
        )
        for _ in range(2)
    ]
    np.testing.assert_array_equal(curves[0].errors, curves[1].errors)
    few, many = np.median(curves[0].errors, axis=1)
    assert many < few


def test_the_optical_map_with_a_wrong_camera_is_another_one(mirror):
    optical = view_maps.make_optical_map(mirror.view, mirror.reference)
    true = optical.parameters_of(mirror.view.sight.mirrors[0].X_WM)

    def furthest(error):
        wrong = view_maps.with_wrong_camera(
            optical, error, np.random.default_rng(0)
        )
        guessed = wrong.apply(true, mirror.target)
        return float(mirror.distance(guessed).max())

    exact = furthest(CalibrationError())
    assert exact < 0.003
    for name, size in (
        ("focal", 0.05),
        ("angle", 0.02),
        ("position", 0.01),
        ("height", 0.01),
        ("neck", 0.01),
    ):
        assert furthest(CalibrationError(**{name: size})) > exact + 1e-4, name
