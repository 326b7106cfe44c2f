"""Kinesthetic teaching and the demonstrations it leaves."""
