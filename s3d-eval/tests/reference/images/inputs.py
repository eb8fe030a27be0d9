"""The inputs of the comparison with the reference programs; tests/images_reference.rs makes the same numbers."""
import numpy as np

MASK = np.uint64(0xFFFFFFFF)

# HoHoNet's classes, in its order.
CLASSES = ["beam", "board", "bookcase", "ceiling", "chair", "clutter", "column", "door", "floor", "sofa", "table",
           "wall", "window"]
# Labels of eleven of the classes: no true pixel is beam or column.
LABELS = ["<UNK>_0_<UNK>_0_0"] + [c + "_1_office_1_1" for c in CLASSES if c not in ("beam", "column")]

# Name, width, height, seed. Every pixel of the last panorama is void.
PANORAMAS = [("a", 2048, 1024, 1), ("b", 1024, 512, 2), ("c", 1000, 500, 3), ("d", 4096, 2048, 4),
             ("f", 1360, 680, 6), ("void", 1024, 512, 5)]
# The areas that hold the panoramas, and HoHoNet's fold that tests them.
FOLDS = {"1_valid": {"area_5a": ["a"], "area_5b": ["b", "void"]}, "2_valid": {"area_2": ["c"], "area_4": ["d"]},
         "3_valid": {"area_1": ["f"], "area_3": [], "area_6": []}}
AXES = [(4096, 1024), (2048, 512), (1000, 1024), (1360, 1024), (1234, 1024), (777, 512), (160, 1024), (2047, 1024)]


def mix(seed, i):
    """Numbers of 32 bits that look random, of a seed and counters."""
    x = (np.asarray(i, np.uint64) * np.uint64(0x9E3779B1) + np.uint64(seed * 0x85EBCA77)) & MASK
    x ^= x >> np.uint64(15)
    x = (x * np.uint64(0x2C1B3C6D)) & MASK
    x ^= x >> np.uint64(12)
    x = (x * np.uint64(0x297A2D39)) & MASK
    return x ^ (x >> np.uint64(15))


def checksum(values):
    values = np.asarray(values, np.uint64).ravel()
    i = np.arange(values.size, dtype=np.uint64)
    with np.errstate(over="ignore"):
        return int(np.sum(values * ((i * np.uint64(0x9E3779B1)) & MASK), dtype=np.uint64))


def grid(width, height):
    y, x = np.mgrid[0:height, 0:width].astype(np.uint64)
    return x, y, y * np.uint64(width) + x


def rgb(width, height, seed):
    """Blocks that are black, nearly black, white or noise."""
    x, y, i = grid(width, height)
    kind = mix(seed, (y // np.uint64(24)) * np.uint64(997) + x // np.uint64(24)) % np.uint64(4)
    noise = np.stack([mix(seed + 100 + c, i) for c in range(3)], -1)
    out = np.zeros((height, width, 3), np.uint64)
    out[kind == 1] = (noise % np.uint64(3))[kind == 1]
    out[kind == 2] = 255
    out[kind == 3] = (noise % np.uint64(256))[kind == 3]
    return out.astype(np.uint8)


def semantic(name, width, height, seed):
    """Indices of labels in blocks, among them 0 and what is missing."""
    x, y, _ = grid(width, height)
    index = mix(seed + 7, (y // np.uint64(5)) * np.uint64(991) + x // np.uint64(7)) % np.uint64(len(LABELS) + 1)
    out = np.stack([index * np.uint64(0), index // np.uint64(256), index % np.uint64(256)], -1)
    out[index == len(LABELS)] = 13
    if name == "void":
        out[:] = 13
    return out.astype(np.uint8)


def classes(seed):
    """A predicted class a pixel, 1024 x 512."""
    return (mix(seed + 50, np.arange(1024 * 512)) % np.uint64(len(CLASSES))).reshape(512, 1024)


def depth(width, height, seed):
    """Truth of 512ths of a metre: missing, 0, near and beyond 10 m."""
    i = grid(width, height)[2]
    value = mix(seed, i) % np.uint64(7000)
    kind = mix(seed + 1, i) % np.uint64(16)
    value[kind == 0] = 65535
    value[kind == 1] = 0
    return value.astype(np.uint16)


def predicted_depth(truth, seed):
    """Metres: about the truth, at a ratio of 1.25, nothing, or beyond 10 m."""
    truth = np.asarray(truth, np.uint16)
    h = mix(seed + 2, np.arange(truth.size)).reshape(truth.shape)
    metres = truth.astype(np.float64) / 512.0
    out = metres * (0.7 + (h % np.uint64(1024)).astype(np.float64) / 1024.0 * 0.6)
    kind = h // np.uint64(1024) % np.uint64(16)
    out[kind == 0] = metres[kind == 0] * 1.25
    out[kind == 1] = 0.0
    out[kind == 2] = 12.5
    return out


# Name, and the true depth as an image of one row.
DEPTHS = [("mixed", depth(4096, 1, 11)), ("one", np.array([[2048]], np.uint16)),
          ("beyond", np.full((1, 64), 6000, np.uint16)), ("even", depth(1000, 1, 12)), ("odd", depth(999, 1, 13))]


def vectors(n, seed):
    h = np.stack([mix(seed + c, np.arange(n)) for c in range(3)], -1)
    return (h % np.uint64(2001)).astype(np.float64) / 1000.0 - 1.0


def normals(n, seed):
    """True and predicted vectors, and which are evaluated: some are equal, opposite or of no length."""
    truth = vectors(n, seed)
    prediction = truth + 0.4 * vectors(n, seed + 10)
    kind = mix(seed + 20, np.arange(n)) % np.uint64(16)
    prediction[kind == 0] = truth[kind == 0]
    prediction[kind == 1] = -truth[kind == 1]
    prediction[kind == 2] = 0.0
    return truth, prediction, kind != 3


# Number of vectors and seed of each image.
NORMALS = [(4000, 31), (1, 40), (2501, 33)]


def quantized(values):
    """Rounded so that 32 bits hold them exactly."""
    return np.floor(values * 1024.0) / 1024.0


def metric_view(truth, seed):
    """Metres of about the truth, at a ratio of 1.25, below 0.001 m, or beyond 10 m."""
    return quantized(predicted_depth(truth, seed))


def affine_view(truth, seed):
    """Depth up to scale and shift, mostly negative."""
    h = mix(seed + 2, np.arange(truth.size)).reshape(truth.shape)
    spread = 0.8 + (h % np.uint64(1024)).astype(np.float64) / 1024.0 * 0.4
    out = truth.astype(np.float64) / 512.0 * spread * 0.25 - 3.0
    out[h // np.uint64(1024) % np.uint64(16) == 1] = 2.0
    return quantized(out)


def disparity_view(truth, seed):
    """Disparity up to scale and shift; some is not above 0."""
    h = mix(seed + 2, np.arange(truth.size)).reshape(truth.shape)
    spread = 0.8 + (h % np.uint64(1024)).astype(np.float64) / 1024.0 * 0.4
    out = 40.0 / (truth.astype(np.float64) / 512.0 + 0.25) * spread + 3.0
    kind = h // np.uint64(1024) % np.uint64(16)
    out[kind == 1] = 0.0
    out[kind == 2] = -2.0
    return quantized(out)


def flat_view(truth, seed):
    return np.full(truth.shape, 3.0)


def far_view(truth, seed):
    return np.full(truth.shape, -3.0)


# Name, true depth of views, seed, and the predictions of depth, disparity and metres.
VIEWS = [("mixed", depth(64, 48, 51), 52, affine_view, disparity_view, metric_view),
         ("odd", depth(37, 27, 53), 54, affine_view, disparity_view, metric_view),
         ("one", np.array([[0, 700], [65535, 6000]], np.uint16), 55, affine_view, disparity_view, metric_view),
         ("flat", depth(20, 10, 56), 57, flat_view, flat_view, flat_view),
         ("far", depth(20, 10, 56), 57, far_view, far_view, far_view)]


def view_classes(seed, count):
    """True and predicted classes of pixels. Class 5 is never true, class 9 never either; 255 is no label."""
    n = 5000
    truth = mix(seed, np.arange(n)) % np.uint64(14)
    truth[(truth == 5) | (truth == 9) | (truth == 13)] = 255
    guess = mix(seed + 1, np.arange(n)) % np.uint64(count)
    guess[guess == 9] = 3
    right = (mix(seed + 2, np.arange(n)) % np.uint64(3) > 0) & (truth < 255)
    guess[right] = truth[right]
    return truth.astype(np.int64), guess.astype(np.int64)


# Seeds of the views of a fold.
VIEW_SEEDS = [61, 64, 67]


def edges(width, height, seed):
    """Boxes before a wall, some missing; and a prediction that moves every seventh row by a pixel."""
    x, y, i = grid(width, height)
    block = mix(seed, (y // np.uint64(6)) * np.uint64(31) + x // np.uint64(5)) % np.uint64(40)
    truth = np.uint64(1000) + block * np.uint64(23) + mix(seed + 1, i) % np.uint64(60)
    truth[block == 0] = 65535
    prediction = np.where(y % np.uint64(7) == 0, np.roll(truth, 1, 1), truth).astype(np.float64) * 0.7
    prediction += (mix(seed + 2, i) % np.uint64(50)).astype(np.float64)
    prediction[block == 7] = -1.0
    return truth.astype(np.uint16), prediction


# Name, truth and prediction in any unit.
EDGES = [("boxes", *edges(64, 48, 71)), ("narrow", *edges(9, 31, 74)), ("flat", np.full((8, 9), 700, np.uint16),
                                                                       np.full((8, 9), 2.0))]


def outlines(width, height, seed, shift):
    """Classes in blocks, 255 for no label; and a prediction that is moved by rows and columns, with some noise."""
    x, y, i = grid(width, height)

    def block(x, y):
        kind = mix(seed, (y // np.uint64(13)) * np.uint64(37) + x // np.uint64(17)) % np.uint64(7)
        return np.where(kind == 6, np.uint64(255), kind)

    prediction = block(x + np.uint64(shift), y + np.uint64(shift))
    noisy = mix(seed + 1, i) % np.uint64(97) == 0
    prediction = np.where(noisy, mix(seed + 2, i) % np.uint64(8), prediction)
    return block(x, y).astype(np.int64), np.where(prediction == 255, 4, prediction).astype(np.int64)


# Name, true and predicted classes.
OUTLINES = [("near", *outlines(160, 120, 81, 1)), ("far", *outlines(160, 120, 84, 4)), ("narrow", *outlines(19, 70, 87, 1)),
            ("large", *outlines(420, 300, 90, 3)), ("whole", np.full((9, 12), 3), np.full((9, 12), 3)),
            ("other", np.full((9, 12), 3), np.full((9, 12), 1))]
