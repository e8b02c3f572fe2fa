"""The YDLidar X4: its packets, turns and clock, the driver, and what a scan says of the lidar."""
