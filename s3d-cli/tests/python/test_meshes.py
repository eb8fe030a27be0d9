"""Meshes written by trimesh, plyfile and Open3D are read by `s3d sample` and `s3d render`, and compared with these
libraries' own results: area, number of points, and for every point its face, its place on it and its colour."""

import re

import pytest

np = pytest.importorskip("numpy")
plyfile = pytest.importorskip("plyfile")

POINTS = 4000


def sample(s3d, path, out):
    """Returns the points that `s3d sample` draws on a mesh, with Z up so that coordinates stay, and the area
    that it reports.
    """
    done = s3d("sample", path, "-o", out, "--up", "z", "--points", POINTS, "--overwrite")
    area = float(re.search(r"points on ([\d.]+) m²", done.stdout + done.stderr).group(1))
    rows = plyfile.PlyData.read(str(out))["vertex"].data
    assert len(rows) == POINTS
    places = np.stack([rows[c] for c in "xyz"], axis=1).astype(np.float64)
    colors = np.stack([rows[c] for c in ("red", "green", "blue")], axis=1).astype(np.float64)
    return places, colors, rows["face"].astype(np.int64), area, done


def barycentric(triangles, points):
    """Returns the coordinates of points on triangles (n × 3 × 3), and their distances from the triangles."""
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    w = points - a
    uu, uv, vv, wu, wv = ((p * q).sum(1) for p, q in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    d = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / d, (uu * wv - uv * wu) / d
    return np.stack([1 - s - t, s, t], axis=1), np.linalg.norm(w - s[:, None] * u - t[:, None] * v, axis=1)


def warnings_of(done):
    """The warnings, but for that of boxes whose walls have more surface than their floors."""
    lines = done.stderr.splitlines()
    return [line for line in lines if "WARN" in line and "is to point up" not in line]


def check(s3d, path, vertices, faces, tmp_path, vertex_colors=None, face_colors=None):
    """Compares the sampled points of the file at `path` with the mesh in it."""
    vertices, faces = np.asarray(vertices, np.float64), np.asarray(faces)
    triangles = vertices[faces]
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2
    places, colors, face, area, done = sample(s3d, path, tmp_path / "cloud.ply")
    assert area == pytest.approx(areas.sum(), abs=0.06)
    weights, distance = barycentric(triangles[face], places)
    assert distance.max() < 1e-4 and weights.min() > -1e-3 and weights.max() < 1 + 1e-3
    share = np.bincount(face, minlength=len(faces)) - POINTS * areas / areas.sum()
    assert np.abs(share).max() < 5 * np.sqrt(POINTS * (areas / areas.sum()).max()) + 2
    if vertex_colors is not None:
        expected = (np.asarray(vertex_colors, np.float64)[faces[face]] * weights[:, :, None]).sum(1)
        assert np.abs(colors - expected).max() <= 2
    if face_colors is not None:
        assert np.abs(colors - np.asarray(face_colors, np.float64)[face]).max() <= 2
    return done


def box():
    """A box with 24 vertices, so that each side can have its own colour: vertices, quads, triangles, colours.
    """
    corners = np.array([[x, y, z] for x in (0.0, 3.0) for y in (0.0, 2.0) for z in (0.0, 2.5)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    vertices = corners[np.concatenate(sides)]
    quads = np.arange(24).reshape(6, 4)
    # Quads are cut along the shorter diagonal; of two equal diagonals, along the one at the first corner.
    triangles = np.concatenate([[q[[0, 1, 2]], q[[0, 2, 3]]] for q in quads])
    colors = np.array([[250, 10, 20], [30, 240, 50], [60, 70, 230], [200, 210, 0], [0, 180, 190], [160, 0, 170]])
    return vertices, quads, triangles, np.repeat(colors, 4, axis=0).astype(np.uint8)


def rows(columns):
    """Makes a structured array from columns, each (name, type, values)."""
    out = np.empty(len(columns[0][2]), dtype=[(name, kind) for name, kind, _ in columns])
    for name, _, values in columns:
        out[name] = values
    return out


@pytest.mark.parametrize("text, order", [(True, "="), (False, "<"), (False, ">")])
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_plyfile_polygons_colours_and_labels_in_every_encoding(s3d, tmp_path, text, order, kind):
    vertices, quads, triangles, colors = box()
    vertex = rows(
        [(c, kind, vertices[:, i]) for i, c in enumerate("xyz")]
        + [(c, "u1", colors[:, i]) for i, c in enumerate(("red", "green", "blue"))]
        + [("label", "u2", np.arange(24))]
    )
    face = np.empty(6, dtype=[("vertex_indices", "O"), ("category_id", "i4")])
    face["vertex_indices"] = list(quads.astype(np.int32))
    face["category_id"] = np.arange(6) - 1
    elements = [plyfile.PlyElement.describe(face, "face"), plyfile.PlyElement.describe(vertex, "vertex")]
    path = tmp_path / "box.ply"
    plyfile.PlyData(elements, text=text, byte_order=order, comments=["a box"]).write(str(path))
    done = check(s3d, path, vertices, triangles, tmp_path, vertex_colors=colors)
    assert warnings_of(done) == []


def test_plyfile_float_colours_and_a_texture_named_by_a_comment(s3d, tmp_path):
    image = pytest.importorskip("PIL.Image")
    vertices, quads, triangles, colors = box()
    vertex = rows([(c, "f4", vertices[:, i]) for i, c in enumerate("xyz")]
                  + [(c, "f4", colors[:, i] / 255) for i, c in enumerate(("red", "green", "blue"))])
    faces = list(quads.astype(np.int32))
    face = np.empty(6, dtype=[("vertex_indices", "O")])
    face["vertex_indices"] = faces
    describe = plyfile.PlyElement.describe
    path = tmp_path / "floats.ply"
    plyfile.PlyData([describe(vertex, "vertex"), describe(face, "face")]).write(str(path))
    check(s3d, path, vertices, triangles, tmp_path, vertex_colors=colors)

    # A strip of six colours. Texture coordinates are by corner, as MeshLab writes them: v points up.
    image.fromarray(np.repeat(colors[None, ::4], 8, axis=0).repeat(8, axis=1)).save(tmp_path / "six colours.png")
    texcoord = [np.tile([(i + 0.5) / 6, 0.5], 4).astype(np.float32) for i in range(6)]
    face = np.empty(6, dtype=[("vertex_indices", "O"), ("texcoord", "O"), ("texnumber", "i4")])
    face["vertex_indices"], face["texcoord"], face["texnumber"] = faces, texcoord, 0
    path = tmp_path / "textured.ply"
    data = plyfile.PlyData([describe(vertex, "vertex"), describe(face, "face", val_types={"texcoord": "f4"})],
                           comments=["TextureFile six colours.png"])
    data.write(str(path))
    done = check(s3d, path, vertices, triangles, tmp_path, face_colors=np.repeat(colors[::4], 2, axis=0))
    assert warnings_of(done) == []


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_trimesh_ply(s3d, tmp_path, encoding):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=1.5)
    mesh.visual.vertex_colors = (np.abs(mesh.vertex_normals) * 255).astype(np.uint8)
    mesh.face_attributes["label"] = np.arange(len(mesh.faces), dtype=np.int32)
    path = tmp_path / "sphere.ply"
    mesh.export(path, encoding=encoding, vertex_normal=True)
    done = check(s3d, path, mesh.vertices, mesh.faces, tmp_path, vertex_colors=mesh.visual.vertex_colors[:, :3])
    assert warnings_of(done) == []


@pytest.mark.parametrize("ending, ascii", [("ply", True), ("ply", False), ("obj", True), ("glb", False), ("gltf", True)])
def test_open3d(s3d, tmp_path, ending, ascii):
    o3d = pytest.importorskip("open3d")
    mesh = o3d.geometry.TriangleMesh.create_torus(torus_radius=1.0, tube_radius=0.4, radial_resolution=20)
    mesh.compute_vertex_normals()
    vertices = np.asarray(mesh.vertices)
    colors = np.round(255 * np.abs(np.asarray(mesh.vertex_normals)))
    mesh.vertex_colors = o3d.utility.Vector3dVector(colors / 255)
    path = tmp_path / f"torus.{ending}"
    assert o3d.io.write_triangle_mesh(str(path), mesh, write_ascii=ascii)
    # glTF's colours are linear, but Open3D writes sRGB values unchanged.
    gltf = ending in ("glb", "gltf")
    check(s3d, path, vertices, mesh.triangles, tmp_path, vertex_colors=None if gltf else colors)


@pytest.mark.parametrize("ending", ["obj", "glb", "ply"])
def test_trimesh_textured(s3d, tmp_path, ending):
    trimesh = pytest.importorskip("trimesh")
    image = pytest.importorskip("PIL.Image")
    vertices, _, triangles, colors = box()
    strip = image.fromarray(np.repeat(colors[None, ::4], 8, axis=0).repeat(8, axis=1))
    uv = np.stack([(np.repeat(np.arange(6), 4) + 0.5) / 6, np.full(24, 0.5)], axis=1)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=strip) if ending == "glb" else None
    material = material or trimesh.visual.material.SimpleMaterial(image=strip)
    visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    mesh = trimesh.Trimesh(vertices, triangles, visual=visual, process=False)
    path = tmp_path / f"box.{ending}"
    mesh.export(path)
    if ending == "ply":
        # trimesh's file names no image, and s3d says so.
        done = check(s3d, path, vertices, triangles, tmp_path)
        assert "TextureFile" in path.read_bytes().split(b"end_header")[0].decode() or "TextureFile" in done.stderr
    else:
        check(s3d, path, vertices, triangles, tmp_path, face_colors=np.repeat(colors[::4], 2, axis=0))


def test_trimesh_scene_with_nested_and_mirrored_nodes(s3d, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    box_mesh = trimesh.creation.box(extents=(1, 2, 3))
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [4, 5, 6])
    mirror = np.diag([-1.0, 1.0, 2.0, 1.0])
    scene.add_geometry(box_mesh, node_name="a", geom_name="box", transform=turn)
    scene.add_geometry(box_mesh, node_name="b", geom_name="box", parent_node_name="a", transform=mirror)
    scene.add_geometry(trimesh.creation.icosphere(subdivisions=1), node_name="c", parent_node_name="b", transform=turn)
    path = tmp_path / "scene.glb"
    scene.export(path)
    places, _, _, area, _ = sample(s3d, path, tmp_path / "cloud.ply")
    whole = trimesh.load(path, force="mesh")
    assert area == pytest.approx(whole.area, abs=0.06)
    low, high = whole.bounds
    assert (places > low - 1e-4).all() and (places < high + 1e-4).all()
    assert np.abs(places.min(0) - low).max() < 0.3 and np.abs(places.max(0) - high).max() < 0.3


def test_a_ply_mesh_is_rendered_in_its_colours(s3d, tmp_path):
    image = pytest.importorskip("PIL.Image")
    vertices, quads, _, colors = box()
    vertex = rows([(c, "f4", vertices[:, i]) for i, c in enumerate("xyz")]
                  + [(c, "u1", colors[:, i]) for i, c in enumerate(("red", "green", "blue"))])
    face = np.empty(6, dtype=[("vertex_indices", "O")])
    face["vertex_indices"] = list(quads.astype(np.int32))
    path = tmp_path / "box.ply"
    describe = plyfile.PlyElement.describe
    plyfile.PlyData([describe(vertex, "vertex"), describe(face, "face")], byte_order=">").write(str(path))
    out = tmp_path / "view"
    s3d("render", path, "--up", "z", "--at", "1.5,0.5,1.25", "--yaw", "0", "--size", "64", "--fov", "40", "-o", out)
    # The side y = 2 is 1.5 m ahead, at 512 units a metre.
    assert (np.asarray(image.open(out / "depth.png")) == 768).all()
    rgb = np.asarray(image.open(out / "rgb.png")).astype(int)
    assert np.abs(rgb[..., :3] - colors[12].astype(int)).max() <= 1


def test_faults_of_ply_files_are_named(s3d, tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    path = tmp_path / "bad.ply"
    for text, words in [
        (head + "end_header\n0 0 0\n1 0 0\n0 1 0\n", "has no face, only 3 vertices"),
        (head + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "line 13"),
        (head + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n", "cut off"),
    ]:
        path.write_text(text)
        done = s3d("sample", path, "-o", tmp_path / "x.ply", code=1)
        assert words in done.stderr and "bad.ply" in done.stderr, done.stderr
