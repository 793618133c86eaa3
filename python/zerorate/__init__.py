"""Model, measure and remove the random drift of MEMS gyroscopes, live or in replay."""
