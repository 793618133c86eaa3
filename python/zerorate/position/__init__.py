"""Positions from the fixes of a receiver: the constants of each method."""
