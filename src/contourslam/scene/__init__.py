"""The 3-D scene: walls of a map raised to a height and textured from pictures."""
