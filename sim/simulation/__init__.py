"""Thousands of cameras in one process: sensors in place of pictures, Gaussians in place of particles."""
