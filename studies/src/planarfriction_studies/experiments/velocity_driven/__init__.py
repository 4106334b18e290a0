"""Six patches moved with a given velocity: the distributed model, the reduced one, and that on the ellipsoid."""
