"""Runs the reference programs on the inputs and writes what they say: see README.md. With names of parts it runs
these, and keeps the numbers of the others."""
import csv, json, os, re, runpy, sys, types

import numpy as np

sources, work = map(os.path.abspath, sys.argv[1:3])
here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, here)
import inputs

PARTS = sys.argv[3:] or ["resampling", "sem_pano", "depths", "normals", "views", "sem_view", "depth_edge", "sem_edge"]
if not set(PARTS) <= {"views", "sem_view", "depth_edge", "sem_edge"}:
    np.float = float  # UniFuse's, which later numpy has not.
    import cv2, imageio.v2 as imageio, PIL, PIL.Image as Image, scipy, skimage, skimage.transform
    import imageio as imageio_package

    imageio_package.imread, imageio_package.imwrite = imageio.imread, imageio.imwrite
import torch

if len(sys.argv) > 3:
    out = json.load(open(f"{here}/expected.json"))
else:
    out = {"versions": {"python": sys.version.split()[0], "numpy": np.__version__, "torch": torch.__version__,
                        "Pillow": PIL.__version__, "scikit-image": skimage.__version__,
                        "scipy": scipy.__version__, "opencv-python-headless": cv2.__version__,
                        "imageio": imageio_package.__version__}}


def stub(name, **members):
    module = types.ModuleType(name)
    module.__dict__.update(members)
    sys.modules[name] = module
    return module


# The scripts import these modules, but the calls here do not use them.
if "views" not in PARTS:
    stub("pandas")
transforms = stub("torchvision.transforms", ToTensor=lambda: lambda a: a, Normalize=lambda **_: lambda a: a)
stub("torchvision", transforms=transforms)


def snippet(n):
    """The n-th Python program in HoHoNet's README of preparing the data."""
    text = open(f"{sources}/HoHoNet/README_prepare_data_s2d3d.md").read()
    return re.findall(r"```python\n(.*?)```", text, re.S)[n]


def resampling():
    found = {"pillow": {}, "skimage": {}, "opencv": {}}
    for n, m in inputs.AXES:
        line = np.arange(n, dtype=np.int32)[None].repeat(2, 0)
        key = f"{n} {m}"
        found["pillow"][key] = inputs.checksum(np.array(Image.fromarray(line).resize((m, 2), Image.NEAREST))[0])
        scaled = skimage.transform.resize(line.astype(float), (2, m), order=0, mode="wrap", anti_aliasing=False,
                                          preserve_range=True)
        found["skimage"][key] = inputs.checksum(scaled[0].astype(np.int64))
        scaled = cv2.resize(line, dsize=(m, 2), interpolation=cv2.INTER_NEAREST)
        found["opencv"][key] = inputs.checksum(scaled[0])
    found["lanczos"] = {}
    for name, width, height, seed in inputs.PANORAMAS:
        image = np.array(Image.fromarray(inputs.rgb(width, height, seed)).resize((1024, 512), Image.LANCZOS))
        found["lanczos"][name] = [inputs.checksum(image[..., c]) for c in range(3)]
    out["resampling"] = found


def sem_pano():
    sys.path.insert(0, f"{sources}/HoHoNet")
    raw, data = f"{work}/raw", f"{work}/sem"
    os.makedirs(raw, exist_ok=True)
    # The script also looks up missing pixels, at index 3341.
    padded = inputs.LABELS + inputs.LABELS[:1] * (3342 - len(inputs.LABELS))
    json.dump(padded, open(f"{raw}/semantic_labels.json", "w"))
    json.dump({"<UNK>": 0, **{c: i + 1 for i, c in enumerate(inputs.CLASSES)}}, open(f"{raw}/name2label.json", "w"))
    np.save(f"{raw}/colors.npy", np.zeros((14, 3), np.uint8))
    panoramas = {name: (width, height, seed) for name, width, height, seed in inputs.PANORAMAS}
    areas = ["area_1", "area_2", "area_3", "area_4", "area_5a", "area_5b", "area_6"]
    holds = {area: names for fold in inputs.FOLDS.values() for area, names in fold.items()}
    for area in areas:
        for kind in ("rgb", "semantic"):
            os.makedirs(f"{raw}/{area}/pano/{kind}", exist_ok=True)
        for name in holds[area]:
            width, height, seed = panoramas[name]
            imageio.imwrite(f"{raw}/{area}/pano/rgb/{name}.png", inputs.rgb(width, height, seed))
            imageio.imwrite(f"{raw}/{area}/pano/semantic/{name}.png", inputs.semantic(name, width, height, seed))
    import argparse
    sys.argv = ["prepare", "--ori_root", raw, "--new_root", data]
    exec(compile(snippet(1), "prepare_S2D3D_sem.py", "exec"), {"argparse": argparse, "__name__": "prepare"})

    # The data set counts files of depth, but does not read them.
    for area in areas:
        os.makedirs(f"{data}/{area}/depth", exist_ok=True)
        for name in holds[area]:
            open(f"{data}/{area}/depth/{name}.png", "w").close()

    class Net(torch.nn.Module):
        """Answers with the given predictions, in the order of the data set."""
        queue = []

        def __init__(self, **_):
            super().__init__()

        def infer(self, _):
            prediction = torch.from_numpy(inputs.classes(Net.queue.pop(0)).astype(np.int64))
            return {"sem": torch.nn.functional.one_hot(prediction, 13).permute(2, 0, 1)[None].float()}

    stub("reference_net", Net=Net)
    torch.save({}, f"{work}/net.pth")
    out["sem-pano"] = {}
    for fold, areas in inputs.FOLDS.items():
        # The network never sees a panorama that is void.
        Net.queue = [panoramas[n][2] for names in areas.values() for n in names if n != "void"]
        with open(f"{work}/sem.yaml", "w") as f:
            f.write(f"cuda: False\nnum_workers: 0\ndataset:\n  name: S2d3dSemDataset\n  common_kwargs:\n"
                    f"    root: {data}\n    hw: (512, 1024)\n    depth: False\n  valid_kwargs:\n"
                    f"    fold: {fold}\nmodel:\n  file: reference_net\n  modelclass: Net\n  kwargs:\n"
                    f"    modalities_config:\n      SemanticSegmenter:\n        num_classes: 13\n")
        sys.argv = ["test_sem.py", "--cfg", f"{work}/sem.yaml", "--pth", f"{work}/net.pth", "--out", work, "--y"]
        said = runpy.run_path(f"{sources}/HoHoNet/test_sem.py", run_name="__main__")
        out["sem-pano"][fold] = {"classes": list(said["id2class"]), "cm": said["cm"].tolist(),
                                 "iou": said["ious"].tolist(), "accuracy": said["accs"].tolist(),
                                 "mean": [said["ious"].mean(), said["accs"].mean()]}


def depths():
    hohonet = runpy.run_path(f"{sources}/HoHoNet/test_depth.py", run_name="test_depth")["eval_metric"]
    unifuse = runpy.run_path(f"{sources}/UniFuse/UniFuse/metrics.py")["compute_depth_metrics"]

    def of_hohonet(truth, prediction):
        mask = truth > 0
        said = hohonet(prediction.clamp(0.01)[mask], truth[mask], 10)
        return [said[k] for k in ("mae", "mre", "rmse", "rmse_log", "log10", "delta_1", "delta_2", "delta_3")]

    def of_unifuse(truth, prediction, median):
        mask = (truth > 0) & (truth <= 10)
        said = unifuse(truth.clone(), prediction.clone(), mask, median)
        return [float(v) for v in said]

    out["depth"] = {}
    for seed, (name, units) in enumerate(inputs.DEPTHS):
        prediction = torch.from_numpy(inputs.predicted_depth(units, seed))
        zero = torch.from_numpy(np.where(units == 65535, 0, units / 512))
        far = np.minimum(units.astype(float) / 512, 11)
        far = torch.from_numpy(far)
        found = {"hohonet": of_hohonet(zero.clamp(max=10), prediction),
                 "hohonet in 32 bits": of_hohonet(zero.float().clamp(max=10), prediction.float())}
        if ((far > 0) & (far <= 10)).any():
            found["unifuse"] = of_unifuse(far, prediction, False)
            found["unifuse, median"] = of_unifuse(far, prediction, True)
        out["depth"][name] = found

    # From full-size files to scores.
    for folder in ("rgb", "depth"):
        os.makedirs(f"{work}/depth_raw/area_1/pano/{folder}", exist_ok=True)
    units = inputs.depth(4096, 2048, 21)
    imageio.imwrite(f"{work}/depth_raw/area_1/pano/depth/x_depth.png", units)
    imageio.imwrite(f"{work}/depth_raw/area_1/pano/rgb/x_rgb.png", np.zeros((2048, 4096, 3), np.uint8))
    scaled = skimage.transform.rescale(units, 0.25, order=0, mode="wrap", anti_aliasing=False, preserve_range=True)
    os.makedirs(f"{work}/depth", exist_ok=True)
    imageio.imwrite(f"{work}/depth/x_depth.png", scaled.astype(np.uint16))
    imageio.imwrite(f"{work}/depth/x_rgb.png", np.zeros((512, 1024, 3), np.uint8))
    open(f"{work}/depth.txt", "w").write("x_rgb.png x_depth.png\n")
    from lib.dataset import S2d3dDepthDataset
    prediction = torch.from_numpy(inputs.predicted_depth(inputs.depth(1024, 512, 22), 23))
    truth = S2d3dDepthDataset(f"{work}/depth", f"{work}/depth.txt", hw=(512, 1024))[0]["depth"][0]
    out["depth"]["file"] = {"hohonet": of_hohonet(truth.double(), prediction)}
    sys.path.insert(0, f"{sources}/UniFuse/UniFuse")
    stub("datasets").__path__ = [f"{sources}/UniFuse/UniFuse/datasets"]
    from datasets.stanford2d3d import Stanford2D3D
    open(f"{work}/unifuse.txt", "w").write("rgb/x_rgb.png depth/x_depth.png\n")
    data = Stanford2D3D(f"{work}/depth_raw/area_1/pano", f"{work}/unifuse.txt", disable_color_augmentation=True)
    data.to_tensor = data.normalize = lambda a: a
    sample = data[0]
    said = unifuse(sample["gt_depth"][0].clone(), prediction.clone(), sample["val_mask"][0], False)
    out["depth"]["file"]["unifuse"] = [float(v) for v in said]


def normals():
    sys.path.insert(0, f"{sources}/DSINE")
    dsine = runpy.run_path(f"{sources}/DSINE/utils/utils.py")
    omnidata = runpy.run_path(f"{sources}/omnidata/paper_code/evaluation_metrics.py")["get_metrics"]
    images = [inputs.normals(*image) for image in inputs.NORMALS]
    keys = ("mean", "median", "rmse", "a1", "a2", "a3", "a4", "a5")

    def pooled(kind):
        errors = []
        for truth, prediction, valid in images:
            truth, prediction = (torch.from_numpy(v.T.copy())[None, :, :, None].to(kind) for v in (truth, prediction))
            error = dsine["compute_normal_error"](prediction, truth)
            errors.append(error[torch.from_numpy(valid)[None, None, :, None]])
        said = dsine["compute_normal_metrics"](torch.cat(errors))
        return [float(said[k]) for k in keys]

    out["normal"] = {"dsine": pooled(torch.float64), "dsine in 32 bits": pooled(torch.float32), "omnidata": []}
    keys = ("ang_error_mean", "ang_error_median", "percentage_within_11.25_degrees",
            "percentage_within_22.5_degrees", "percentage_within_30_degrees")
    for truth, prediction, valid in images:
        truth, prediction = (torch.from_numpy(v.T.copy())[None, :, :, None] for v in (truth, prediction))
        mask = torch.from_numpy(valid)[None, None, :, None].repeat(1, 3, 1, 1)
        said = omnidata(prediction, truth, task="normal", masks=mask)
        out["normal"]["omnidata"].append(said and [float(said[k]) for k in keys])


def views():
    """Marigold's script as a whole, on our views instead of its data sets."""
    truths = {name: torch.from_numpy(np.where(truth == 65535, 0, truth / 512)) for name, truth, *_ in inputs.VIEWS}

    class Views(torch.utils.data.Dataset):
        # As in src/dataset/nyu_dataset.py and scannet_dataset.py.
        min_depth, max_depth, name_mode, disp_name, filename_ls_path = 1e-3, 10.0, None, "views", ""

        def __len__(self):
            return len(truths)

        def __getitem__(self, at):
            name, truth = list(truths.items())[at]
            valid = torch.logical_and(truth > self.min_depth, truth < self.max_depth)
            return {"depth_raw_linear": truth[None], "valid_mask_raw": valid[None], "rgb_relative_path": name}

    stub("src.dataset", DatasetMode=types.SimpleNamespace(EVAL=None), get_dataset=lambda *_, **__: Views(),
         get_pred_name=lambda name, mode, suffix: name + suffix)
    script = f"{sources}/Marigold/script/depth/eval.py"
    os.makedirs(f"{work}/views", exist_ok=True)
    open(f"{work}/views/empty.yaml", "w").close()
    out["views"] = {"versions": {"numpy": np.__version__, "torch": torch.__version__}}
    for at, (variant, alignment) in enumerate([("marigold", "least_square"), ("marigold-metric", None),
                                               ("marigold-disparity", "least_square_disparity")]):
        at = {"marigold": 0, "marigold-disparity": 1, "marigold-metric": 2}[variant]
        for name, truth, seed, *predictions in inputs.VIEWS:
            np.save(f"{work}/views/{name}.npy", predictions[at](truth, seed))
        sys.argv = ["eval.py", "--prediction_dir", f"{work}/views", "--dataset_config", f"{work}/views/empty.yaml",
                    "--base_data_dir", work, "--output_dir", f"{work}/views", "--no_cuda"]
        sys.argv += ["--alignment", alignment] if alignment else []
        runpy.run_path(script, run_name="__main__")
        rows = csv.reader(open(f"{work}/views/per_sample_metrics.csv"))
        out["views"][variant] = {row[0][:-4]: [float(v) for v in row[1:]] for row in rows if row[0] != "filename"}

    # The script reads predictions in 32 bits, in which it computes without an alignment.
    metrics = runpy.run_path(f"{sources}/Marigold/src/util/metric.py")
    names = ("abs_relative_difference", "squared_relative_difference", "rmse_linear", "rmse_log", "log10",
             "delta1_acc", "delta2_acc", "delta3_acc", "i_rmse", "silog_rmse")
    found = {}
    for name, _, seed, *predictions in inputs.VIEWS:
        truth = truths[name]
        valid = torch.logical_and(truth > 1e-3, truth < 10)
        units = dict((n, t) for n, t, *_ in inputs.VIEWS)[name]
        metres = torch.from_numpy(np.clip(predictions[2](units, seed), 1e-3, 10.0))
        found[name] = [float(metrics[n](metres, truth, valid)) for n in names]
    out["views"]["marigold-metric in 64 bits"] = found


def sem_view():
    """CMX's functions, in the order of its eval.py."""
    said = runpy.run_path(f"{sources}/CMX/utils/metric.py")
    hist, correct, labeled = np.zeros((13, 13)), 0, 0
    for seed in inputs.VIEW_SEEDS:
        truth, guess = inputs.view_classes(seed, 13)
        of_view = said["hist_info"](13, guess, truth)
        hist, labeled, correct = hist + of_view[0], labeled + of_view[1], correct + of_view[2]
    iou, mean_iou, _, freq_iou, mean_accuracy, accuracy = said["compute_score"](hist, correct, labeled)
    undefined = [None if np.isnan(v) else float(v) for v in iou]
    out["sem-view"] = {"iou": undefined, "mean": [mean_iou, mean_accuracy], "overall": [freq_iou, accuracy],
                       "pixels": int(labeled)}


def depth_edge():
    """Depth Pro's functions. Missing pixels are NaN, which is above no limit."""
    said = runpy.run_path(f"{sources}/ml-depth-pro/src/depth_pro/eval/boundary_metrics.py")
    limits, weights = said["get_thresholds_and_weights"](1.05, 1.25, 10)
    out["depth-edge"] = {}
    for name, truth, prediction in inputs.EDGES:
        truth = np.where(truth == 65535, np.nan, truth / 512.0)
        prediction = np.where(np.isnan(truth), np.nan, prediction)
        inverse = [said["invert_depth"](depth) for depth in (prediction, truth)]
        flags = [{"return_p": True}, {"return_r": True}]
        of = [sum(w * said["boundary_f1"](*inverse, t, **flag) for t, w in zip(limits, weights)) for flag in flags]
        out["depth-edge"][name] = [float(v) for v in (said["SI_boundary_F1"](prediction, truth), *of)]


def sem_edge():
    """DAVIS's function, on the mask of each class that is there. It returns F alone."""
    said = runpy.run_path(f"{sources}/davis2017-evaluation/davis2017/metrics.py")
    out["sem-edge"] = {}
    for name, truth, prediction in inputs.OUTLINES:
        void = truth == 255
        there = sorted((set(truth[~void]) | set(prediction[~void])))
        out["sem-edge"][name] = {str(c): float(said["db_eval_boundary"](truth == c, prediction == c, void))
                                 for c in there}


for part in PARTS:
    globals()[part]()
json.dump(out, open(f"{here}/expected.json", "w"), indent=1)
