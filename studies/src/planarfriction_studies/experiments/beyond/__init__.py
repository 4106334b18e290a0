"""Beyond the paper: exact limit surfaces, another reduced model, few discs, loads, anisotropic friction."""
