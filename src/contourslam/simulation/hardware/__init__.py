"""The robot's parts as devices that send and take real bytes: the X4 and the Mega on serial lines, beside MuJoCo."""
