"""What a mapper sees and thinks, shown in a browser while it works: a replay, or later a robot that is driving."""
