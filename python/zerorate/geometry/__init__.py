"""Geometry that every floor needs: rotations, frames of the earth, and the earth itself."""
