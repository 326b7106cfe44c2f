"""How the marker lies in the image of the gaze's tests."""

import math

from drake_affetto.perception.gaze import GazeView

VIEW = GazeView(center_x=0.5, width=1.0, height_per_width=0.75, focal=0.8)


def x_img_at(angle):
    """x_img of a marker at `angle`, rad, from the optical axis."""
    return VIEW.center_x + VIEW.focal * math.tan(angle)
