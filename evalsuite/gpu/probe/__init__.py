"""A cubemap drawn by the GPU from the real surroundings of an object, and what a technique shades with it."""
