"""Your tool: describes a tool in a file, computes its mass, and finds the better end to hold.

Prints:

    ladle: 503 g, centre of mass 26.4 cm from the handle's end
    by its bowl: 5.9 J
    by its handle: 7.3 J
"""

import tempfile
from pathlib import Path

from affordance import MODELS, MaterialMemory, Reach, list_options, load_path, load_tools, rank

FILE = """
tools:
  - name: ladle
    components:                                     # metres; T lies in the handle's end
      - {cylinder: [0.006, 0.24], position: [0.12, 0, 0], rpy_deg: [0, 90, 0], material: beech}
      - {semi_axes: [0.035, 0.035, 0.012], position: [0.27, 0, 0], material: steel}
    grips:
      handle: {position: [0.05, 0, 0]}
      bowl: {position: [0.27, 0, 0], rpy_deg: [0, 180, 0]}
"""
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "tools.yaml"
    path.write_text(FILE, encoding="utf-8")
    (ladle,) = load_tools(path)
x, _, z = 100.0 * ladle.p_TTcm
print(f"{ladle.name}: {1000.0 * ladle.mass:.0f} g, centre of mass {x:.1f} cm from the handle's end")
known = MaterialMemory.from_densities({"steel": 7850, "beech": 720})
task = Reach(load_path(MODELS / "paths" / "reach.yaml"))
for entry in rank(list_options(ladle), task, known).ranked:
    print(f"by its {entry.option.grip}: {entry.work:.1f} J")
