"""Physics of one bristle: its law, its rate and its step, for points, discs and cells that lean."""
