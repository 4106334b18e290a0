"""Beyond the paper: exact limit surfaces, another reduced model, few cells, loads, friction with a grain."""
