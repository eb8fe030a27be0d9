"""A first session with the whole package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import s3d_py as s3d

from common import K


def test_a_session(demo: Path, tmp_path: Path) -> None:
    mesh = s3d.read_mesh(demo / "scan" / "rgb.obj")
    assert mesh.textures and mesh.area > 100 and mesh.bounds.shape == (2, 3)
    scene = s3d.Scene(mesh)
    places = scene.place_cameras(see=0.95)
    T = s3d.look_at(places[0].xyz, places[0].xyz + [1.0, 0.2, -0.1])
    img = scene.render(
        K, T, (64, 48), modalities=["rgb", "depth", "normal", "xyz", "face"], rgb_samples=4
    )
    assert img.rgb.shape == img.normal.shape == img.xyz.shape == (48, 64, 3)
    assert img.depth.shape == img.face.shape == (48, 64)
    assert (np.isnan(img.depth) == (img.face < 0)).all()
    poses = [place.T_world_cam for place in places]
    batch = scene.render_many(poses, K, (64, 48), modalities=["rgb", "depth"], threads=2)
    assert len([made.depth for made in batch]) == len(places)
    pano = scene.panorama(places[0], width=256)
    assert pano.rgb.shape == (128, 256, 3)
    hits = scene.cast(places[0].xyz, [[1, 0, 0], [0, 0, -1]])
    assert hits.t[1] == pytest.approx(1.5, abs=0.05)

    cloud = s3d.sample(mesh, points_per_m2=100, seed=0)
    assert len(cloud) == pytest.approx(100 * mesh.area, rel=0.001)
    points = s3d.read_points(demo / "scan" / "Area_1")
    votes = s3d.vote(mesh, points.xyz, points.label)
    assert (votes.margin <= votes.votes).all() and (votes.label < len(points.names)).all()
    labels = (points.names, votes.filled(within=0.1))
    out = tmp_path / "out"
    s3d.export(
        mesh, out, locations=places[:2], labels=labels, views=6, size=96, pano_width=256, keep_all=True
    )

    ds = s3d.open(out)
    assert len(ds) == 2 * 7 and "office" in {room.type for room in ds.rooms} and "chair" in (ds.classes or [])
    seen = ds.views(min_share={"wall": 0.02})
    assert 0 < len(seen) <= 12
    for v in seen:
        assert v.shares["wall"] >= 0.02 and v.K is not None
        assert v.rgb.shape == v.points().shape == (96, 96, 3)
        assert v.depth.shape == v.classes.shape == v.instances.shape == (96, 96)
        assert v.T_world_cam.shape == (4, 4)
    samples = ds.torch(["rgb", "depth", "classes"], transform=lambda sample: sample["rgb"])
    assert len(samples) == 12
    assert ds.verify().ok
    predictions = tmp_path / "predictions"
    predictions.mkdir()
    for view in ds.panoramas():
        np.save(predictions / f"{view.name}.npy", np.nan_to_num(view.depth))
    scores = s3d.evaluate("depth", truth=ds, pred=predictions)
    assert scores.score("mean", "AbsRel") == 0.0
    page = ds.report(tmp_path / "page")
    assert page.name == "index.html" and page.stat().st_size > 10_000
