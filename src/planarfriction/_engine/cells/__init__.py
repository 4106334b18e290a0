"""Contacts that consist of cells: their rates, steps, rollouts, and what weighs the cells."""
