"""Runs the reference programs on cases.json and writes expected.json; see README.md. Usage: python reference.py REPOS

Only numpy's part of the programs is run: torch and others are replaced by what they need of them."""

import builtins
import importlib.util
import json
import logging
import os
import runpy
import sys
import tempfile
import types
import warnings

import numpy as np

warnings.filterwarnings("ignore")
repos = os.path.abspath(sys.argv[1])
cases = json.load(open("cases.json"))


def stub(name, **values):
    module = types.ModuleType(name)
    module.__dict__.update(values)
    sys.modules[name] = module
    return module


def load(name, path):
    spec = importlib.util.spec_from_file_location(name, os.path.join(repos, path))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


class Registry:
    def register_module(self):
        return lambda cls: cls


class Tensor:
    """An array with the methods of a tensor that are called."""

    def __init__(self, array):
        self.array = array

    def size(self, axis):
        return self.array.shape[axis]

    def detach(self):
        return self

    def cpu(self):
        return self

    def numpy(self):
        return self.array


for name in ["wandb", "torch", "torch.distributed", "pointops", "pointcept", "pointcept.utils", "pointcept.engines"]:
    stub(name)
sys.modules["torch"].distributed = sys.modules["torch.distributed"]
stub("pointcept.engines.hooks").__path__ = []
stub("pointcept.utils.comm")
sys.modules["pointcept.utils"].comm = sys.modules["pointcept.utils.comm"]
stub("pointcept.utils.logger", get_root_logger=None)
stub("pointcept.engines.hooks.default", HookBase=object)
stub("pointcept.engines.hooks.builder", HOOKS=Registry())
misc = load("pointcept.utils.misc", "Pointcept/pointcept/utils/misc.py")
evaluator = load("pointcept.engines.hooks.evaluator", "Pointcept/pointcept/engines/hooks/evaluator.py")
six_fold = load("test_s3dis_6fold", "Pointcept/tools/test_s3dis_6fold.py")
stub("mmengine")
stub("mmengine.logging", print_log=lambda *args, **kwargs: None)
seg_eval = load("seg_eval", "mmdetection3d/mmdet3d/evaluation/functional/seg_eval.py")
open3d = load("semseg_metric", "Open3D-ML/ml3d/torch/modules/metrics/semseg_metric.py")
NAMES = six_fold.CLASS_NAMES


def points(runs, columns):
    if not runs:
        return np.zeros((0, columns), int)
    return np.repeat([r[:-1] for r in runs], [r[-1] for r in runs], axis=0)


def locals_at_return(function, *args):
    found = {}

    def trace(frame, event, _):
        if frame.f_code is not function.__code__:
            return None

        def inner(frame, event, _):
            if event == "return":
                found.update(frame.f_locals)
            return inner

        return inner

    sys.settrace(trace)
    function(*args)
    sys.settrace(None)
    return found


def sem3d(rooms):
    truth = [points(r["truth"], 2)[:, 0] for r in rooms]
    predicted = [points(r["predicted"], 1)[:, 0] for r in rooms]
    sums = [np.sum(s, axis=0) for s in zip(*[misc.intersection_and_union(p, t, 13, -1) for p, t in zip(predicted, truth)])]
    scores = locals_at_return(six_fold.evaluation, *sums)
    keys = ["iou_class", "accuracy_class", "mIoU", "mAcc", "allAcc"]
    pointcept = [np.asarray(scores[k]).tolist() for k in keys]
    # The program's number for void is 13.
    of_mmdet3d = [np.where(t < 0, 13, t) for t in truth]
    r = seg_eval.seg_eval(of_mmdet3d, [p.copy() for p in predicted], dict(enumerate(NAMES)), 13)
    hist = sum(seg_eval.fast_hist(p, t, 13) for p, t in zip(predicted, truth))
    accuracy = (np.diag(hist) / hist.sum(axis=1)).tolist()
    mmdet3d = [[r[n] for n in NAMES], accuracy, r["miou"], r["acc_cls"], r["acc"]]
    metric = open3d.SemSegMetric()
    for p, t in zip(predicted, truth):
        metric.update(Tensor(np.eye(13)[p[t >= 0]]), Tensor(t[t >= 0]))
    iou, acc = metric.iou(), metric.acc()
    return {"pointcept": pointcept, "mmdetection3d": mmdet3d, "open3d-ml": [iou[:-1], acc[:-1], iou[-1], acc[-1]]}


def inst_ap(rooms):
    hook = evaluator.InsSegEvaluator(segment_ignore_index=(-1,), instance_ignore_index=-1)
    data = types.SimpleNamespace(num_classes=13, names=NAMES)
    hook.trainer = types.SimpleNamespace(cfg=types.SimpleNamespace(data=data))
    hook.before_train()
    scenes = []
    for room in rooms:
        truth = points(room["truth"], 2)
        masks = np.zeros((len(room["masks"]), len(truth)), bool)
        for mask, m in zip(masks, room["masks"]):
            for a, b in m["ranges"]:
                mask[a:b] = True
        predicted = {
            "pred_classes": np.array([m["class"] for m in room["masks"]], int),
            "pred_scores": np.array([m["score"] for m in room["masks"]], float),
            "pred_masks": masks,
        }
        gt, pred = hook.associate_instances(predicted, Tensor(truth[:, 0]), Tensor(truth[:, 1]))
        scenes.append({"gt": gt, "pred": pred})
    scores = hook.evaluate_matches(scenes)
    classes = [[scores["classes"][n][k] for k in ["ap", "ap50%", "ap25%"]] for n in NAMES]
    return {"classes": classes, "mean": [scores[k] for k in ["all_ap", "all_ap_50%", "all_ap_25%"]]}


def inst_cov(rooms):
    script = os.path.join(repos, "ASIS/models/ASIS/eval_iou_accuracy.py")
    with tempfile.TemporaryDirectory() as folder:
        here = os.getcwd()
        os.chdir(folder)
        os.mkdir("log5_test")
        with open("log5_test/output_filelist.txt", "w") as names:
            for i, room in enumerate(rooms):
                truth = points(room["truth"], 2)
                predicted = np.c_[points(room["classes"], 1), points(room["instances"], 1)]
                np.savetxt(f"room{i}_gt.txt", truth, fmt="%d")
                np.savetxt(f"room{i}_pred.txt", predicted, fmt="%d")
                names.write(f"room{i}_pred.txt\n")
        # The script needs Python 2 and the numpy of its time.
        builtins.xrange, np.int, np.float = range, int, float
        found = runpy.run_path(script)
        os.chdir(here)
    classes = [found[k] for k in ["precision", "recall", "MUCov", "MWCov"]]
    return {"classes": np.transpose(classes).tolist(), "mean": [np.mean(c) for c in classes]}


def plain(value):
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    return None if np.isnan(value) else float(value)


logging.disable()
score = {"sem3d": sem3d, "inst-ap": inst_ap, "inst-cov": inst_cov}
expected = {p: {n: plain(score[p](rooms)) for n, rooms in c.items()} for p, c in cases.items()}
json.dump(expected, open("expected.json", "w"), indent=1)
