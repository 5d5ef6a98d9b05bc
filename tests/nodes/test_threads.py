"""Shares cover everything once, whatever their number; threads find what one finds, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes import threads
from nodes.counting.histogram import SamplingOptions
from nodes.filtering.particles import Particles, normalize, resample, systematic_indices
from nodes.imaging.camera import look_at
from nodes.threads import in_shares, n_shares
from nodes.vision import observation
from nodes.vision.observation import ObservationModel, ObservationOptions
from nodes.vision.target import TargetOptions


@pytest.fixture(autouse=True, scope="module")
def four_cores():
    """On any machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threads, "n_cores", lambda: 4)
        yield


@given(st.integers(0, 50), st.integers(1, 5), st.integers(1, 20))
def test_shares_cover_everything_once(n, n_threads, least):
    shares, touched = [], np.zeros(n)

    def work(share):
        shares.append(share)
        touched[share] += 1

    in_shares(work, n, n_threads, least)
    np.testing.assert_array_equal(touched, 1)
    assert len(shares) == n_shares(n, n_threads, least) <= min(n_threads, 4)
    assert len(shares) == 1 or min(share.stop - share.start for share in shares) >= least


def test_no_more_threads_than_cores(monkeypatch):
    assert n_shares(80_000, 8, 8_000) == 4
    monkeypatch.setattr(threads, "n_cores", lambda: 2)
    assert n_shares(80_000, 8, 8_000) == 2
    assert n_shares(8_000, 8, 8_000) == 1


@pytest.mark.parametrize("culprit", [0, 1])
def test_what_goes_wrong_in_a_share_is_told(culprit):
    def work(share):
        if (share.start > 0) == bool(culprit):
            raise MemoryError("no room")

    with pytest.raises(MemoryError, match="no room"):
        in_shares(work, 10, 2, 1)


@given(st.integers(0, 2**32 - 1), st.floats(0, 1, exclude_max=True), st.integers(1, 4))
def test_each_new_particle_by_itself_is_systematic_resampling(seed, offset, n_threads):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 200))
    log_weights, _ = normalize(np.where(rng.random(n) < 0.3, -np.inf, rng.normal(0, 5, n)))
    particles = Particles(rng.normal(size=(n, 4)), log_weights)
    resampled = resample(particles, offset, n_threads, least=1)
    ancestors = systematic_indices(particles.weights, offset)
    np.testing.assert_array_equal(resampled.states, particles.states[ancestors])
    np.testing.assert_allclose(resampled.weights, 1 / n)


@pytest.mark.parametrize("grid", [None, (15, 15)])
@pytest.mark.parametrize("n_threads", [2, 3])
def test_distances_are_the_same_with_threads(monkeypatch, grid, n_threads):
    monkeypatch.setattr(observation, "LEAST_BOXES", 10)
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (120, 160, 3), dtype=np.uint8)
    camera = look_at("C1", np.array([0, -6, 2.5]), np.array([0, 0, 1.0]), 110.0, (160, 120), np.zeros(5))
    options = ObservationOptions(sampling=SamplingOptions(grid=grid))
    model = ObservationModel(camera, TargetOptions(), options)
    picture = model.look(image)
    appearance = model.first_appearance(picture, np.zeros(2))
    places = rng.uniform(-3, 3, (101, 2))
    several = replace(model, options=options.model_copy(update={"threads": n_threads}))
    np.testing.assert_array_equal(
        several.log_likelihoods(picture, places, appearance),
        model.log_likelihoods(picture, places, appearance),
    )
