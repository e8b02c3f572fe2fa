"""The base: its protocol, the driver of the Mega, odometry from wheels and gyroscope, and their calibration."""
