"""Limit surfaces of the published patches, the ellipsoid beside them, and stored tables beside the exact surfaces."""
