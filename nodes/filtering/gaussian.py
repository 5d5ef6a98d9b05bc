"""Gaussians in moment and information form, and what a camera adds to what was known before.

Sources: Jing & Chen, Eq. 9-10, 13-14 (moments) and 15-16 (information form); the net information is
p⁻¹ - r⁻¹ of Eq. 17, kept a density by projection to the positive semidefinite cone.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from network.wire.codec import upper_triangle


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """A Gaussian by its mean and covariance, or one for each of many nodes."""

    mean: Float[np.ndarray, "*C D"]
    covariance: Float[np.ndarray, "*C D D"]

    def position(self) -> "Moments":
        """The marginal of the position, the first half of the state."""
        half = self.mean.shape[-1] // 2
        return Moments(self.mean[..., :half], self.covariance[..., :half, :half])


@dataclass(frozen=True, slots=True, eq=False)
class Information:
    """A Gaussian factor exp(-½ xᵀ Λ x + xᵀ η) by its matrix Λ and vector η, or one for each of many nodes."""

    matrix: Float[np.ndarray, "*C D D"]
    vector: Float[np.ndarray, "*C D"]


def moments(states: Float[np.ndarray, "N D"], weights: Float[np.ndarray, " N"]) -> Moments:
    """Weighted mean and covariance of a sample (Eq. 9-10 and 13-14)."""
    # one row a component: NumPy is quick along the long axis only, and starts `dot` sooner than `@`
    components = states.T
    # u = Σ ωⱼ χⱼ
    mean = components.dot(weights)
    # p = Σ ωⱼ (χⱼ - u)(χⱼ - u)ᵀ
    centred = np.subtract(components, mean[:, None], order="C")
    covariance = (centred * weights).dot(centred.T)
    covariance += covariance.T
    covariance *= 0.5
    return Moments(mean, covariance)


def regularized(covariance: Float[np.ndarray, "*C D D"], ridge: float) -> Float[np.ndarray, "*C D D"]:
    """A covariance that can be inverted, also that of a sample collapsed to a line or a point.

    Args:
        covariance: Of a sample; positive semidefinite up to rounding.
        ridge: Added to the diagonal, above 0; a little of the trace is as well, for a ridge below rounding.
    """
    added = covariance.copy()
    diagonal = np.einsum("...ii->...i", added)
    diagonal += ridge + 1e-12 * diagonal.sum(axis=-1, keepdims=True)
    return added


def no_information(n: int) -> Information:
    """The factor 1, which says nothing about n numbers."""
    return Information(np.zeros((n, n)), np.zeros(n))


def to_information(gaussian: Moments, ridge: float) -> Information:
    """From p and u to p⁻¹ and p⁻¹u, which Eq. 3 averages; `ridge` is added to the diagonal of p."""
    matrix = np.linalg.inv(regularized(gaussian.covariance, ridge))
    matrix = (matrix + matrix.swapaxes(-2, -1)) / 2
    return Information(matrix, np.matvec(matrix, gaussian.mean))


def to_moments(information: Information) -> Moments:
    """From p⁻¹ and p⁻¹u to u and p; NaN where p⁻¹ is not positive definite, so that it is nobody's."""
    # p⁻¹ = V diag(m) Vᵀ
    m, V = np.linalg.eigh(information.matrix)
    m = np.where(m[..., :1] > 0, m, np.nan)
    covariance = (V / m[..., None, :]) @ V.swapaxes(-2, -1)
    return Moments(np.matvec(covariance, information.vector), covariance)


def log_factor(
    positions: Float[np.ndarray, "N A"], information: Information, center: Float[np.ndarray, " A"]
) -> Float[np.ndarray, " N"]:
    """-½ xᵀΛx + xᵀη of each row, up to a constant; `center`, near the rows, keeps the products small."""
    y = positions - center
    vector = information.vector - information.matrix @ center
    return y @ vector - 0.5 * np.einsum("ni,ij,nj->n", y, information.matrix, y)


def net_information(posterior: Moments, predicted: Moments, ridge: float) -> Information:
    """What a measurement told: N(u, p) / N(v, r) as a factor that never widens.

    p⁻¹ - r⁻¹ of two samples' moments often has negative directions, where the sample grew wider by chance.
    They say nothing and are left out, in the coordinates in which r is the identity. Where the measurement
    says nothing at all (u = v, p = r), the result is zero, exactly.

    Args:
        posterior: u and p of Eq. 13-14.
        predicted: v and r of Eq. 9-10.
        ridge: Added to both covariances' diagonals, m².
    """
    if np.array_equal(posterior.covariance, predicted.covariance):
        return no_information(len(predicted.mean))
    # r = L Lᵀ, M = Lᵀ p⁻¹ L = V diag(m) Vᵀ
    L = np.linalg.cholesky(regularized(predicted.covariance, ridge))
    M = L.T @ np.linalg.solve(regularized(posterior.covariance, ridge), L)
    m, V = np.linalg.eigh((M + M.T) / 2)
    # the directions with m > 1
    gain = np.where(m > 1, m - 1, 0.0)
    shift = np.where(m > 1, m, 0.0) * (V.T @ np.linalg.solve(L, posterior.mean - predicted.mean))
    return _from_whitened(np.linalg.solve(L.T, V), gain, shift, predicted.mean)


def with_smaller_steps(
    fitted: Information, posterior: Moments, predicted: Moments, ridge: float
) -> Information:
    """A fitted likelihood that moves the prediction no farther than the particles have moved.

    Where a log-likelihood is no quadratic, the fit's slope is extrapolated, most of all where it hardly
    curves; the sample's mean is not, but is noisy. In each direction the smaller of the two steps is taken.

    Args:
        fitted: Λ and η of the position, from `fit_log_quadratic`.
        posterior: u and p of Eq. 13-14.
        predicted: v and r of Eq. 9-10.
        ridge: Added to the covariance's diagonal, m².
    """
    if not fitted.matrix.any():
        return fitted
    # r = L Lᵀ, Lᵀ Λ L = V diag(λ) Vᵀ
    L = np.linalg.cholesky(regularized(predicted.covariance, ridge))
    M = L.T @ fitted.matrix @ L
    curvature, V = np.linalg.eigh((M + M.T) / 2)
    gain = np.maximum(curvature, 0.0)
    # (1 + λ) times the step from v: as fitted, Vᵀ Lᵀ (η - Λ v), and to u
    by_fit = V.T @ (L.T @ (fitted.vector - fitted.matrix @ predicted.mean))
    to_mean = (1 + gain) * (V.T @ np.linalg.solve(L, posterior.mean - predicted.mean))
    shift = np.where(np.abs(by_fit) < np.abs(to_mean), by_fit, to_mean)
    return _from_whitened(np.linalg.solve(L.T, V), gain, np.where(gain > 0, shift, 0.0), predicted.mean)


def _from_whitened(
    basis: Float[np.ndarray, "D D"],
    gain: Float[np.ndarray, " D"],
    shift: Float[np.ndarray, " D"],
    center: Float[np.ndarray, " D"],
) -> Information:
    """Λ = B diag(g) Bᵀ and η = Λ v + B e, with B = L⁻ᵀ V."""
    matrix = (basis * gain) @ basis.T
    return Information((matrix + matrix.T) / 2, matrix @ center + basis @ shift)


def fit_log_quadratic(
    positions: Float[np.ndarray, "N A"],
    log_likelihoods: Float[np.ndarray, " N"],
    weights: Float[np.ndarray, " N"],
) -> Information:
    """The concave quadratic nearest to a log-likelihood, by weighted least squares over the particles.

    An alternative to the net information that looks at the likelihood itself, not at two samples' moments:
    its error is that of a regression instead of that of two covariances. A flat log-likelihood, and a sample
    of too few points to tell a quadratic, give zero, exactly.

    Args:
        positions: The particles' positions.
        log_likelihoods: ℓ of each.
        weights: Where the fit has to be good; adds up to one.
    """
    n_axes = positions.shape[1]
    if (log_likelihoods == log_likelihoods[0]).all():
        return no_information(n_axes)
    # one row a component: NumPy is quick along the long axis only
    center = weights @ positions
    y = np.subtract(positions.T, center[:, None], order="C")
    scale = np.sqrt((y * y) @ weights) + 1e-9
    y /= scale[:, None]
    # ℓ ≈ c + yᵀη - ½ yᵀΛy, least squares by its normal equations: y has mean 0 and variance 1
    i, j = upper_triangle(n_axes)
    terms = np.vstack([np.ones_like(log_likelihoods), y, np.where(i == j, -0.5, -1.0)[:, None] * y[i] * y[j]])
    weighted = terms * weights
    coefficients, _, rank, _ = np.linalg.lstsq(weighted @ terms.T, weighted @ log_likelihoods, rcond=1e-14)
    if rank < len(terms):
        return no_information(n_axes)
    matrix = np.zeros((n_axes, n_axes))
    matrix[i, j] = matrix[j, i] = coefficients[1 + n_axes :]
    # the concave part: directions in which the likelihood falls off
    curvature, V = np.linalg.eigh(matrix)
    falls = curvature > 0
    matrix = (V * np.where(falls, curvature, 0.0)) @ V.T
    vector = V @ np.where(falls, V.T @ coefficients[1 : 1 + n_axes], 0.0)
    # back from y to x
    matrix = matrix / scale / scale[:, None]
    return Information(matrix, vector / scale + matrix @ center)
