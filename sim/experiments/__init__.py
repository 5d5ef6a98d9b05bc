"""Experiments: many runs, what they depend on, where they are computed, and what they show together."""
