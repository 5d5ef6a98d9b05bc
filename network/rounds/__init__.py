"""Rounds of consensus: a state machine, and who takes part."""
