#!/usr/bin/env python3
"""rigs.py - rig on characters whose joints are known, and how far its joints are from the artist's.

    tests/bench/rigs.py FOLDER OUT [--rig build/rig] [--only TEXT] [--plot FILE] [--table]

FOLDER has the characters: those of the collection's rigged/, and, as far as they are there, those of Debian's packages, which
`rigs.py --fetch FOLDER` brings: assimp-testmodels (small), and 0ad-data (1.4 GB), whose meshes become GLB files. What a run reports
goes to OUT; a character whose report is there, and not older than the program, is not run again. --table runs nothing.

Errors are in percent of the body's height, or of a quadruped's longest side. A side is swapped if a joint is nearer to the artist's
joint of the other side. --plot draws, as SVG, each limb's confidence against its largest error.
"""
import argparse
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
import zipfile

SIDES = ("L", "R")

# Families of rigs: the joints of the template, and the artist's in the same place. {0}: the side as the family writes it.
BIPED = ("hips", "spine", "chest", "neck", "head", "upper_arm", "lower_arm", "hand", "thigh", "shin", "foot", "toes")
QUADRUPED = ("hips", "neck", "head", "tail", "front_upper_leg", "front_lower_leg", "front_foot", "hind_upper_leg", "hind_lower_leg",
             "hind_foot", "hind_toes")


def family(template, joints, names, sides=("L", "R")):
    """A family: pairs of the template's joint and the artist's; None where the artist has none."""
    pairs = {}
    for joint, name in zip(joints, names):
        if name and "{0}" in name or isinstance(name, tuple):
            for side, own in zip(SIDES, sides):
                pairs[f"{joint}.{side}"] = name[SIDES.index(side)] if isinstance(name, tuple) else name.format(own)
        elif name:
            pairs[joint] = name
    return template, pairs


NODES = [f"nodes[{n}]" for n in range(21)]
FAMILIES = {
    "KayKit": family("biped", BIPED, ["hips", "spine", "chest", None, "head", "upperarm.{0}", "lowerarm.{0}", "wrist.{0}",
                                      "upperleg.{0}", "lowerleg.{0}", "foot.{0}", "toes.{0}"], ("l", "r")),
    "Khronos": family("biped", BIPED, [NODES[2], NODES[11], NODES[12], NODES[19], NODES[20], (NODES[16], NODES[13]),
                                       (NODES[17], NODES[14]), (NODES[18], NODES[15]), (NODES[7], NODES[3]), (NODES[8], NODES[4]),
                                       (NODES[9], NODES[5]), (NODES[10], NODES[6])]),
    "robot": family("biped", BIPED, ["Hips", "Abdomen", "Torso", "Neck", "Head", "UpperArm.{0}", "LowerArm.{0}", "Palm2.{0}",
                                     "UpperLeg.{0}", "LowerLeg.{0}", "Foot.{0}", None]),
    "Epileptic": family("biped", BIPED, ["B_LowerPelvis", None, None, None, "B_Neck", "B_UpperArm_{0}", "B_ForeArm_{0}", "B_Hand_{0}",
                                         "B_Hip_{0}", "B_Knee_{0}", "B_Ankle_{0}", "B_Toe_{0}"], ("Left", "Right")),
    "Fox": family("quadruped", QUADRUPED, ["b_Hip_01", "b_Neck_04", "b_Head_05", "b_Tail01_012",
                                           ("b_LeftUpperArm_09", "b_RightUpperArm_06"), ("b_LeftForeArm_010", "b_RightForeArm_07"),
                                           ("b_LeftHand_011", "b_RightHand_08"), ("b_LeftLeg01_015", "b_RightLeg01_019"),
                                           ("b_LeftLeg02_016", "b_RightLeg02_020"), ("b_LeftFoot01_017", "b_RightFoot01_021"),
                                           ("b_LeftFoot02_018", "b_RightFoot02_022")]),
    "canids": family("quadruped", QUADRUPED, [None, "Neck1", "Head", "Tail1", "FrontLeg1_{0}", "FrontLeg2_{0}", "FrontLeg3_{0}",
                                              "BackLeg1_{0}", "BackLeg2_{0}", "BackLeg3_{0}", "BackToe_{0}"]),
    "foxes": family("quadruped", QUADRUPED, ["Fox_pelvis", "Fox_Neck1", "Fox_head", "Fox_Tail1", "Fox_FrontLeg1_{0}", "Fox_FrontLeg2_{0}",
                                             "Fox_FrontLeg3_{0}", ("Fox_BackLeg1_L", "Fox_Fox_BackLeg1_R"), "Fox_BackLeg2_{0}",
                                             "Fox_BackLeg3_{0}", "Fox_BackToe_{0}"]),
    "bears": family("quadruped", QUADRUPED, ["Ursidae_Pelvis", "Ursidae_Neck", "Ursidae_Head", None, "Ursidae_Upperarm_{0}",
                                             "Ursidae_Forearm_{0}", "Ursidae_Paw_{0}", "Ursidae_Leg_{0}", "Ursidae_Shin_{0}",
                                             "Ursidae_Ankle_{0}", "Ursidae_Toe_{0}"]),
    "camels": family("quadruped", QUADRUPED, ["Camelus_Pelvis", "Camelus_Neck_01", "Camelus_Head", "Camelus_Tail", "Camelus_upperarm_{0}",
                                              "Camelus_Forearm_{0}", "Camelus_Hand_{0}", "Camelus_Thigh_{0}", "Camelus_Foreleg_{0}",
                                              "Camelus_Shin_{0}", "Camelus_Foot_{0}"]),
    "horses": family("quadruped", QUADRUPED, ["spine", "neck", "head", "tail_base", "{0}_upperarm", "{0}_arm", "{0}_hand", "{0}_thigh",
                                              "{0}_leg", "{0}_shin", "{0}_hoof_back"], ("l", "r")),
    "deer": family("quadruped", QUADRUPED, ["pelvis", "neck", "head", "tail", "{0}_clavicle", "{0}_upperarm", "{0}_hand", "{0}_thigh",
                                            "{0}_calf", "{0}_foot", "{0}_toe"], ("l", "r")),
    "giraffes": family("quadruped", QUADRUPED, ["left_r_pelvis_upper", "neck_01", "head", "tail_01", "{0}_f_leg_top", "{0}_f_leg_mid",
                                                "{0}_f_foot", "{0}_r_leg_top", "{0}_r_leg_mid", "{0}_r_leg_bottom", "{0}_r_foot"],
                       ("left", "right")),
    "cats": family("quadruped", QUADRUPED, ["pelvis", "neck_1", "head", "tail_1", "leg_front_top_{0}", "leg_front_mid_{0}",
                                            "leg_front_bot_{0}", "leg_back_top_{0}", "leg_back_mid_{0}", "leg_back_bot_{0}",
                                            "leg_back_foot_{0}"]),
    # the artist's left is the animal's right
    "cattle": family("quadruped", QUADRUPED, ["Bovidae_pelvis", "Bovidae_Neck", "Bovidae_Head", "Bovidae_Tail",
                                              ("Bovidae_FrontLegTop_R", "Bovidae_FrontLegTop_L"),
                                              ("Bovidae_FrontCalf_right", "Bovidae_FrontCalf_left"),
                                              ("Bovidae_FrontFoot_right", "Bovidae_FrontFoot_left"),
                                              ("Bovidae_RearThigh_R", "Bovidae_RearThigh_L"),
                                              None, ("Bovidae_RearCalf_right", "Bovidae_RearCalf_left"),
                                              ("Bovidae_RearFoot_right", "Bovidae_RearFoot_left")]),
    "rhinos": family("quadruped", QUADRUPED, ["rhino", "neck", "head", "tail1", "shoulder_{0}", "leg_upper_{0}", "foot_front_{0}",
                                              "thigh_{0}", None, "leg_back_{0}", "foot_back_{0}"]),
    "zebras": family("quadruped", QUADRUPED, ["butt", "neck1", "head", "tail_start", None, "{0}_leg", "{0}_foot", None, None,
                                              "rear_{0}_shin", "rear_{0}_foot"], ("left", "right")),
}

# file, family
CHARACTERS = [
    ("Knight.glb", "KayKit"), ("Mage.glb", "KayKit"), ("CesiumMan.glb", "Khronos"), ("RiggedFigure.glb", "Khronos"),
    ("robot_expressive.glb", "robot"), ("BCN_Epileptic.X", "Epileptic"), ("Fox.glb", "Fox"), ("fox_0ad.glb", "foxes"),
    ("wolf.glb", "canids"), ("mastiff.glb", "canids"), ("bear.glb", "bears"), ("bear_polar.glb", "bears"),
    ("camel.glb", "camels"), ("horse.glb", "horses"), ("deer_mesh.glb", "deer"), ("giraffe_adult.glb", "giraffes"),
    ("tiger.glb", "cats"), ("bull_a.glb", "cattle"), ("wildebeest_adult.glb", "cattle"), ("rhino.glb", "rhinos"),
    ("zebra.glb", "zebras"),
]
TUNED = {"KayKit", "Khronos", "robot", "Fox"}  # the templates and most constants were chosen on these

# meshes of 0 A.D., and the files with their bones
MESHES = {"fox": "fox_armature", "wolf": "wolf", "mastiff": "mastiff", "bear": "ursidae_armature", "bear_polar": "ursidae_armature",
          "camel": "camelus", "horse": "horse", "deer_mesh": "deer", "giraffe_adult": "giraffe", "tiger": "feline_blender",
          "bull_a": "bovidae_skeleton", "wildebeest_adult": "bovidae_skeleton", "rhino": "rhino", "zebra": "zebra"}


# ---- characters of packages ----

def bones_of(text):
    """Names and parents of a skeleton's bones, in the order of its file."""
    bones = []

    def walk(element, parent):
        for bone in element.findall("bone"):
            bones.append((bone.get("name"), parent))
            walk(bone, len(bones) - 1)
    walk(xml.etree.ElementTree.fromstring(text).find("standard_skeleton"), -1)
    return bones


def read_pmd(data):
    """Positions, (bones, weights), triangles and places of bones of a mesh of 0 A.D. (Pyrogenesis mesh data)."""
    _, version, _, count = struct.unpack_from("<4sIII", data)
    uvs, at = (struct.unpack_from("<I", data, 16)[0], 20) if version >= 4 else (1, 16)
    step = 24 + 8 * uvs
    positions, influences = [], []
    for _ in range(count):
        positions.append(struct.unpack_from("<3f", data, at))
        row = struct.unpack_from("<4B4f", data, at + step)
        influences.append((row[:4], row[4:]))
        at += step + 20
    faces, = struct.unpack_from("<I", data, at)
    triangles = [struct.unpack_from("<3H", data, at + 4 + 6 * n) for n in range(faces)]
    at += 4 + 6 * faces
    bones, = struct.unpack_from("<I", data, at)
    return positions, influences, triangles, [struct.unpack_from("<3f", data, at + 4 + 28 * n) for n in range(bones)]


def write_glb(path, mesh, bones):
    """Writes the mesh with its bones; 0 A.D. is left-handed and looks along -z: z is mirrored."""
    positions, influences, triangles, places = mesh
    positions = [(x, y, -z) for x, y, z in positions]
    places = [(x, y, -z) for x, y, z in places]
    volume = sum(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
                 for a, b, c in ([positions[n] for n in t] for t in triangles))
    triangles = triangles if volume > 0 else [(a, c, b) for a, b, c in triangles]
    count = min(len(bones), len(places))
    rows = [[(b if b < count and w > 0 else 0, w if b < count else 0.0) for b, w in zip(*row)] for row in influences]
    rows = [row if sum(w for _, w in row) > 0 else [(0, 1.0)] + [(0, 0.0)] * 3 for row in rows]
    rows = [[(b, w / sum(w for _, w in row)) for b, w in row] for row in rows]
    chunks = [struct.pack(f"<{3 * len(triangles)}I", *(n for t in triangles for n in t)),
              struct.pack(f"<{3 * len(positions)}f", *(x for p in positions for x in p)),
              struct.pack(f"<{4 * len(rows)}H", *(b for row in rows for b, _ in row)),
              struct.pack(f"<{4 * len(rows)}f", *(w for row in rows for _, w in row)),
              b"".join(struct.pack("<16f", 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1) for x, y, z in places[:count])]
    kinds = [(5125, 3 * len(triangles), "SCALAR"), (5126, len(positions), "VEC3"), (5123, len(rows), "VEC4"), (5126, len(rows), "VEC4"),
             (5126, count, "MAT4")]
    accessors = [{"bufferView": n, "componentType": c, "count": k, "type": t} for n, (c, k, t) in enumerate(kinds)]
    accessors[1].update(min=[min(p[i] for p in positions) for i in range(3)], max=[max(p[i] for p in positions) for i in range(3)])
    nodes = [{"mesh": 0, "skin": 0}]
    for n in range(count):
        up = bones[n][1]
        children = [1 + k for k in range(count) if bones[k][1] == n]
        nodes.append({"name": bones[n][0], "translation": [a - b for a, b in zip(places[n], places[up] if up >= 0 else (0, 0, 0))],
                      **({"children": children} if children else {})})
    views = [{"buffer": 0, "byteOffset": sum(map(len, chunks[:n])), "byteLength": len(chunk)} for n, chunk in enumerate(chunks)]
    text = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0] + [1 + n for n in range(count) if bones[n][1] < 0]}],
        "nodes": nodes, "buffers": [{"byteLength": sum(map(len, chunks))}], "bufferViews": views, "accessors": accessors,
        "meshes": [{"primitives": [{"indices": 0, "attributes": {"POSITION": 1, "JOINTS_0": 2, "WEIGHTS_0": 3}}]}],
        "skins": [{"joints": [1 + n for n in range(count)], "inverseBindMatrices": 4}]}).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(chunks)
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)) + struct.pack("<I4s", len(text), b"JSON") + text
                     + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def unpack(package, name, to):
    """Downloads a package of Debian; returns the path of its file of that name."""
    subprocess.run(["apt-get", "download", package], cwd=to, check=True, capture_output=True)
    archive, = pathlib.Path(to).glob(f"{package}_*.deb")
    subprocess.run(f"dpkg-deb --fsys-tarfile '{archive}' | tar x --wildcards '*/{name}'", shell=True, cwd=to, check=True)
    archive.unlink()
    return next(pathlib.Path(to).rglob(name))


def convert(archive, to):
    with zipfile.ZipFile(archive) as files:
        for name, skeleton in MESHES.items():
            bones = bones_of(files.read(f"art/skeletons/{skeleton}.xml"))
            mesh = read_pmd(files.read(f"art/meshes/skeletal/{name}.dae.cached.pmd"))
            write_glb(to / f"{'fox_0ad' if name == 'fox' else name}.glb", mesh, bones)


def fetch(to):
    to.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        (to / "BCN_Epileptic.X").write_bytes(unpack("assimp-testmodels", "BCN_Epileptic.X", scratch).read_bytes())
        convert(unpack("0ad-data", "public.zip", scratch), to)


# ---- measuring ----

def distance(a, b):
    return sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def other_side(joint):
    return joint[:-1] + ("R" if joint.endswith("L") else "L") if joint[-2:] in (".L", ".R") else None


def limb_of(joint):
    """The limb, as the report names it, that a joint of a template belongs to; None: the trunk."""
    stem = joint.split(".")[0]
    for limb, words in {"upper_arm": ("upper_arm", "lower_arm", "hand"), "thigh": ("thigh", "shin", "foot", "toes"),
                        "front_upper_leg": ("front_",), "hind_upper_leg": ("hind_",), "head": ("head", "neck"), "tail": ("tail",)}.items():
        if stem.startswith(words):
            return limb
    return None


def scale_of(report, template):
    """What errors are in percent of: the body's height, or a quadruped's longest side."""
    ends = list(report["joints"].values()) + list(report["joints_of_the_file"].values())
    forward = [dot(report["forward"], p) for p in ends]
    return report["height"] if template == "biped" else max(report["height"], max(forward) - min(forward))


def measure(report, template, pairs):
    """Errors of joints in percent, and how many are nearer to the other side's."""
    own, found = report["joints_of_the_file"], report["joints"]
    missing = [name for name in pairs.values() if name not in own]
    if missing:
        raise SystemExit(f"rigs.py: {report['file']}: no joint {missing[0]}")
    scale = scale_of(report, template)
    errors = {joint: 100 * distance(found[joint], own[name]) / scale for joint, name in pairs.items() if joint in found}
    swapped = sum(distance(found[other_side(joint)], own[pairs[joint]]) < distance(found[joint], own[pairs[joint]])
                  for joint in errors if other_side(joint))
    return errors, swapped


def offsets(report, template, pairs):
    """From the joints found to the artist's in percent: upwards, forwards and away from the plane of symmetry."""
    own, found, scale = report["joints_of_the_file"], report["joints"], scale_of(report, template)
    up, forward = report["up"], report["forward"]
    left = [up[i - 2] * forward[i - 1] - up[i - 1] * forward[i - 2] for i in range(3)]
    ways = {joint: [100 * (b - a) / scale for a, b in zip(found[joint], own[name])] for joint, name in pairs.items() if joint in found}
    return {joint: (dot(way, up), dot(way, forward), -dot(way, left) if joint.endswith(".R") else dot(way, left))
            for joint, way in ways.items()}


def mean_offset(bodies, joint):
    """The mean of a joint's offsets, both sides, each family once; none: 0."""
    families = {}
    for kind, ways in bodies:
        families.setdefault(kind, []).extend(way for name, way in ways.items() if name.split(".")[0] == joint.split(".")[0])
    means = [[sum(way[i] for way in ways) / len(ways) for i in range(3)] for ways in families.values() if ways]
    return [sum(mean[i] for mean in means) / max(1, len(means)) for i in range(3)]


def leave_one_out(bodies):
    """Mean errors of bodies (family, offsets) as they are, and with each joint moved by its mean offset in the other families."""
    sums = [0.0, 0.0]
    for kind, ways in bodies:
        others = [body for body in bodies if body[0] != kind]
        moved = {joint: distance(way, mean_offset(others, joint)) for joint, way in ways.items()}
        sums = [sums[0] + sum(distance(way, (0, 0, 0)) for way in ways.values()) / len(ways), sums[1] + sum(moved.values()) / len(ways)]
    return [total / len(bodies) for total in sums]


def run(settings, path, template, report):
    """Returns why it failed; None: it did not."""
    command = [settings.rig, path, "--template", template, "--json", report.with_suffix(".part"), "--out", report.with_suffix(""),
               "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == 0:
        report.with_suffix(".part").rename(report)
        return None
    report.unlink(missing_ok=True)
    return (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]


def is_fresh(report, settings, path):
    """Whether a report is newer than what it was made of: the program, its templates, the character."""
    made_of = [pathlib.Path(settings.rig), path, *pathlib.Path("examples/rig").glob("*.json")]
    return report.exists() and report.stat().st_mtime >= max(part.stat().st_mtime for part in made_of)


def mean_of(means, tuned):
    return f"{sum(means[tuned]) / len(means[tuned]):.1f} % of {len(means[tuned])}" if tuned in means else "none"


def plot(path, points):
    """Draws (confidence, error) of limbs as SVG; open circles: families on which the templates were chosen."""
    width, height, most = 640, 420, max(24, max(error for _, error, _ in points))

    def across(confidence):
        return round(60 + confidence * (width - 90), 1)

    def down(error):
        return round(height - 50 - error / most * (height - 80), 1)

    draw = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="13">',
            '<rect width="100%" height="100%" fill="white"/>',
            f'<path d="M60,20V{down(0)}H{width - 20}" fill="none" stroke="black"/>',
            f'<path d="M60,{down(8)}H{width - 20}" stroke="gray" stroke-dasharray="4"/>']
    for confidence, error, tuned in points:
        color = 'fill="none" stroke="blue"' if tuned else 'fill="red"'
        draw.append(f'<circle cx="{across(confidence)}" cy="{down(error)}" r="3.5" {color}/>')
    for tick in range(0, 11, 2):
        draw.append(f'<text x="{across(tick / 10)}" y="{height - 32}" text-anchor="middle">{tick / 10}</text>')
    for tick in range(0, int(most) + 1, 4):
        draw.append(f'<text x="52" y="{down(tick) + 4:.1f}" text-anchor="end">{tick}</text>')
    draw += [f'<text x="{width / 2}" y="{height - 10}" text-anchor="middle">confidence of a limb</text>',
             '<text x="70" y="18">largest error of its joints, %; blue: families on which the templates were chosen</text>', '</svg>']
    path.write_text("\n".join(draw) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path, nargs="?")
    parser.add_argument("--rig", default="build/rig")
    parser.add_argument("--only", default="", help="characters whose file's name has this text")
    parser.add_argument("--plot", type=pathlib.Path)
    parser.add_argument("--fetch", action="store_true", help="brings the characters of Debian's packages into FOLDER")
    parser.add_argument("--family", default="", help="only that template")
    parser.add_argument("--joints", action="store_true", help="prints the joints one by one")
    parser.add_argument("--table", action="store_true", help="prints what is there")
    settings = parser.parse_args()
    if settings.fetch:
        return fetch(settings.folder)
    if not settings.out:
        parser.error("OUT is wanted")
    settings.out.mkdir(parents=True, exist_ok=True)
    print("| character | family | mean | worst | joint | sides swapped | cost | confidence |")
    print("|---|---|---|---|---|---|---|---|")
    points, means, worsts, swaps, both, failed, bodies = [], {}, [], 0, 0, 0, {}
    for name, kind in CHARACTERS:
        path, report = settings.folder / name, settings.out / f"{pathlib.Path(name).stem}.json"
        unwanted = settings.only not in name or not FAMILIES[kind][0].startswith(settings.family)
        if not path.exists() or unwanted:
            continue
        template, pairs = FAMILIES[kind]
        failure = None
        if not settings.table and not is_fresh(report, settings, path):
            failure = run(settings, path, template, report)
        if failure or not report.exists():
            print(f"| {name} | {kind} | - | - | {failure or 'not run'} | - | - | - |")
            failed += 1
            continue
        result = json.loads(report.read_text())
        errors, swapped = measure(result, template, pairs)
        worst = max(errors, key=errors.get)
        mean = sum(errors.values()) / len(errors)
        means.setdefault(kind in TUNED, []).append(mean)
        worsts.append(errors[worst])
        swaps += swapped
        both += result["vertices_on_both_sides"]
        bodies.setdefault(template, []).append((kind, offsets(result, template, pairs)))
        confidence = ", ".join(f"{limb} {value:.2f}" for limb, value in result["confidence"].items())
        print(f"| {name} | {kind}{'' if kind in TUNED else ' *'} | {mean:.1f} | {errors[worst]:.1f} | {worst} | {swapped} "
              f"| {result['role_cost']:.2f} | {confidence} |", flush=True)
        if settings.joints:
            print("    " + ", ".join(f"{joint} {error:.1f}" for joint, error in errors.items() if not joint.endswith(".R")))
        for limb, value in result["confidence"].items():
            of_limb = [error for joint, error in errors.items() if limb_of(joint) == limb]
            points += [(value, max(of_limb), kind in TUNED)] if of_limb else []
    print(f"\n{len(worsts)} characters: mean {mean_of(means, True)} of families on which the templates were chosen, "
          f"{mean_of(means, False)} of others (*);\n"
          f"worst joint within 8 % in {sum(w <= 8 for w in worsts)}; {swaps} joints with sides swapped;\n"
          f"{both} vertices with more than .2 of weight on both sides away from the plane of symmetry")
    for template, some in bodies.items():
        if len({kind for kind, _ in some}) < 2:  # no other family to learn from
            continue
        print("errors of joints, %ss: mean %.1f %%; with each joint moved by its mean offset in the other families %.1f %%"
              % (template, *leave_one_out(some)))
    if settings.plot and points:
        plot(settings.plot, points)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
