"""What every room stands on: errors, typed YAML, resources, output files."""
