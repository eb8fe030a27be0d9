"""Videos of walks and of lists of cameras, made by ffmpeg and read back by OpenCV."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

cv2 = pytest.importorskip("cv2")
imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """A folder with a program of the name ffmpeg."""
    folder = tmp_path_factory.mktemp("programs")
    (folder / "ffmpeg").symlink_to(imageio_ffmpeg.get_ffmpeg_exe())
    return folder


def run(s3d, programs, *arguments):
    """Runs `s3d` where it finds ffmpeg alone."""
    command = [s3d.binary, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PATH": str(programs)})


def frames(video):
    """The images of a video, and how many a second."""
    capture = cv2.VideoCapture(str(video))
    rate, images = capture.get(cv2.CAP_PROP_FPS), []
    while True:
        is_there, image = capture.read()
        if not is_there:
            return images, rate
        images.append(image[:, :, ::-1])


def test_a_walk_is_a_video_of_its_images(s3d, demo, programs, tmp_path):
    mesh, out = demo / "scan" / "rgb.obj", tmp_path / "walk"
    size = ["--width", 161, "--height", 120, "--rate", 12]
    done = run(s3d, programs, "render", mesh, "--trajectory", 2, *size, "--modalities", "rgb", "--video", "-o", out)
    assert done.returncode == 0, done.stderr

    images, rate = frames(out / "rgb.mp4")
    files = sorted((out / "rgb").glob("*.png"))
    assert len(images) == len(files) == 24 and rate == 12
    for image, file in zip(images, files):
        # An odd width gets a column more.
        assert image.shape == (120, 162, 3)
        given = np.asarray(Image.open(file).convert("RGB")).astype(int)
        assert np.abs(image[:, :161].astype(int) - given).mean() < 12

    # The same images and rate make the same file; its list of cameras makes it again.
    again = tmp_path / "again"
    done = run(s3d, programs, "render", mesh, "--poses", out, "--rate", 12, "--modalities", "rgb", "--video", "-o", again)
    assert done.returncode == 0, done.stderr
    assert (again / "rgb.mp4").read_bytes() == (out / "rgb.mp4").read_bytes()


def test_what_ffmpeg_says_is_told_and_nothing_is_left(s3d, demo, tmp_path):
    broken = tmp_path / "programs" / "ffmpeg"
    broken.parent.mkdir()
    broken.write_text("""#!/bin/sh
case "$*" in *-version*) exit 0;; esac
echo "no such encoder" >&2
exit 3
""")
    broken.chmod(0o755)
    mesh, out = demo / "scan" / "rgb.obj", tmp_path / "walk"
    done = run(s3d, broken.parent, "render", mesh, "--trajectory", 1, "--width", 32, "--video", "-o", out)
    assert done.returncode == 1 and "no such encoder" in done.stderr and "rgb.mp4" in done.stderr, done.stderr
    assert [path.name for path in Path(tmp_path).iterdir()] == ["programs"]
