"""Runs: in processes or in one, recorded, measured and summed up."""
