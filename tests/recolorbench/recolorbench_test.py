#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""RecolorBench from end to end with tiny tasks: recolorbench_test.py RETINT FOLDER"""
import json
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent


def main():
    retint, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)

    def run(script, *more):
        command = [sys.executable, "-B", HERE / script, "--retint", retint, "--work", folder, *more]
        subprocess.run([str(part) for part in command], check=True)

    run("make.py", "--scenes", "sample,box", "--objects", "ball,box", "--size",
        "96x72x10")
    results = folder / "results"
    run("baselines.py", "--results", results, "--methods", "retint,degree0", "--tasks=-true")
    # A program that does nothing.
    for task in ("sample-ball-recolor-true", "sample-ball-grade-true"):
        (results / "nothing" / task).mkdir(parents=True)
        shutil.copy(folder / "scenes" / "sample" / "splat.ply", results / "nothing" / task)
    run("score.py", "--results", results / "retint", results / "degree0", results / "nothing",
        "--output", folder / "scores.json", "--markdown", folder / "scores.md")
    scores = json.loads((folder / "scores.json").read_text())
    of = {program: tasks["sample-ball-recolor-true"] for program, tasks in scores["tasks"].items()}
    assert of["nothing"]["hit"] == 0 and of["nothing"]["missed"] == 1, of["nothing"]
    assert of["nothing"]["leak"] == of["nothing"]["changed_bytes"] == 0, of["nothing"]
    assert of["retint"]["hit"] > 0.9 and of["retint"]["missed"] < 0.05, of["retint"]
    assert of["nothing"]["de_inside"] > of["degree0"]["de_inside"] > of["retint"]["de_inside"], of
    assert of["retint"]["psnr"] > of["degree0"]["psnr"] > of["nothing"]["psnr"], of
    assert 0 < of["degree0"]["changed_bytes"] < of["retint"]["changed_bytes"], of
    lettering = {program: tasks["box-box-lettering-true"]
                 for program, tasks in scores["tasks"].items()}
    assert "hit" not in lettering["retint"] and lettering["retint"]["psnr"] > 20, lettering
    assert lettering["degree0"] is None and lettering["nothing"] is None, lettering
    assert scores["tasks"]["retint"]["sample-ball-recolor-one"] is None
    assert "| retint |" in (folder / "scores.md").read_text()


if __name__ == "__main__":
    main()
