"""Previews of a camera: the picture, and particles that stand for all."""

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from nodes.filtering.particles import Particles, uniform_log_weights
from nodes.shell.preview import N_SHOWN, preview, thinned


def particles_of(n, weights=None):
    states = np.stack([np.arange(n), -np.arange(n), np.zeros(n), np.ones(n)], axis=1).astype(float)
    return Particles(states, uniform_log_weights(n) if weights is None else np.log(weights))


@given(st.integers(1, 2000), st.integers(1, 300))
def test_equal_particles_are_thinned_evenly(n, most):
    shown = thinned(particles_of(n), most)
    assert shown.shape[1] == 2
    assert min(n, most) / 2 < len(shown) <= most
    steps = np.diff(shown[:, 0])
    assert len(set(steps)) <= 1  # every so-many-th, none left out at the end
    assert shown[0, 0] == 0


def test_particles_are_shown_as_often_as_they_weigh():
    weights = np.array([0.5, 0.25, 0.125, 0.125])
    many = Particles(np.repeat(particles_of(4).states, 100, axis=0), np.log(np.repeat(weights / 100, 100)))
    shown = thinned(many, 40)
    counts = np.array([(shown[:, 0] == i).mean() for i in range(4)])
    np.testing.assert_allclose(counts, weights, atol=2 / 40)


def test_a_preview_is_the_picture_nearly():
    y, x = np.mgrid[:72, :96]
    image = np.stack([x + y, 255 - x, 2 * y], axis=2).astype(np.uint8)
    made = preview("scene1", "C1", 3, 0.3, image, particles_of(500))
    decoded = cv2.imdecode(np.frombuffer(made.jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert decoded.shape == image.shape
    assert np.abs(decoded.astype(int) - image).mean() < 4
    assert len(made.particles) == N_SHOWN
    assert (made.run, made.node, made.frame, made.time_s) == ("scene1", "C1", 3, 0.3)


def test_looking_changes_no_numbers(room):
    """A smart camera that shows every frame estimates what one does that shows none."""
    from network.averaging.weights import MetropolisWeights
    from network.rounds.consensus import Consensus
    from nodes.smart_camera import SmartCamera

    furnished = room()
    estimates = []
    for looked_at in (False, True):
        alone = Consensus("C1", (), MetropolisWeights(), 1)
        camera = SmartCamera(furnished.models["C1"], furnished.setup, [alone])
        for frame in range(4):
            image = furnished.image("C1", frame)
            (*_, estimate) = camera.on_frame(frame, image)
            if looked_at:
                shown = camera.preview(frame, image)
                assert (shown.frame, shown.node) == (frame, "C1")
        estimates.append(estimate)
    np.testing.assert_array_equal(estimates[0].mean, estimates[1].mean)
    np.testing.assert_array_equal(estimates[0].covariance, estimates[1].covariance)
