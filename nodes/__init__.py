"""A smart camera and the central node: everything that would run unchanged on a real one."""
