"""What other encoders make of a data set's images, in size and in time.

Usage:
    python3 -m venv venv && venv/bin/pip install numpy pillow opencv-python-headless OpenEXR
    s3d export scene.toml -o dataset --compression balanced
    venv/bin/python bench/encode_peers.py dataset [--views 8] [--area 1]

The images of some views, spread evenly over all, are decoded and encoded again: PNG by OpenCV at levels 1 and 6, and by
Pillow at levels 6 and 9 (both are libpng with its own choice of filters); OpenEXR by OpenEXR, ZIP, half floats. Printed is for each
modality the mean size of the files on disk and their ratio to each peer's, the worst ratio of one image to the smaller
of the two level 6, and each peer's milliseconds of processor time an image, the least of three runs. The last line sums
a view: five PNG images by OpenCV at its level 1 and at 6, and the OpenEXR image.

How long s3d takes for the same images: `s3d export` with `-v`, or `cargo bench -p s3d-io --bench encode`.
"""

import argparse
import io
import pathlib
import tempfile
import time

import cv2
import numpy as np
import OpenEXR
from PIL import Image

MODALITIES = ["rgb", "depth", "normal", "semantic", "semantic_pretty"]


def timed(encode, runs=3):
    """The size that `encode` returns and the least milliseconds of processor time of some runs."""
    best, size = float("inf"), 0
    for _ in range(runs):
        start = time.process_time()
        size = encode()
        best = min(best, time.process_time() - start)
    return size, 1e3 * best


def png_peers(path, runs):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    pillow = Image.fromarray(image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1]))

    def by_pillow(level):
        out = io.BytesIO()
        pillow.save(out, "PNG", compress_level=level)
        return out.tell()

    def by_opencv(level):
        return len(cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, level])[1])

    return {
        "OpenCV 1": timed(lambda: by_opencv(1), runs),
        "OpenCV 6": timed(lambda: by_opencv(6), runs),
        "Pillow 6": timed(lambda: by_pillow(6), runs),
        "Pillow 9": timed(lambda: by_pillow(9), 1),
    }


def exr_peer(path, folder, runs):
    pixels = OpenEXR.File(str(path)).channels()["RGB"].pixels
    assert pixels.dtype == np.float16, f"{path}: {pixels.dtype}"
    out = pathlib.Path(folder) / "peer.exr"

    def encode():
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"RGB": pixels}) as file:
            file.write(str(out))
        return out.stat().st_size

    return {"OpenEXR": timed(encode, runs)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=pathlib.Path)
    parser.add_argument("--views", type=int, default=8, help="how many views (default 8)")
    parser.add_argument("--area", type=int, default=1)
    parser.add_argument("--runs", type=int, default=3, help="runs of each encoder, of which the fastest counts")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    data = args.dataset / f"area_{args.area}" / "data"
    sums = {"OpenCV 1": 0.0, "OpenCV 6": 0.0}
    print(f"{'modality':16}{'bytes':>9}  size to each peer's (its milliseconds)")
    with tempfile.TemporaryDirectory() as folder:
        for modality in MODALITIES + ["global_xyz"]:
            paths = sorted(p for p in (data / modality).iterdir() if p.suffix in (".png", ".exr"))
            assert paths, f"no images in {data / modality}"
            chosen = [paths[i] for i in np.unique(np.linspace(0, len(paths) - 1, args.views).astype(int))]
            sizes, peers = [], []
            for path in chosen:
                sizes.append(path.stat().st_size)
                if path.suffix == ".png":
                    peers.append(png_peers(path, args.runs))
                else:
                    peers.append(exr_peer(path, folder, args.runs))
            row = f"{modality:16}{np.mean(sizes):9.0f} "
            for name in peers[0]:
                size = np.mean([p[name][0] for p in peers])
                ms = np.mean([p[name][1] for p in peers])
                row += f" {name} {np.mean(sizes) / size:.3f} ({ms:.1f})"
                if name in sums:
                    sums[name] += ms
                if name == "OpenEXR":
                    sums = {k: v + ms for k, v in sums.items()}
            level6 = [min(v[0] for k, v in p.items() if k in ("OpenCV 6", "Pillow 6", "OpenEXR")) for p in peers]
            row += f" worst {max(s / l for s, l in zip(sizes, level6)):.3f}"
            print(row, flush=True)
    print("a view: " + ", ".join(f"{k} and OpenEXR {v:.0f} ms" for k, v in sums.items()))


if __name__ == "__main__":
    main()
