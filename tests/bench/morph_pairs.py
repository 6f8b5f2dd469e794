#!/usr/bin/env python3
"""morph_pairs.py - morphs every character into every other one and prints a table.

    tests/bench/morph_pairs.py CHARACTERS OUT [--grid N] [--morph build/morph] [--only TEXT] [--table] [-- OPTIONS OF MORPH]

CHARACTERS is a folder of .glb files. What a run reports goes to OUT/SOURCE-TARGET.json; a pair whose report is there, and not
older than the program, is not run again, so that an interrupted table goes on where it was. --table prints only what is there.
"""
import argparse
import json
import pathlib
import subprocess
import sys

WALKS = ("Walking_A", "Walk", "Robot_Walking")  # else the first animation
TWINS = {"CesiumMan_wnorm"}                      # CesiumMan with other weights


def walk_of(morph, path):
    """Returns the options that name the walk of a character, where it has one."""
    listed = subprocess.run([morph, path, "--list"], capture_output=True, text=True, check=True).stdout
    names = [line.split(": ", 1)[1].rsplit(",", 1)[0] for line in listed.splitlines() if line.startswith("  animation")]
    return next((["--animation", walk] for walk in WALKS if walk in names), [])


def run_pair(settings, source, target, report):
    command = [settings.morph, source, target, "--quiet", "--grid", str(settings.grid), "--json", report.with_suffix(".part"),
               *walk_of(settings.morph, target), *settings.options]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == 0:
        report.with_suffix(".part").rename(report)
    else:
        error = done.stderr.strip().splitlines()
        report.write_text(json.dumps({"failed": error[-1] if error else f"status {done.returncode}"}))


def is_done(settings, report):
    return report.exists() and report.stat().st_mtime >= pathlib.Path(settings.morph).stat().st_mtime


def row(name, r):
    if "failed" in r:
        return f"| {name} | {r['failed']} |"
    components = f"{r['components_fewest']} to {r['components_most']}" if r["components_most"] > 1 else "1"
    return (f"| {name} | {r['frames']} | {components} | {r['frames_with_more_handles']} | "
            f"{100 * r['thinnest_limb']:.0f} % | {r['specks_left_out_most']} | {r['self_intersections']} "
            f"| {r['distance_to_target_mean_voxels']:.3f} | {r['distance_from_target_mean_voxels']:.3f} "
            f"| {r['distance_max_voxels']:.1f} | {r['volume_off_monotone_percent']:.1f} % |")


def good(r):
    """The goals that a report shows."""
    return ("failed" not in r and r["components_most"] == 1 and r["specks_left_out_most"] == 0 and r["self_intersections"] == 0
            and r["frames_with_more_handles"] == 0 and r["watertight_frames"] == r["frames"] and r["distance_to_target_mean_voxels"] < 0.15
            and r["distance_from_target_mean_voxels"] < 0.15 and r["distance_max_voxels"] < 3
            and r["volume_off_monotone_percent"] < 5)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("characters", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--grid", type=int, default=96)
    parser.add_argument("--morph", default="build/morph")
    parser.add_argument("--only", default="", help="pairs whose name has this text")
    parser.add_argument("--table", action="store_true", help="prints what is there")
    given = sys.argv[1:]
    own = given.index("--") if "--" in given else len(given)
    settings = parser.parse_args(given[:own])
    settings.options = given[own + 1:]
    settings.out.mkdir(parents=True, exist_ok=True)
    files = [f for f in sorted(settings.characters.glob("*.glb")) if f.stem not in TWINS]
    pairs = [(a, b) for a in files for b in files if a != b and settings.only in f"{a.stem} -> {b.stem}"]
    print("| pair | frames | components | more handles | thinnest limb | specks | crossing | mean to | mean from | largest | volume |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    met = shown = frames = handles = 0
    thin = []  # of each pair, the frames in which a limb is thinner than half of the thinner body's
    for source, target in pairs:
        report = settings.out / f"{source.stem}-{target.stem}.json"
        if not settings.table and not is_done(settings, report):
            run_pair(settings, source, target, report)
        if report.exists():
            result = json.loads(report.read_text())
            shown += 1
            met += good(result)
            frames += result.get("frames", 0)
            handles += result.get("frames_with_more_handles", 0)
            thin.append(sum(frame["thinnest_limb"] < 0.5 for frame in result.get("by_frame", [])))
            print(row(f"{source.stem} -> {target.stem}", result), flush=True)
    print(f"\n{met} of {shown} within every goal; {handles} of {frames} frames have more handles than both bodies; in {sum(thin)} frames "
          f"of {sum(n > 0 for n in thin)} pairs a limb is thinner than half of the thinner body's")
    return 0


if __name__ == "__main__":
    sys.exit(main())
