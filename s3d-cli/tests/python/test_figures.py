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
    assert [page.stem for page in pages] == ["area_1", "classes", "distributions", "examples", "modalities", "samples"]
    for page in pages:
        [sheet] = pdfium.PdfDocument(page)
        assert sheet.get_width() == 504
        png = Image.open(page.with_suffix(".png"))
        drawn = sheet.render(scale=300 / 72).to_pil().convert("RGB")
        assert np.abs(np.subtract(drawn.size, png.size)).max() <= 1
        # Edges are smoothed in different ways: means of 12 by 12 pixels are compared.
        size = [side // 12 for side in png.size]
        means = [np.asarray(image.resize(size, Image.Resampling.BOX), np.float32) for image in (drawn, png)]
        difference = np.abs(means[0] - means[1]).mean()
        assert difference < 4, f"{page.name}: {difference:.2f} of 255"
