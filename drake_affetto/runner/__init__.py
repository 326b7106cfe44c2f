"""Runs keyed tasks on workers and keeps their results; knows no robot."""
