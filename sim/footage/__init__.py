"""Real footage: what there is, how to get it, and what is known to be true in it."""

from sim.footage.cache import fetch, locate
from sim.footage.ground_truth import read_ground_truth
from sim.footage.registry import FOOTAGE, FootageError

__all__ = ["FOOTAGE", "FootageError", "fetch", "locate", "read_ground_truth"]
