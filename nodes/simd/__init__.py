"""The emulated SIMD smart-camera processor of Medeiros et al. (2008), and the tracker on it."""
