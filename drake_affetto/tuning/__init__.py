"""Searches the gains of the controllers on the whole robot."""
