"""What an experiment has found: arrays, figures, claims, files."""
