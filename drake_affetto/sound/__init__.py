"""The drum's voice, and how a recording becomes a reward."""
