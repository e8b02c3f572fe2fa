"""Where a robot is in a map that is known: found without a first guess, and followed."""
