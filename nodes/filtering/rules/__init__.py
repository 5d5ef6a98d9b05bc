"""Fusion rules: what a node says of what it has found, and what the network's average of it means."""
