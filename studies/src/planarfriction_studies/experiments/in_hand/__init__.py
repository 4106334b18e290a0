"""The in-hand experiment: a plate that slips and sticks between two fingers, distributed against reduced."""
