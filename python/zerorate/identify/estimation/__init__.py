"""Autoregressions and ARMA models of a record, and their orders."""
