"""Timestamps of any kind, and the regular clocks that made them."""
