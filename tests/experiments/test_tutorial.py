import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_tutorial_runs_and_leaves_its_pictures_alone(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "experiments.tutorial"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    left = sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file())
    assert left == ["out/tutorial/grid.png", "out/tutorial/questions.png"]

    lines = done.stdout.splitlines()
    assert "the goal is reached from 100% of the cells" in lines
    asked = [line for line in lines if line.startswith("  What to do with a ")]
    assert len(asked) == len(set(asked)) == 6
    assert sum(line.startswith("  And in ") for line in lines) == 3  # each cluster once

    # What the page says of the figures, with room for another processor's last bits.
    (learnt,) = [line for line in lines if "before any question" in line]
    before, after = (int(word.rstrip("%")) for word in learnt.split() if word.endswith("%"))
    (planned,) = [line for line in lines if "with the aim known" in line]
    best = int(planned.split()[-1].rstrip("%"))
    assert before < after - 10
    assert best - 10 <= after <= best
