"""Scenes as pixels, by NumPy alone: camera, triangles, light and shadow, surfaces, ground, labels."""
