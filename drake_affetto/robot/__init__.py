"""The real robot: its logs."""
