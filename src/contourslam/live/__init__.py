"""A mapper that is driving: scans paired with odometry, what is late named, maps kept, corrections smoothed."""
