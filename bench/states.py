"""A view's six images from its hits: states of the project against each other.

    cargo build --release -p s3d-render --example view_images
    cp target/release/examples/view_images NAME          (once for each state)
    python3 bench/states.py NAME… [--scenes scan-like,copyroom,office] [--rounds N]

The programs live side by side and take turns of nine views, about a sixth of a second: what disturbs the machine disturbs
all of them alike. Printed are milliseconds a view, each the mean over views of the least, of the lowest fifth's border and
of the median of all rounds, and in brackets the ratio to the first program's. On a busy machine trust the first two.
The office is there if S3D_BENCH_OFFICE names its OBJ file.
"""

import argparse
import statistics
import subprocess

SHARES = {"least": 0, "fifth": 0.2, "median": 0.5}


class State:
    def __init__(self, program, scene):
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.name = program
        self.process = subprocess.Popen([program, scene], **pipes)
        self.rounds = []
        self.turn()

    def turn(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.name} has ended")
        return [float(ms) for ms in line.split()]

    def end(self):
        self.process.stdin.close()
        self.process.wait()

    def milliseconds(self, share):
        views = zip(*self.rounds)
        return statistics.mean(sorted(view)[int(share * len(view))] for view in views)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+")
    parser.add_argument("--scenes", default="scan-like,copyroom,office")
    parser.add_argument("--rounds", type=int, default=40)
    args = parser.parse_args()
    for scene in args.scenes.split(","):
        states = [State(program, scene) for program in args.programs]
        for number in range(args.rounds):
            first = number % len(states)
            for state in states[first:] + states[:first]:
                state.rounds.append(state.turn())
        base = {name: states[0].milliseconds(share) for name, share in SHARES.items()}
        for state in states:
            state.end()
            figures = [(name, state.milliseconds(share)) for name, share in SHARES.items()]
            print(scene, state.name, *(f"{name} {ms:.2f} ({ms / base[name]:.3f})" for name, ms in figures), flush=True)


if __name__ == "__main__":
    main()
