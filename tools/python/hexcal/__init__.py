"""Calibration of a Stewart platform by photographs.

Arrays of poses have a row (x, y, z, roll, pitch, yaw) per pose, in mm and deg, of the lower grip relative to its home.
Readings have a row of six per pose, in actuator units. A row of NaN stands for a pose that is not there.
"""
from hexcal._hexcal import (
    Commands,
    Compensation,
    Errors,
    Identified,
    InputError,
    Machine,
    Measurement,
    Model,
    Observations,
    PoseTable,
    __version__,
    compensate,
    errors,
    identify,
    improvement_percent,
    measure,
    range_magnitude,
    read_hexapod,
    read_model,
    read_poses,
)

__all__ = [
    "Commands",
    "Compensation",
    "Errors",
    "Identified",
    "InputError",
    "Machine",
    "Measurement",
    "Model",
    "Observations",
    "PoseTable",
    "__version__",
    "compensate",
    "errors",
    "identify",
    "improvement_percent",
    "measure",
    "range_magnitude",
    "read_hexapod",
    "read_model",
    "read_poses",
]
