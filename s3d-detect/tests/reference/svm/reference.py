"""Writes cases.json: inputs, and the objective that scikit-learn's LinearSVC reaches on them.

Run once with scikit-learn 1.x: python reference.py > cases.json
"""
import json
import sys

import numpy as np
import sklearn
from sklearn.svm import LinearSVC

rng = np.random.default_rng(2017)
cases = []
sizes = [(40, 6, 1.0, 0.5, 1.0), (60, 12, 0.1, 0.2, 0.3), (30, 50, 10.0, 0.4, 1.0)]
for rows, columns, cost, share, overlap in sizes:
    positive = rng.random(rows) < share
    x = rng.normal(size=(rows, columns)) * (rng.random((rows, columns)) < 0.6)
    x = np.round(x + overlap * positive[:, None] * 0.5, 3).astype(np.float32).astype(np.float64)
    weight = np.where(positive, 2.0, 1.0)
    case = {"x": np.round(x, 3).tolist(), "positive": positive.tolist(), "costs": (cost * weight).tolist()}
    y = np.where(positive, 1, -1)
    for loss in ["hinge", "squared_hinge"]:
        m = LinearSVC(C=cost, loss=loss, dual=True, tol=1e-9, max_iter=10_000_000, random_state=1)
        m.fit(x, y, sample_weight=weight)
        w, b = m.coef_[0], m.intercept_[0]
        short = np.maximum(0, 1 - y * (x @ w + b))
        case[loss] = 0.5 * (w @ w + b * b) + (cost * weight * (short if loss == "hinge" else short**2)).sum()
    cases.append(case)
json.dump({"scikit-learn": sklearn.__version__, "numpy": np.__version__, "cases": cases}, sys.stdout)
print()
