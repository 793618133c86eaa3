"""The statistical tests: rest, stationarity, normality, whiteness."""
