"""Drivers of the robot's parts on their serial ports, and what can go wrong with them."""
