"""The simulator: the world, the scenario and everything that a person runs; it puts things together."""
