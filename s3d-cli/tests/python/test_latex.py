"""Tables and figures, set by pdflatex on a page of two columns."""

import shutil
import subprocess

import pytest

SMALL = ["--views", "6", "--size", "96", "--pano-width", "256", "--points-per-m2", "50"]
PAGE = r"""\documentclass[10pt,twocolumn]{article}
\usepackage[margin=2cm]{geometry}
\usepackage{amssymb,graphicx,multirow}
\graphicspath{{figs/}}
\begin{document}
\input{tables}
\input{figs/figures}
\end{document}
"""


def test_tables_and_figures_fit_on_their_page(s3d, demo, tmp_path):
    if not shutil.which("pdflatex"):
        pytest.skip("pdflatex is not installed (Debian: texlive-latex-extra)")
    out = tmp_path / "dataset"
    s3d("export", demo / "scan/scene.toml", "-o", out, *SMALL)
    s3d("figures", out, "-o", tmp_path / "figs", "--dpi", "72")
    (tmp_path / "tables.tex").write_text(s3d("stats", out, "--latex").stdout)
    (tmp_path / "page.tex").write_text(PAGE)

    call = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "page.tex"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "Overfull" not in done.stdout, done.stdout
    assert (tmp_path / "page.pdf").stat().st_size > 10_000
