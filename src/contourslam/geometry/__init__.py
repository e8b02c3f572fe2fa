"""Poses in the plane, angles and lines: pure mathematics, no robot in it."""
