"""The drumming child robot Affetto as a Drake systems-framework model."""

__version__ = "0.1.0"
