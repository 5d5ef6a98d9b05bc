"""Faults of a scenario: what goes wrong at which frame."""
