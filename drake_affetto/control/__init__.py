"""The PIDF valve controller."""
