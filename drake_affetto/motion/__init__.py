"""Dynamic Movement Primitives."""
