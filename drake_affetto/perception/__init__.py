"""From the camera's image to task parameters."""
