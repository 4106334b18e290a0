"""Kernels of Warp that find where patches are, and how the worlds respond to wrenches on them."""
