"""Distances against OpenCV's, Eq. 4 by hand, and what cameras tell each other about the target's looks."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.vision.appearance import (
    Appearance,
    ModelUpdateOptions,
    distance_to,
    distinctness_of,
    normalize_counts,
    pack_looks,
    settled,
    unpack_looks,
    update_appearance,
)
from nodes.vision.color import ColorOptions
from nodes.vision.pattern import pattern_of, squared_distances

JOINT = ColorOptions(space="joint_rgb", bins_per_channel=2)
RGB = ColorOptions(bins_per_channel=4)
PARTS = ColorOptions(bins_per_channel=4, parts=(0.2, 0.8), part_weights=(0.3, 0.7))
seeds = st.integers(0, 2**32 - 1)


def random_counts(rng, options, n_boxes, n_pixels=50):
    """Counts of every bin: (N, P, C, B), each histogram of as many pixels."""
    shape = (n_boxes, len(options.parts), options.n_channels)
    shares = rng.dirichlet(np.full(options.n_bins, 0.3), shape)
    return rng.multinomial(n_pixels, shares)


def appearance_of(histograms, **changes):
    appearance = Appearance(histograms, histograms, np.ones_like(histograms), 0.2, 0.02, own=True)
    return replace(appearance, **changes)


def distances(counts, reference, options, n_pixels=50, distinctness=1.0):
    """d² by way of the bins that the reference holds only."""
    appearance = appearance_of(reference, distinctness=distinctness * np.ones_like(reference))
    used = reference * appearance.distinctness > 0
    return distances_of(
        counts[:, used], np.full((len(counts), len(options.parts)), n_pixels), appearance, options
    )


def distances_of(counts, pixels, appearance, options):
    pattern = pattern_of(appearance, options)
    return squared_distances(counts, pixels, pattern)


@given(seeds)
def test_the_distance_is_opencvs_hellinger_distance_squared(seed):
    rng = np.random.default_rng(seed)
    counts = random_counts(rng, JOINT, 6)
    reference = counts[0] / 50
    expected = [
        cv2.compareHist(
            box.ravel().astype(np.float32), reference.ravel().astype(np.float32), cv2.HISTCMP_HELLINGER
        )
        ** 2
        for box in counts
    ]
    np.testing.assert_allclose(distances(counts, reference, JOINT), expected, atol=1e-6)


@given(seeds)
def test_the_distance_of_truong_and_kim_needs_no_normalised_histograms(seed):
    """Their Eq. 13-14, on counts of boxes that hold different numbers of pixels."""
    rng = np.random.default_rng(seed)
    other = random_counts(rng, JOINT, 1, n_pixels=35)
    H1, H2 = random_counts(rng, JOINT, 1).ravel(), other.ravel()
    mean1, mean2 = H1.mean(), H2.mean()  # Eq. 14: 1/M times the sum over M bins
    M = len(H1)
    d = np.sqrt(max(1 - np.sqrt(H1 * H2).sum() / np.sqrt(mean1 * mean2 * M**2), 0.0))
    reference = H1.reshape(1, 1, -1) / H1.sum()
    np.testing.assert_allclose(distances(other, reference, JOINT, n_pixels=35), d**2, atol=1e-12)


@given(seeds)
def test_channels_count_alike_and_parts_by_their_weights(seed):
    rng = np.random.default_rng(seed)
    counts = random_counts(rng, PARTS, 4)
    reference = random_counts(rng, PARTS, 1)[0] / 50
    coefficient = np.sqrt(counts / 50 * reference).sum(axis=-1)  # of each box, part and channel
    expected = 1 - coefficient.mean(axis=-1) @ PARTS.part_weights
    np.testing.assert_allclose(distances(counts, reference, PARTS), expected, atol=1e-12)


def test_the_same_histogram_has_no_distance_and_another_one_has_one():
    counts = np.zeros((2, 1, 3, 4), int)
    counts[0, ..., 0] = counts[1, ..., 3] = 50
    np.testing.assert_allclose(distances(counts, counts[0] / 50, RGB), [0, 1], atol=1e-15)


@given(seeds)
def test_a_plain_distance_is_never_negative(seed):
    counts = random_counts(np.random.default_rng(seed), PARTS, 3)
    assert min(distances(counts, counts[0] / 50, PARTS)) >= -1e-12


@given(seeds)
def test_weights_multiply_both_sums(seed):
    rng = np.random.default_rng(seed)
    counts = random_counts(rng, PARTS, 4)
    reference = random_counts(rng, PARTS, 1)[0] / 50
    omega = rng.uniform(0.1, 1, reference.shape)
    by_part = (omega * np.sqrt(counts / 50 * reference)).sum(axis=-1).mean(axis=-1)
    perfect = (omega * reference).sum(axis=-1).mean(axis=-1)
    expected = 1 - by_part @ PARTS.part_weights / (perfect @ PARTS.part_weights)
    np.testing.assert_allclose(distances(counts, reference, PARTS, distinctness=omega), expected, atol=1e-12)


def test_colours_of_the_surroundings_are_not_the_targets():
    target, around = np.array([[[0.5, 0.3, 0.2, 0.0]]]), np.array([[[0.0, 0.15, 0.6, 0.25]]])
    np.testing.assert_allclose(distinctness_of(target, around), [[[1, 0.5, 0, 0]]])


def test_more_of_the_target_than_in_the_reference_is_nearer_than_the_reference():
    reference = np.array([[[0.6, 0.4, 0, 0]]])  # four tenths of its box show the floor
    omega = np.array([[[1.0, 0, 1, 1]]])
    boxes = np.array([[[[60, 40, 0, 0]]], [[[90, 10, 0, 0]]], [[[30, 70, 0, 0]]]])
    counts = boxes[:, reference * omega > 0]
    found = distances_of(counts, np.full((3, 1), 100), appearance_of(reference, distinctness=omega), JOINT)
    np.testing.assert_allclose(found, 1 - np.sqrt([1, 1.5, 0.5]), atol=1e-12)


def test_parts_outside_the_picture_do_not_count():
    rng = np.random.default_rng(0)
    counts, reference = random_counts(rng, PARTS, 1), random_counts(rng, PARTS, 1)[0] / 50
    reference = np.maximum(reference, 1e-9)  # every bin is told apart
    appearance = appearance_of(reference)
    codes = counts.reshape(1, -1)
    torso_only = codes * (pattern_of(appearance, PARTS).book.part == 1)
    found = distances_of(torso_only, np.array([[0, 50]]), appearance, PARTS)
    similarity = np.sqrt(counts[0, 1] / 50 * reference[1]).sum(axis=-1) / reference[1].sum(axis=-1)
    assert found[0] == pytest.approx(1 - similarity.mean(), abs=1e-6)
    nothing = distances_of(0 * codes, np.array([[0, 0]]), appearance, PARTS)
    assert nothing[0] == 1


def test_parts_that_the_reference_has_not_seen_do_not_count():
    counts = random_counts(np.random.default_rng(1), PARTS, 1)
    reference = counts[0] / 50
    reference[0] = 0
    assert distances(counts, reference, PARTS)[0] == pytest.approx(0, abs=1e-12)


def test_normalised_histograms_add_up_to_one_or_were_not_seen():
    counts = random_counts(np.random.default_rng(2), PARTS, 1)
    counts[0, 1] = 0
    histograms = normalize_counts(counts.reshape(1, -1), np.array([[50, 0]]), PARTS)
    np.testing.assert_allclose(histograms.sum(axis=-1), [[[1, 1, 1], [0, 0, 0]]])


def test_the_update_is_equation_4():
    old, new = np.array([[[0.5, 0.5, 0, 0]]]), np.array([[[0.1, 0.2, 0.3, 0.4]]])
    options = ModelUpdateOptions(alpha=0.1, gated=False)
    updated = update_appearance(appearance_of(old), new, 0.9, 0.2, options)
    np.testing.assert_allclose(updated.histograms, [[[0.46, 0.47, 0.03, 0.04]]])
    np.testing.assert_array_equal(updated.first, old)


def test_the_anchor_keeps_some_of_the_first_model_for_ever():
    old, new = np.array([[[1.0, 0, 0, 0]]]), np.array([[[0, 0, 0, 1.0]]])
    options = ModelUpdateOptions(alpha=0.5, anchor=0.1)
    appearance = appearance_of(old)
    for _ in range(200):
        appearance = update_appearance(appearance, new, 0.0, 1.0, options)
    # fixed point of h = 0.9 (0.5 h + 0.5 new) + 0.1 first
    expected = (0.45 * new + 0.1 * old) / 0.55
    np.testing.assert_allclose(appearance.histograms, expected)


@pytest.mark.parametrize(
    ("options", "distance", "visible"),
    [
        (ModelUpdateOptions(alpha=0.5), 0.0, 0.89),  # not enough of it in the picture
        (ModelUpdateOptions(alpha=0.5), 0.141, 1.0),  # hidden: farther than 0.7 d₀² = 0.14
        (ModelUpdateOptions(alpha=0.0), 0.0, 1.0),
        (ModelUpdateOptions(alpha=0.5, gated=False), 0.0, 0.0),  # nothing to see
    ],
)
def test_the_gate_is_closed_where_the_target_is_not_seen_well(options, distance, visible):
    appearance = appearance_of(np.array([[[1.0, 0, 0, 0]]]))
    assert update_appearance(appearance, appearance.histograms, distance, visible, options) is appearance


@given(seeds, st.integers(1, 5), st.integers(0, 3))
def test_a_blind_camera_is_told_the_mean_of_those_that_saw(seed, n_seeing, n_blind):
    rng = np.random.default_rng(seed)
    seen = [
        appearance_of(
            random_counts(rng, PARTS, 1)[0] / 50,
            distinctness=rng.uniform(0, 1, (2, 3, 4)),
            miss_distance=rng.random(),
            variance=rng.random(),
        )
        for _ in range(n_seeing)
    ]
    packed = [pack_looks(each, PARTS) for each in (*seen, *[None] * n_blind)]
    told = unpack_looks(np.mean(packed, axis=0), PARTS)
    np.testing.assert_allclose(told.histograms, np.mean([each.histograms for each in seen], axis=0))
    distinct = np.mean([each.histograms * each.distinctness for each in seen], axis=0)
    np.testing.assert_allclose(told.histograms * told.distinctness, distinct)
    assert told.miss_distance == pytest.approx(np.mean([each.miss_distance for each in seen]))
    assert told.variance == pytest.approx(np.mean([each.variance for each in seen]))
    assert not told.own


def test_an_average_that_is_beside_all_that_was_seen_is_still_a_description():
    looks = pack_looks(appearance_of(np.full((1, 1, 8), 0.125)), JOINT)
    looks[:3] = looks[8] = -1e-3
    told = unpack_looks(looks, JOINT)
    assert told.histograms.min() == told.distinctness.min() == 0
    assert np.isfinite(distance_to(told.histograms, told, JOINT))


def test_nobody_saw_anything():
    assert unpack_looks(pack_looks(None, PARTS), PARTS) is None


@given(seeds)
def test_the_distance_of_histograms_is_that_of_their_counts(seed):
    rng = np.random.default_rng(seed)
    counts, reference = random_counts(rng, PARTS, 1), random_counts(rng, PARTS, 1)[0] / 50
    omega = rng.uniform(0.1, 1, reference.shape)
    found = distance_to(counts[0] / 50, appearance_of(reference, distinctness=omega), PARTS)
    assert found == pytest.approx(distances(counts, reference, PARTS, distinctness=omega)[0], abs=1e-12)


def test_a_camera_that_saw_something_else_believes_the_others():
    target, pillar = np.zeros((1, 1, 8)), np.zeros((1, 1, 8))
    target[..., :2] = pillar[..., 2:4] = 0.5
    seen = [appearance_of(each) for each in (target, target, target, pillar)]
    told = unpack_looks(np.mean([pack_looks(each, JOINT) for each in seen], axis=0), JOINT)
    assert settled(seen[0], told, JOINT) is seen[0]
    assert settled(None, told, JOINT) is told
    doubted = settled(seen[3], told, JOINT)
    assert doubted.doubted
    np.testing.assert_array_equal(doubted.histograms, told.histograms)
    assert settled(seen[3], None, JOINT) is seen[3]
    assert settled(None, None, JOINT) is None
