"""The real robot: its logs and its own controller."""
