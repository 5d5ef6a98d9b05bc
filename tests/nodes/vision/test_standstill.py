"""The background's likeness: what it takes for the same view, and what it does not."""

import numpy as np
import pytest

from nodes.vision.standstill import BLOCK, ROWS, Standstill, background_of, likeness


@pytest.fixture
def wall():
    """A picture with structure of some pixels everywhere."""
    rng = np.random.default_rng(1)
    coarse = rng.integers(60, 180, (ROWS // 6, 30, 3))
    return np.kron(coarse, np.ones((6, 6, 1))).astype(np.uint8)


def test_the_same_view_is_the_same_in_any_light(wall):
    background = background_of(wall)
    assert likeness(wall, background) == pytest.approx(1, abs=1e-5)
    assert likeness((0.7 * wall + 20).astype(np.uint8), background) > 0.99
    noisy = np.clip(wall + np.random.default_rng(2).normal(0, 4, wall.shape), 0, 255).astype(np.uint8)
    assert likeness(noisy, background) > 0.95


def test_another_view_is_another(wall):
    background = background_of(wall)
    by_a_block = likeness(np.roll(wall, BLOCK, axis=1), background)
    by_a_bit = likeness(np.roll(wall, 2, axis=1), background)
    assert abs(by_a_block) < 0.2
    assert by_a_block < by_a_bit < 0.9


def test_people_before_the_background_hardly_count(wall):
    crowded = wall.copy()
    crowded[20:110, 40:75] = (30, 90, 200)
    crowded[20:110, 120:150] = (200, 20, 20)
    assert likeness(crowded, background_of(wall)) > 0.9


def test_where_there_is_nothing_to_see_nothing_is_alike(wall):
    assert likeness(np.zeros_like(wall), background_of(wall)) == 0
    assert likeness(wall, background_of(np.full_like(wall, 128))) == 0


def test_each_block_is_correlated_as_by_hand(wall):
    other = np.random.default_rng(3).integers(0, 255, wall.shape, dtype=np.uint8)
    mixed = (0.5 * wall + 0.5 * other).astype(np.uint8)
    background = background_of(wall)
    x, y = background_of(mixed).structure.astype(float), background.structure.astype(float)
    found = []
    for row in range(0, x.shape[0], BLOCK):
        for column in range(0, x.shape[1], BLOCK):
            a, b = (each[row : row + BLOCK, column : column + BLOCK] for each in (x, y))
            found.append(((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum()), (b * b).sum()))
    correlations, energies = np.array(found).T
    expected = np.median(correlations[energies >= np.median(energies)])
    assert likeness(mixed, background) == pytest.approx(expected, abs=1e-4)


def test_who_was_knocked_is_told_until_it_looks_there_again():
    standstill = Standstill()
    like = [False, True, False, False, True]
    # the first picture may have been black: who has never looked like it cannot have been knocked
    assert [standstill.holds(i + 1, like_the_first=each) for i, each in enumerate(like)] == [
        *(True, True),
        *(False, False),
        True,
    ]
    assert standstill.knocked == {"frames": 2, "first": 3}
