"""`python -m benchmarks.notebooks`: run the notebooks of docs/ without Jupyter, and write what they say into them."""

import base64
import contextlib
import io
import json
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

NOTEBOOKS = sorted((Path(__file__).parent.parent / "docs" / "notebooks").glob("*.ipynb"))


def run(notebook: dict[str, Any]) -> list[list[dict[str, Any]]]:
    """Run the cells of code in order, in one namespace; what each of them printed and drew, as a notebook holds it."""
    names: dict[str, Any] = {}
    answers = []
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec("".join(cell["source"]), names)
        text = printed.getvalue().splitlines(keepends=True)
        said = [{"name": "stdout", "output_type": "stream", "text": text}] if text else []
        answers.append(said + [_drawn(number) for number in plt.get_fignums()])
        plt.close("all")
    return answers


def _drawn(number: int) -> dict[str, Any]:
    image = io.BytesIO()
    plt.figure(number).savefig(image, dpi=110, metadata={"Software": None})
    data = base64.b64encode(image.getvalue()).decode()
    return {"data": {"image/png": data}, "metadata": {}, "output_type": "display_data"}


def main() -> None:
    plt.switch_backend("Agg")
    for path in NOTEBOOKS:
        notebook = json.loads(path.read_text())
        code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
        for cell, answer in zip(code, run(notebook), strict=True):
            cell["outputs"] = answer
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
