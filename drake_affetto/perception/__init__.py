"""From the camera's image to the task parameter."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.perception.analytic_blob_sensor import AnalyticBlobSensor
    from drake_affetto.perception.blob import (
        Blob,
        BlobCalibration,
        BlobConfig,
        detect,
    )
    from drake_affetto.perception.blob_sensor import BlobSensor
    from drake_affetto.perception.camera_model import CameraModel, Mirror
    from drake_affetto.perception.config import (
        CameraConfig,
        LensConfig,
        LightConfig,
        MirrorConfig,
        RenderConfig,
    )
    from drake_affetto.perception.gaze import (
        Gaze,
        GazeConfig,
        GazeMode,
        GazePhase,
        GazeTask,
    )
    from drake_affetto.perception.gaze_servo import GazeServo, gaze_view
    from drake_affetto.perception.imaging import ImageEffects
    from drake_affetto.perception.mirror_camera import (
        MirrorCamera,
        add_renderers,
    )
    from drake_affetto.perception.optical_map import OpticalMap

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "AnalyticBlobSensor": "analytic_blob_sensor",
        "Blob": "blob",
        "BlobCalibration": "blob",
        "BlobConfig": "blob",
        "BlobSensor": "blob_sensor",
        "CameraConfig": "config",
        "CameraModel": "camera_model",
        "Gaze": "gaze",
        "GazeConfig": "gaze",
        "GazeMode": "gaze",
        "GazePhase": "gaze",
        "GazeServo": "gaze_servo",
        "GazeTask": "gaze",
        "ImageEffects": "imaging",
        "LensConfig": "config",
        "LightConfig": "config",
        "Mirror": "camera_model",
        "MirrorCamera": "mirror_camera",
        "MirrorConfig": "config",
        "OpticalMap": "optical_map",
        "RenderConfig": "config",
        "add_renderers": "mirror_camera",
        "detect": "blob",
        "gaze_view": "gaze_servo",
    },
)
