"""The friction models over an array namespace `xp`, shared by the front ends of PyTorch and JAX; imports neither."""
