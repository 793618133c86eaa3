"""The whole way of one axis, from the record to a verdict."""
