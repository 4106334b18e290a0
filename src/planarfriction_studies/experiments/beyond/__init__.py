"""Beyond the paper: exact limit surfaces, another reduced model, few cells, loads, anisotropic friction."""
