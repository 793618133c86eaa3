"""Navigation by inertial sensors and a receiver: the earth, fixes and tracks."""
