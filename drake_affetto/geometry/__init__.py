"""Geometry of cameras, mirrors and joint chains: arrays in, arrays out."""
