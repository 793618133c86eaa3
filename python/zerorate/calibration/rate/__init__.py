"""A gyro's rate: integrated to an angle, and fitted to a rate table or to an encoder."""
