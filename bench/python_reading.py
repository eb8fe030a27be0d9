"""Views in Python: all modalities of a view read by `s3d_py.View.load` and by the data set's own utils.py, in turns, in one process.

    python3 bench/python_reading.py DATASET [--views N] [--rounds N]

Needs s3d_py of a release build, Pillow and OpenEXR. Both read colours, distances, normals, labels, instances' colours and world
coordinates of the same views from the page cache. Seconds are processor time of the process, all threads together, and those of the
clock.
"""

import argparse
import importlib.util
import pathlib
import statistics
import time

import s3d_py as s3d


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=pathlib.Path)
    parser.add_argument("--views", type=int, default=12)
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    found = importlib.util.spec_from_file_location("utils", args.dataset / "assets/utils.py")
    utils = importlib.util.module_from_spec(found)
    found.loader.exec_module(utils)
    ds = s3d.open(args.dataset)
    views = ds.views()[: args.views]

    def ours():
        for view in views:
            view.load("rgb", "depth", "normal", "xyz", "labels", "pretty")

    def theirs():
        for view in views:
            utils.read_png(view.path("rgb"))
            utils.read_depth(view.path("depth"))
            utils.read_normals(view.path("normal"))
            utils.read_xyz(view.path("xyz"))
            utils.read_semantic(view.path("labels"))
            utils.read_png(view.path("pretty"))

    taken = {"s3d_py": [], "utils.py": []}
    for turn in range(args.rounds + 1):
        for name, call in (("s3d_py", ours), ("utils.py", theirs)):
            began = time.process_time(), time.perf_counter()
            call()
            if turn > 0:  # the first fills the page cache
                taken[name].append((time.process_time() - began[0], time.perf_counter() - began[1]))
    for number, what in enumerate(("processor", "clock")):
        ours_ms, theirs_ms = (
            1000 * statistics.median(rounds[number] for rounds in taken[name]) / len(views) for name in taken
        )
        print(f"{what}: s3d_py {ours_ms:.1f} ms a view, utils.py {theirs_ms:.1f} ms, {theirs_ms / ours_ms:.2f} times")


if __name__ == "__main__":
    main()
