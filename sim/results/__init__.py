"""What a run leaves: its files, its figures, and where it came from."""
