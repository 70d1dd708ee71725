"""Soft shadows of the area lights in an environment map, drawn anew in each frame."""
