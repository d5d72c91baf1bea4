"""Maps depth images with a Directional TSDF; see docs/python.md for a tour.

In a ROS workspace this package also contains dtsdf_mapping.msg, .srv and .cfg. These may be in a
different sys.path folder from the compiled part, e.g. after pip install in a sourced workspace.
"""
from pkgutil import extend_path as _extend_path

__path__ = _extend_path(__path__, __name__)

__all__ = ["Blocks", "Box", "ColourImage", "DepthImage", "IntegrationResult", "Mapper", "Mesh",
           "Recording", "Space", "Sphere", "cuda_unavailable_reason", "fuse", "recording_formats"]

try:
    from ._core import (Blocks, Box, ColourImage, DepthImage, IntegrationResult, Mapper, Mesh, Space,
                        Sphere, __version__, cuda_unavailable_reason, recording_formats)
    from .recordings import Recording, fuse
except ModuleNotFoundError as _error:
    if _error.name not in (__name__ + "._core", "numpy"):
        raise
    _reason = ("is not installed" if _error.name == "numpy"
               else "was not built; build the package with -DWITH_PYTHON=ON")
    _missing = f"only the messages of dtsdf_mapping are available: {_error.name} {_reason}"
    _names = frozenset(__all__)
    globals()["__all__"] = []
    del _error

    def __getattr__(name):
        if name in _names:
            raise ImportError(_missing)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
