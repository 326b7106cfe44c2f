"""Valves, chambers and joint friction of the pneumatic actuators."""
