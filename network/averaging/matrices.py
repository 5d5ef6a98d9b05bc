"""All nodes at once: the rounds as products with a sparse matrix, nothing lost and everybody there.

The theory that the state machines are held against, and the way to average over many thousand nodes in one
process. Rows are nodes in the graph's order. It needs SciPy, which node processes do not import.

Residuals are ||X(t) - mean|| / ||X(0) - mean||, Frobenius norms over nodes and numbers; the worst over all
starts is the largest singular value of the rounds' matrix on vectors that sum to zero. Rates are what is left
of the residual from one round to the next, in the limit.
"""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice

import numpy as np
from jaxtyping import Float
from scipy import sparse

from network.averaging.algorithm import metropolis_weight
from network.averaging.chebyshev import next_relaxation
from network.averaging.finite_time import leja_order
from network.averaging.weights import ConsensusOptions
from network.graphs.graph import Graph
from network.graphs.laplacian import laplacian
from network.graphs.spectrum import Spectrum, extremes_of, spectrum_of

Rounds = Iterator[Float[np.ndarray, "C K"]]
"""The values before the first round, after it, after the second, without end."""
_SMALL = 500
"""Nodes up to which all rounds may become one full matrix: it has to be made first, and kept."""
_DENSE = 6
"""So many entries of a full matrix are multiplied in the time of one of a sparse matrix, and more."""


def metropolis_laplacian(graph: Graph) -> sparse.csr_array:
    """I - W of the Metropolis weights."""
    return laplacian(graph, metropolis_weight)


def linear(L: sparse.csr_array, values: Float[np.ndarray, "C K"], step: float = 1.0) -> Rounds:
    """X(t) = (I - εL) X(t-1): constant weights, best constant weights; with I - W and ε = 1, Metropolis."""
    while True:
        yield values
        values = values - step * (L @ values)


def chebyshev(L: sparse.csr_array, values: Float[np.ndarray, "C K"], spectrum: Spectrum) -> Rounds:
    """X(t) = ω (X(t-1) - ε L X(t-1)) + (1 - ω) X(t-2)."""
    before, omega = values, 0.0
    while True:
        yield values
        omega = next_relaxation(omega, spectrum.contraction)
        values, before = omega * (values - spectrum.step * (L @ values)) + (1 - omega) * before, values


def finite_time(
    L: sparse.csr_array, values: Float[np.ndarray, "C K"], roots: Float[np.ndarray, " R"]
) -> Rounds:
    """X(k) = (I - L/λ_k) X(k-1) as long as there are roots; what follows is the average already."""
    for root in roots:
        yield values
        values = values - (L @ values) / root
    while True:
        yield values


def ratio(L: sparse.csr_array, values: Float[np.ndarray, "C K"]) -> Rounds:
    """[Y Z](t) = P [Y Z](t-1), X = Y / Z, with equal shares: P = I - L (I + D)⁻¹ on degrees D."""
    mass = np.column_stack([values, np.ones(len(values))])
    shares = 1 / (1 + L.diagonal()[:, None])
    while True:
        yield mass[:, :-1] / mass[:, -1:]
        mass = mass - L @ (shares * mass)


def rounds(options: ConsensusOptions, graph: Graph) -> Callable[[Float[np.ndarray, "C K"]], Rounds]:
    """The rounds of the algorithm that a scenario has chosen, to be started with any values.

    Raises:
        ValueError: It has no matrices, since what is sent depends on the values.
    """
    match options.algorithm:
        case "constant":
            return partial(linear, laplacian(graph), step=options.epsilon)
        case "metropolis":
            return partial(linear, metropolis_laplacian(graph))
        case "best_constant":
            return partial(linear, laplacian(graph), step=extremes_of(graph).step)
        case "chebyshev":
            return partial(chebyshev, laplacian(graph), spectrum=extremes_of(graph))
        case "finite_time":
            roots = leja_order(np.array(spectrum_of(graph).eigenvalues))
            return partial(finite_time, laplacian(graph), roots=roots)
        case "ratio":
            return partial(ratio, laplacian(graph))
        case "event_triggered":
            raise ValueError(
                "event_triggered sends by thresholds, which no matrix does: choose another algorithm, such as"
                " metropolis, which it follows"
            )


def averaging(
    options: ConsensusOptions, graph: Graph, iterations: int
) -> Callable[[Float[np.ndarray, "C K"]], Float[np.ndarray, "C K"]]:
    """So many rounds of a scenario's algorithm at once: X(0) → X(t).

    Every algorithm is linear in the values, X(t) = P X(0), and the rounds of the unit vectors are P. In a
    small network one product with it, full as it is, takes less time than t sparse ones.

    Raises:
        ValueError: As `rounds` does.
    """
    start, n_nodes = rounds(options, graph), len(graph.names)

    def after(values: Float[np.ndarray, "C K"]) -> Float[np.ndarray, "C K"]:
        return next(islice(start(values), iterations, None))

    entries = iterations * (n_nodes + 2 * len(graph.edges))
    if n_nodes > _SMALL or n_nodes**2 > _DENSE * entries:
        return after
    return after(np.eye(n_nodes)).__matmul__


def linear_rate(L: sparse.csr_array, step: float = 1.0) -> float:
    """The largest |1 - ελ| over the non-zero eigenvalues λ of L."""
    eigenvalues = np.linalg.eigvalsh(L.toarray())[1:]
    return float(np.abs(1 - step * eigenvalues).max(initial=0.0))


def chebyshev_rate(spectrum: Spectrum) -> float:
    """(1 - √(1 - ρ²)) / ρ: the limit of T_t(1/ρ) / T_t+1(1/ρ)."""
    rho = spectrum.contraction
    return (1 - np.sqrt(1 - rho**2)) / rho if rho else 0.0


def ratio_rate(L: sparse.csr_array) -> float:
    """The second largest |eigenvalue| of P = I - L (I + D)⁻¹."""
    # similar to a symmetric matrix, by the roots of the shares
    root = np.sqrt(1 / (1 + L.diagonal()))
    eigenvalues = np.linalg.eigvalsh(root[:, None] * L.toarray() * root)[1:]
    return float(np.abs(1 - eigenvalues).max(initial=0.0))


def residual(
    values: Float[np.ndarray, "*T C K"], start: Float[np.ndarray, "*T C K"]
) -> Float[np.ndarray, "*T"]:
    """||X(t) - mean|| / ||X(0) - mean||, or that of each of many; 0 where the start has no error."""
    mean = np.einsum("...ck->...k", start)[..., None, :] / start.shape[-2]
    error, left = (np.sqrt(np.einsum("...ck,...ck->...", e, e)) for e in (start - mean, values - mean))
    return np.divide(left, error, out=np.zeros_like(error), where=error > 0)


def worst_residual(values: Float[np.ndarray, "C C"]) -> float:
    """The largest residual over all starts.

    Args:
        values: What the rounds make of the unit vectors: the identity matrix at the start.
    """
    return float(np.linalg.norm(values - 1 / len(values), 2))
