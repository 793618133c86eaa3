"""Drift filters that begin with a model."""
