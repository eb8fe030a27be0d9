"""Figures as PDF, drawn by PDFium, against the same figures as PNG."""

import numpy as np
import pytest
from PIL import Image

SMALL = ["--views", "6", "--size", "96", "--pano-width", "256", "--points-per-m2", "50"]


def test_pdf_and_png_show_the_same(s3d, demo, tmp_path):
    pdfium = pytest.importorskip("pypdfium2")
    out, figs = tmp_path / "dataset", tmp_path / "figs"
    s3d("export", demo / "scan/scene.toml", "-o", out, *SMALL)
    s3d("figures", out, "-o", figs)

    pages = sorted(figs.glob("*.pdf"))
    assert [page.stem for page in pages] == ["area_1", "distributions", "examples", "modalities", "samples"]
    for page in pages:
        [sheet] = pdfium.PdfDocument(page)
        assert sheet.get_width() == 504
        png = Image.open(page.with_suffix(".png"))
        # Both at a third of the size, where resampling of small pictures no longer counts.
        drawn = sheet.render(scale=100 / 72).to_pil().convert("RGB")
        ours = np.asarray(png.resize(drawn.size, Image.Resampling.BOX), np.float32)
        difference = np.abs(np.asarray(drawn, np.float32) - ours).mean()
        assert difference < 4, f"{page.name}: {difference:.2f} of 255"
