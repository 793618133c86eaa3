"""Records made ready: outliers, smoothing, trend, decimation."""
