"""Fits the actuators to the logs of a robot."""
