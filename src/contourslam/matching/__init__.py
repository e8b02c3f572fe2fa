"""A contour aligned to other contours, and constellations of landmarks found again."""
