"""Resampling by neighbour access: replication factors, then particles handed from element to element.

Sources: Medeiros et al. (2008), sections 3.4 and 4 (simplified residual); Liu & Chen (1998) (residual);
Kitagawa (1996) (systematic). Element p of the group gets the particle j with start(j) ≤ p < end(j), where
end(j) - start(j) is the particle's replication factor.
"""

from collections.abc import Sequence

import numpy as np

from nodes.simd.array import ProcessorArray
from nodes.simd.lanes import Scalar
from nodes.simd.memory import Word
from nodes.simd.programs.normalizing import Group, normalized


def replication_bounds(
    array: ProcessorArray,
    bounds: tuple[Word, Word],
    weight: Word,
    factor: Scalar,
    place: Word,
    group: Group,
    rng: np.random.Generator,
) -> None:
    """Start and end of each particle of the group, by the rule of the options.

    Args:
        array: The processor.
        bounds: start and end; 0 outside of the group.
        weight: Weights, 0 outside of the group.
        factor: The scale factor of the weights.
        place: 0 to n - 1 in the group, more than n outside of it.
        group: The particles.
        rng: For the rules that draw.
    """
    n_words = array.options.number_words
    start, end = bounds
    with array.using(array.number(n_words=n_words + 1)) as (fraction,):
        # w of the sum one, with a word more than the weights have
        normalized(array, fraction, weight, factor, extra_words=1)
        if array.options.resampling == "systematic":
            _systematic(array, end, fraction, place, group, rng)
        else:
            _residual(array, end, fraction, weight, place, group, rng)
    # start is the end of the particle before; elements of other groups have none to give: start = M, end = 0
    outside = array.at_least(place, group.n)
    array.copy(end, 0, when=outside)
    array.copy(start, array.neighbour(end, -1))
    array.copy(start, group.n, when=outside)


def replicate(
    array: ProcessorArray, states: Sequence[Word], bounds: tuple[Word, Word], place: Word, group: Group
) -> None:
    """Hands the particles on to their elements, first to the left, then to the right.

    From the right, the last particle j with start(j) ≤ p that comes by stays; from the left, the last with
    p < end(j). One of the two passes brings element p its particle, the other brings nothing.
    """
    start, end = bounds
    results, moving = [array.like(state) for state in states], [array.like(state) for state in states]
    mark, limit = array.word(), array.word()
    with array.using(mark, limit, *moving, *results):
        for result, state in zip(results, states, strict=True):
            array.copy(result, state)
        # start ≤ p as M - start ≥ M - p: the zeros that come in at the end of the array are no particles
        array.subtract(limit, group.n, place)
        array.subtract(mark, group.n, start)
        _hand_on(array, states, moving, results, mark, limit, +1, group)
        # p < end as end ≥ p + 1
        array.add(limit, place, 1)
        array.copy(mark, end)
        _hand_on(array, states, moving, results, mark, limit, -1, group)
        for state, result in zip(states, results, strict=True):
            array.copy(state, result)


def _hand_on(
    array: ProcessorArray,
    states: Sequence[Word],
    moving: Sequence[Word],
    results: Sequence[Word],
    mark: Word,
    limit: Word,
    offset: int,
    group: Group,
) -> None:
    for each, state in zip(moving, states, strict=True):
        array.copy(each, state)
    for _ in array.repeat(group.n - 1):
        array.shift(mark, offset)
        for each in moving:
            array.shift(each, offset)
        mine = array.at_least(mark, limit)
        for result, each in zip(results, moving, strict=True):
            array.keep(result, each, mine)


def _prefix_sums(array: ProcessorArray, sums: Word, value: Word, group: Group) -> None:
    """Adds up the values of the group up to and with the own one."""
    with array.using(array.like(value)) as (moving,):
        array.copy(moving, value)
        array.copy(sums, value)
        for _ in array.repeat(group.n - 1):
            array.shift(moving, -1)
            array.accumulate(sums, moving)


def _whole(array: ProcessorArray, target: Word, number: Word) -> None:
    """The word before the point of a number whose other words are a fraction."""
    if number.real:
        array.shift_right(target, number, 0)
    else:
        array.high_words(target, number)


def _systematic(
    array: ProcessorArray, end: Word, fraction: Word, place: Word, group: Group, rng: np.random.Generator
) -> None:
    n_words = fraction.n_words
    sums, scaled = array.like(fraction), array.number(n_words=n_words + 1)
    with array.using(sums, scaled):
        # end = ⌊M Σ w + u⌋
        _prefix_sums(array, sums, fraction, group)
        array.multiply(scaled, sums, group.n)
        offset = rng.random()
        array.add(
            scaled, scaled, offset if scaled.real else int(offset * (1 << n_words * array.options.bits))
        )
        _whole(array, end, scaled)
        array.copy(end, group.n, when=array.equal(place, group.n - 1))


def _residual(
    array: ProcessorArray,
    end: Word,
    fraction: Word,
    weight: Word,
    place: Word,
    group: Group,
    rng: np.random.Generator,
) -> None:
    scaled, copies = array.number(n_words=fraction.n_words + 1), array.word()
    with array.using(scaled, copies):
        # r = ⌊M w⌋
        array.multiply(scaled, fraction, group.n)
        _whole(array, copies, scaled)
        if array.options.resampling == "residual":
            _draw_rest(array, copies, scaled, fraction, group, rng)
        _prefix_sums(array, end, copies, group)
    if array.options.resampling == "simplified":
        # the best particle, the first if several are, takes M - Σ r more
        weights = array.scan(weight, group.elements)
        best = weights.index(max(weights))
        rest = group.n - int(array.peek(end, group.last))
        array.add(end, end, rest, when=array.at_least(place, best))


def _draw_rest(
    array: ProcessorArray,
    copies: Word,
    scaled: Word,
    rest: Word,
    group: Group,
    rng: np.random.Generator,
) -> None:
    """M - Σ r draws from what rounding left of each weight; the control processor draws and broadcasts."""
    sums, before, drawn = array.like(scaled), array.like(scaled), array.like(copies)
    with array.using(sums, before, drawn):
        # M w - r
        if rest.real:
            array.subtract(rest, scaled, copies)
        else:
            array.copy(rest, scaled)
        _prefix_sums(array, sums, rest, group)
        array.subtract(before, sums, rest)
        _prefix_sums(array, drawn, copies, group)
        n_draws = group.n - int(array.peek(drawn, group.last))
        if n_draws == 0:
            return
        draws = rng.random(n_draws) * array.peek(sums, group.last)
        draws = draws if rest.real else np.floor(draws).astype(np.int64)
        array.copy(drawn, 0)
        for draw in array.repeat(n_draws):
            hit = array.both(array.at_least(draws[draw], before), array.less(draws[draw], sums))
            array.accumulate(drawn, 1, when=hit)
        array.add(copies, copies, drawn)
