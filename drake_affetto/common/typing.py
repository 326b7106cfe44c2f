"""The names that annotations give to arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Numbers; truth values; and an image, of whatever type the camera gives.
Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Image = NDArray[Any]
