"""The names that annotations give to arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Numbers; and an image, of whatever type the camera gives.
Array = NDArray[np.float64]
Image = NDArray[Any]
