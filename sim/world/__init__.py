"""The simulated world: people who walk, what hides them, the light, and pictures and truth of it all."""
