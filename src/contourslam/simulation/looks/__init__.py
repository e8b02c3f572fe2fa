"""What the surfaces of a simulated room look like, drawn with NumPy: canvas, materials, things on walls."""
