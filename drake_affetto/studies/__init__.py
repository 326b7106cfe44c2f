"""What runs many trials and gathers their results."""
