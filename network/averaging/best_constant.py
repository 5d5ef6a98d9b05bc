"""The best constant weight, 2 / (λ₂ + λ_N) (Xiao & Boyd 2004).

It may be larger than 1 / (largest degree) and still converges: the error shrinks by (λ_N - λ₂) / (λ_N + λ₂) a
round. Nodes or links that go cannot raise λ_N, so that it goes on converging without them, if more slowly.
"""

from typing import Any, Literal

from network.averaging.algorithm import Algorithm, AlgorithmOptions
from network.averaging.constant import ConstantWeights
from network.graphs.graph import Graph
from network.graphs.spectrum import extremes_of


class BestConstant(AlgorithmOptions):
    """The constant weight under which the error shrinks fastest, from the scenario's graph."""

    algorithm: Literal["best_constant"] = "best_constant"
    """The constant weight that is best for this graph, 2 / (λ₂ + λ_N) of its Laplacian."""

    def tuned(self, graph: Graph, iterations: int) -> Algorithm[Any]:
        """Constant weights of that size."""
        return ConstantWeights(epsilon=extremes_of(graph).step)
