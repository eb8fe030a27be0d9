"""Renders, samples and labels scans; makes and reads 2D-3D-Semantic data sets.

```python
import s3d_py as s3d
```

The world frame is the same everywhere: metres, Z up, right-handed. Cameras are OpenCV's: `K` is a 3 × 3
matrix of intrinsics in pixels (the centre of the first pixel is at 0.5, 0.5), and `T_world_cam` is the 4 × 4
pose camera → world with x right, y down, z forward.
"""

from __future__ import annotations

from ._camera import Location, PoseLike, intrinsics, look_at
from ._dataset import (
    Candidate,
    DataSet,
    FaceVotes,
    Instance,
    Label,
    Room,
    SourceFaces,
    TorchDataset,
    View,
    Views,
    open,
)
from ._detector import Detector, FoundBox, save_boxes
from ._errors import (
    CancelledError,
    Error,
    FileAccessError,
    FileError,
    FormatError,
    InputError,
    MeshError,
    MissingFileError,
    TemporaryError,
    UnsupportedError,
    UsageError,
)
from ._export import Area, ExportOptions, Labels, SceneLike, export
from ._fuse import Fused, fuse
from ._mesh import Mesh, MeshLike, as_mesh, read_mesh
from ._native import __version__
from ._pairs import Correspondences, Pairs
from ._points import (
    AnnotatedPoints,
    PointCloud,
    PointsLike,
    Votes,
    fill,
    read_points,
    sample,
    save_points,
    vote,
)
from ._progress import Progress, Task
from ._results import (
    Comparison,
    Evaluation,
    FaultGroup,
    Statistics,
    VerifyReport,
    compare,
    evaluate,
    info,
    verify,
)
from ._scene import Images, Rays, Scene
from ._segments import Segments, segments

__all__ = [
    "AnnotatedPoints",
    "Area",
    "CancelledError",
    "Candidate",
    "Comparison",
    "Correspondences",
    "DataSet",
    "Detector",
    "Error",
    "Evaluation",
    "ExportOptions",
    "FaceVotes",
    "FaultGroup",
    "FileAccessError",
    "FileError",
    "FormatError",
    "FoundBox",
    "Fused",
    "Images",
    "InputError",
    "Instance",
    "Label",
    "Labels",
    "Location",
    "Mesh",
    "MeshError",
    "MeshLike",
    "MissingFileError",
    "Pairs",
    "PointCloud",
    "PointsLike",
    "PoseLike",
    "Progress",
    "Rays",
    "Room",
    "Scene",
    "SceneLike",
    "Segments",
    "SourceFaces",
    "Statistics",
    "Task",
    "TemporaryError",
    "TorchDataset",
    "UnsupportedError",
    "UsageError",
    "VerifyReport",
    "View",
    "Views",
    "Votes",
    "__version__",
    "as_mesh",
    "compare",
    "evaluate",
    "export",
    "fill",
    "fuse",
    "info",
    "intrinsics",
    "look_at",
    "open",
    "read_mesh",
    "read_points",
    "sample",
    "save_boxes",
    "save_points",
    "segments",
    "verify",
    "vote",
]
