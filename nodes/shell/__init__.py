"""The shell around a node: it listens, speaks and looks at the clock."""
