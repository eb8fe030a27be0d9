"""torch itself, where it is installed: its loaders with workers of every kind, ranks, and epochs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import s3d_py as s3d

torch: Any = pytest.importorskip("torch", reason="torch is not installed")
data: Any = pytest.importorskip("torch.utils.data", reason="torch is not installed")


@pytest.fixture(scope="module")
def ds(demo: Path) -> s3d.DataSet:
    return s3d.open(demo)


@pytest.fixture(scope="module")
def views(ds: s3d.DataSet) -> s3d.RenderedViews:
    return s3d.RenderedViews(ds, length=6, size=(48, 32), modalities=["rgb", "depth", "classes"])


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_workers_give_the_samples_of_the_process(views: s3d.RenderedViews, method: str) -> None:
    loader = data.DataLoader(views, batch_size=2, num_workers=2, multiprocessing_context=method)
    batches = list(loader)
    assert len(batches) == 3
    for start, batch in enumerate(batches):
        assert batch["rgb"].shape == (2, 3, 32, 48) and batch["rgb"].dtype == torch.uint8
        assert batch["classes"].dtype == torch.int64 and batch["K"].dtype == torch.float32
        assert batch["index"].tolist() == [2 * start, 2 * start + 1]
        for place, index in enumerate(batch["index"].tolist()):
            alone = views[index]
            for word in ("rgb", "depth", "classes", "K", "T_world_cam"):
                assert np.array_equal(batch[word][place], alone[word], equal_nan=word == "depth")


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_workers_that_stay_follow_the_epoch(views: s3d.RenderedViews, method: str) -> None:
    loader = data.DataLoader(views, num_workers=2, persistent_workers=True, multiprocessing_context=method)
    seen = []
    try:
        for epoch in (0, 1, 0):
            views.set_epoch(epoch)
            poses = [batch["T_world_cam"][0].numpy() for batch in loader]
            assert all(np.array_equal(pose, views[i]["T_world_cam"]) for i, pose in enumerate(poses))
            seen.append(np.array(poses))
    finally:
        views.set_epoch(0)
    assert np.array_equal(seen[0], seen[2]) and not np.array_equal(seen[0], seen[1])


def test_ranks_and_workers_share_a_stream(views: s3d.RenderedViews) -> None:
    found = []
    for rank in range(2):
        loader = iter(data.DataLoader(views.stream(rank, 2), batch_size=None, num_workers=2))
        found += [int(next(loader)["index"]) for _ in range(6)]
    assert sorted(found) == list(range(12))


def test_a_sampler_of_ranks_splits_an_epoch(views: s3d.RenderedViews) -> None:
    found: list[int] = []
    for rank in range(2):
        sampler = data.distributed.DistributedSampler(views, num_replicas=2, rank=rank, seed=3)
        found += [int(batch["index"][0]) for batch in data.DataLoader(views, sampler=sampler)]
    assert sorted(found) == list(range(6))


def test_pairs_are_collated(ds: s3d.DataSet) -> None:
    pairs = s3d.RenderedViews(
        ds, length=2, size=(32, 32), modalities=["depth"], sampler="free_space", pairs=s3d.Nearby(overlap=(0.2, 0.9))
    )
    (batch,) = data.DataLoader(pairs, batch_size=2)
    assert batch["a"]["depth"].shape == batch["b"]["depth"].shape == (2, 32, 32)
    assert ((batch["overlap"] >= 0.2) & (batch["overlap"] <= 0.9)).all()


def test_a_network_learns_from_rendered_views(ds: s3d.DataSet) -> None:
    torch.manual_seed(1)
    assert ds.classes is not None
    count = len(ds.classes)
    layers = [torch.nn.Conv2d(3, 12, 5, padding=2), torch.nn.ReLU(), torch.nn.Conv2d(12, count, 1)]
    network = torch.nn.Sequential(*layers)
    optimizer = torch.optim.Adam(network.parameters(), 0.01)
    views = s3d.RenderedViews(ds, length=160, size=(64, 64), modalities=["rgb", "classes"], seed=5)
    losses = []
    for batch in data.DataLoader(views, batch_size=8):
        shown = network(batch["rgb"].float() / 255)
        loss = torch.nn.functional.cross_entropy(shown, batch["classes"], ignore_index=-1)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    # Guessing takes the logarithm of the number of classes.
    assert np.mean(losses[-5:]) < 0.8 * np.mean(losses[:2]) and losses[0] > 0.7 * np.log(count)
