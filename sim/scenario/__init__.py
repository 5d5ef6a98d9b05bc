"""The scenario: one file that tells a whole run."""
