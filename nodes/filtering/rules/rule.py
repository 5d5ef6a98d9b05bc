"""The interface of all fusion rules: what a node sends, and how the average of it is read.

Rules are frozen values of pure functions on Gaussians, for one node or for many at once: leading axes of the
arrays are nodes. What a rule makes of the average is either a factor on the prediction, or the posterior.
"""

from abc import ABC, abstractmethod
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from network.wire.codec import unpack_symmetric
from nodes.filtering.gaussian import Information, Moments


class LocalEstimate(ABC):
    """What a node's local filter has found, in the forms that rules ask for."""

    __slots__ = ()

    @property
    @abstractmethod
    def posterior(self) -> Moments:
        """Mean u and covariance p: with the measurement."""

    @property
    @abstractmethod
    def after(self) -> Information:
        """p⁻¹ and p⁻¹u."""

    @property
    @abstractmethod
    def before(self) -> Information:
        """r⁻¹ and r⁻¹v: without the measurement."""

    @property
    @abstractmethod
    def measured(self) -> Information:
        """What the measurement told about the position: the part of after minus before that is a density."""

    @property
    @abstractmethod
    def fitted(self) -> Information:
        """The same, read off the log-likelihood itself."""


@runtime_checkable
class Rule(Protocol):
    """A fusion rule."""

    def size(self, n_states: int) -> int:
        """How many numbers it sends, for D states."""

    def pack(self, local: LocalEstimate, n_cameras: int) -> Float[np.ndarray, "*C K"]:
        """The vector that consensus averages; N cameras take part."""

    def unpack(
        self, average: Float[np.ndarray, "*C K"], n_cameras: int, n_states: int
    ) -> Information | Moments:
        """What the average over N cameras with D states each means.

        Returns:
            A factor on a node's own prediction, or the posterior, NaN where it is no density.
        """


def triangle(n: int) -> int:
    """How many numbers a symmetric n x n matrix has."""
    return n * (n + 1) // 2


def split_information(numbers: Float[np.ndarray, "*C K"], n: int) -> Information:
    """Information about n numbers, from the upper triangle of its matrix and its vector behind."""
    return Information(unpack_symmetric(numbers[..., : triangle(n)], n), numbers[..., triangle(n) :])


def joined(*parts: Float[np.ndarray, "*C _"]) -> Float[np.ndarray, "*C K"]:
    """Vectors behind one another, node for node."""
    return np.concatenate(parts, axis=-1)


def plus_on_position(state: Information, position: Information, times: int = 1) -> Information:
    """Information about the state, and so many times some about its position."""
    n = position.vector.shape[-1]
    matrix, vector = state.matrix.copy(), state.vector.copy()
    matrix[..., :n, :n] += times * position.matrix
    vector[..., :n] += times * position.vector
    return Information(matrix, vector)
