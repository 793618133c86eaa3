"""A gyro's rate: integration to an angle, and fit to a rate table or an encoder."""
