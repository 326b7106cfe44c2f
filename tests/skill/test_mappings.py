"""Maps: their derivatives, and the starts they offer."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
from numpy.testing import assert_allclose
import pytest

from drake_affetto.skill import Affine, Domain, Similarity
from drake_affetto.skill.mappings import make_mapping

RANDOM = np.random.default_rng(0)


def domains(n_in, n_out):
    return (
        Domain.of_samples(RANDOM.normal(size=(20, n_in)) * 3.0 + 5.0),
        Domain.of_range([[-1.0, 1.0 + i] for i in range(n_out)]),
    )


@given(n_in=st.integers(1, 4), n_out=st.integers(1, 4), seed=st.integers(0, 99))
def test_affine(n_in, n_out, seed):
    random = np.random.default_rng(seed)
    affine = Affine()
    H, c = random.normal(size=(n_out, n_in)), random.normal(size=n_out)
    p = np.append(H.ravel(), c)
    X = random.normal(size=(6, n_in))
    assert affine.count(n_in, n_out) == p.size
    assert_allclose(affine.apply(p, X), X @ H.T + c, atol=1e-12)
    for known, found in zip((H, c), affine.split(p, n_in), strict=True):
        assert_allclose(found, known)
    # h is linear in its parameters.
    slope = affine.derivative(p, X)
    assert_allclose(slope @ p, affine.apply(p, X), atol=1e-12)


def test_similarity():
    p = np.array([0.0, 2.0, 5.0, -1.0, 1.0])
    similarity = Similarity()
    X = np.array([[1.0, 0.0], [0.0, 1.0]])
    # A quarter turn, twice as large, then shifted.
    assert_allclose(similarity.apply(p, X), [[5.0, 1.0], [3.0, -1.0]])
    p[4] = -1.0
    assert_allclose(similarity.apply(p, X), [[5.0, 1.0], [7.0, -1.0]])
    assert similarity.freedom(2, 2) == 4
    with pytest.raises(ValueError, match="2 inputs to 2"):
        similarity.count(3, 2)


@pytest.mark.parametrize("mapping", [Affine(), Similarity()])
def test_derivatives_by_central_differences(mapping):
    p = RANDOM.normal(size=mapping.count(2, 2))
    if isinstance(mapping, Similarity):
        p[4] = -1.0
    X = RANDOM.normal(size=(5, 2))
    slope = mapping.derivative(p, X)
    for k in range(mapping.freedom(2, 2)):
        step = 1e-6 * np.eye(p.size)[k]
        known = mapping.apply(p + step, X) - mapping.apply(p - step, X)
        assert_allclose(slope[..., k], known / 2e-6, atol=1e-8)


@pytest.mark.parametrize("mapping", [Affine(), Similarity()])
def test_batches_are_rows(mapping):
    many = RANDOM.normal(size=(4, mapping.count(2, 2)))
    X = RANDOM.normal(size=(5, 2))
    for batch, single in (
        (mapping.apply_many, mapping.apply),
        (mapping.derivative_many, mapping.derivative),
    ):
        assert_allclose(batch(many, X), [single(p, X) for p in many])


@pytest.mark.parametrize("count", [1, 2, 5, 32])
@pytest.mark.parametrize(
    ("mapping", "n_in", "n_out"),
    [
        (Affine(), 2, 2),
        (Affine(), 3, 2),
        (Affine(), 1, 3),
        (Affine(), 4, 4),
        (Similarity(), 2, 2),
    ],
)
def test_starts(mapping, n_in, n_out, count):
    target, source = domains(n_in, n_out)
    starts = mapping.starts(target, source, count, np.random.RandomState(0))
    assert 1 <= len(starts) <= count
    if isinstance(mapping, Affine):
        assert len(starts) == count
    assert starts[0][0] == "identity"
    identity = mapping.apply(starts[0][1], np.ones((1, n_in)))[0]
    assert_allclose(identity[: min(n_in, n_out)], 1.0)
    for _, p in starts[1:]:
        # All others take the middle of one domain to that of the other.
        assert_allclose(
            mapping.apply(p, target.mean[None])[0], source.mean, atol=1e-9
        )
    assert len({tuple(np.round(p, 9)) for _, p in starts}) == len(starts)


def test_starts_hold_the_true_turn_nearly():
    """Turns and mirrors of a known domain are among them, but for the rest."""
    source = Domain.of_range([[0, 1], [0, 1]])
    Z = RANDOM.uniform(0, 1, (400, 2))
    for angle in np.radians([0, 45, 90, 180, 270]):
        turn = np.array(
            [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        )
        X = Z @ turn.T + [3.0, -7.0]
        starts = Affine().starts(
            Domain.of_samples(X), source, 32, np.random.RandomState(0)
        )
        nearest = min(np.abs(Affine().apply(p, X) - Z).max() for _, p in starts)
        assert nearest < 0.1


def test_domains():
    box = Domain.of_range([[0.0, 6.0], [-1.0, 1.0]])
    assert_allclose(box.deviation, [np.sqrt(3.0), 1 / np.sqrt(3.0)])
    still = Domain.of_samples([[1.0, 2.0], [1.0, 4.0]])
    assert_allclose(still.deviation, [1.0, 1.0])


def test_names():
    assert isinstance(make_mapping("affine"), Affine)
    own = Affine()
    assert make_mapping(own) is own
    with pytest.raises(ValueError, match="'projective'"):
        make_mapping("projective")
    with pytest.raises(ValueError, match="function"):
        make_mapping(lambda x: x)
