"""Tests the files of docs/cluster that other programs read: Kubernetes' files by their schema, Snakemake's by running them.
Slurm's files have a test of their own, docs/cluster/slurm/test."""

import filecmp
import json
import subprocess
import sys
from pathlib import Path

import pytest

CLUSTER = Path(__file__).resolve().parents[3] / "docs" / "cluster"
KUBERNETES = sorted((CLUSTER / "kubernetes").glob("*.yaml"))


@pytest.mark.parametrize("path", KUBERNETES, ids=lambda path: path.name)
def test_kubernetes_takes_the_files(path):
    yaml = pytest.importorskip("yaml")
    kubernetes_validate = pytest.importorskip("kubernetes_validate")
    documents = list(yaml.safe_load_all(path.read_text()))
    assert documents
    # The first version with a limit of retries for each index, and the last version that the package knows.
    for version in ["1.29", kubernetes_validate.latest_version()]:
        for document in documents:
            kubernetes_validate.validate(document, version, strict=True)


def test_kubernetes_shards_are_as_many_as_completions():
    yaml = pytest.importorskip("yaml")
    for job in ["plan", "export"]:
        spec = yaml.safe_load((CLUSTER / "kubernetes" / f"{job}.yaml").read_text())["spec"]
        command = spec["template"]["spec"]["containers"][0]["args"][0]
        assert f'"$((JOB_COMPLETION_INDEX + 1))/{spec["completions"]}"' in command


def same(a, b):
    compared = filecmp.dircmp(a, b)
    assert not compared.left_only and not compared.right_only, (compared.left_only, compared.right_only)
    names = compared.common_files
    _, mismatch, errors = filecmp.cmpfiles(a, b, names, shallow=False)
    assert not mismatch and not errors, (mismatch, errors)
    return len(names) + sum(same(Path(a) / name, Path(b) / name) for name in compared.common_dirs)


def test_snakemake_makes_the_data_set_of_a_single_run(s3d, demo, tmp_path):
    pytest.importorskip("snakemake")
    options = ["--views", "6", "--size", "64"]
    others = ["--pano-width", "128", "--points-per-m2", "50"]
    scene = demo / "scan" / "scene.toml"
    single = tmp_path / "single"
    binary = s3d("export", scene, "-o", single, *options, *others).args[0]
    config = {
        "s3d": binary,
        "scenes": [str(scene)],
        "out": str(tmp_path / "out"),
        "plan": str(tmp_path / "plan"),
        "done": str(tmp_path / "done"),
        "plan_options": " ".join(options),
        "export_options": " ".join(others),
        "plan_tasks": 2,
        "export_tasks": 3,
        "threads": 1,
        "memory_mb": 500,
        "minutes": 10,
    }
    # JSON is valid YAML.
    (tmp_path / "config.yaml").write_text(json.dumps(config))
    call = [sys.executable, "-m", "snakemake", "--cores", "2", "--snakefile", CLUSTER / "snakemake" / "Snakefile"]
    done = subprocess.run([*call, "--directory", tmp_path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert same(single, tmp_path / "out") > 100
