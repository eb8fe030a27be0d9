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
    Outline,
    Room,
    SourceFaces,
    Split,
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
    NoDataSetError,
    TemporaryError,
    TooLargeError,
    UnsupportedError,
    UsageError,
)
from ._export import Area, ExportOptions, Labels, SceneLike, export
from ._fuse import Fused, fuse
from ._mesh import Mesh, MeshLike, as_mesh, read_mesh
from ._names import NameInArea, NameInRoom
from ._native import __version__
from ._pairs import Correspondences, Pairs
from ._points import (
    AnnotatedPoints,
    LabelledPoints,
    PointCloud,
    PointsLike,
    Votes,
    fill,
    read_points,
    sample,
    save_points,
    vote,
)
from ._poses import CameraPose, read_poses, save_poses
from ._progress import Progress, Task
from ._rays import ClosestPoints, Rays
from ._rendered import Augment, Camera, FreeSpace, Nearby, Paper, RenderedStream, RenderedViews, Sampler, walk
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
from ._scene import Images, Picture, Scene
from ._segments import Segments, segments
from ._views import Image, Panorama, TorchDataset, View, Views

__all__ = [
    "AnnotatedPoints",
    "Area",
    "Augment",
    "Camera",
    "CameraPose",
    "CancelledError",
    "Candidate",
    "ClosestPoints",
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
    "FreeSpace",
    "Fused",
    "Image",
    "Images",
    "InputError",
    "Instance",
    "Label",
    "LabelledPoints",
    "Labels",
    "Location",
    "Mesh",
    "MeshError",
    "MeshLike",
    "MissingFileError",
    "NameInArea",
    "NameInRoom",
    "Nearby",
    "NoDataSetError",
    "Outline",
    "Pairs",
    "Panorama",
    "Paper",
    "Picture",
    "PointCloud",
    "PointsLike",
    "PoseLike",
    "Progress",
    "Rays",
    "RenderedStream",
    "RenderedViews",
    "Room",
    "Sampler",
    "Scene",
    "SceneLike",
    "Segments",
    "SourceFaces",
    "Split",
    "Statistics",
    "Task",
    "TemporaryError",
    "TooLargeError",
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
    "read_poses",
    "sample",
    "save_boxes",
    "save_points",
    "save_poses",
    "segments",
    "verify",
    "vote",
    "walk",
]
