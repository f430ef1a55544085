"""The face and the projects of the golden files: small, uneven, and different in every option.

Made with sums, products and scatter(), then rounded, so that every machine writes the same; exp and sin enter before the rounding.
"""

import json

import numpy as np

from chain import Camera, Chain, turned

FACE_FILE = "patch_face.json"

COLUMNS, ROWS = 9, 10


def scatter(k):
    """A number in [-1, 1) from a whole number, the same on every machine."""
    for _ in range(3):
        k = (1103515245 * k + 12345) % 2 ** 31
    return k / 2 ** 30 - 1.0


def face_text():
    positions = []
    for i in range(COLUMNS * ROWS):
        x = (i % COLUMNS - 4) * 9.0 + 1.6 * scatter(2 * i)
        y = (i // COLUMNS - 4.5) * 8.5 + 1.6 * scatter(2 * i + 1)
        positions.append([round(x, 4), round(y, 4), round(9.0 - x * x / 80.0 - y * y / 130.0, 4)])
    triangles = []
    for r in range(ROWS - 1):
        for c in range(COLUMNS - 1):
            i, up = r * COLUMNS + c, (r + 1) * COLUMNS + c
            if (r, c) == (2, 5):
                continue  # the opening
            if (r + c) % 2:
                triangles += [[i, i + 1, up + 1], [i, up + 1, up]]
            else:
                triangles += [[i, i + 1, up], [i + 1, up + 1, up]]
    places = {"brow_left": 69, "brow_right": 65, "brow_middle": 76, "eye_inner_left": 50, "eye_inner_right": 48,
              "cheek_left": 26, "cheek_right": 19, "chin": 4}
    mirrored = {"left": "right", "right": "left"}
    landmarks = []
    for name, vertex in places.items():
        place, _, side = name.rpartition("_")
        landmark = {"id": name, "name": name.replace("_", " ").capitalize(), "hint": "A vertex of the patch.", "vertex": vertex}
        if side in mirrored:
            landmark["mirror"] = f"{place}_{mirrored[side]}"
        landmarks.append(landmark)
    parts = [f'  "{key}": [\n    ' + ",\n    ".join(json.dumps(row) for row in rows) + "\n  ]"
             for key, rows in (("positions_mm", positions), ("triangles", triangles), ("landmarks", landmarks))]
    return '{\n  "version": 1,\n  "name": "Patch with an opening",\n' + ",\n".join(parts) + "\n}\n"


def motion(x, amount):
    """The skin's motion of a scene, in the picture's plane and a little in depth: up in the middle, apart at the sides."""
    r2 = (x[..., 0] ** 2 + (x[..., 1] - 5.0) ** 2) / 500.0
    grow = amount * np.exp(-r2)
    return np.stack([0.35 * grow * np.sin(x[..., 0] / 11.0), grow * (1.0 - x[..., 1] / 60.0), 0.2 * grow], axis=-1)


def scene(face, project, skipped, still, amount, head, seed, person=(1.06, 0.95)):
    """Puts marks on a project: landmarks of a person of other proportions, then the moved skin on a moved head, +-0.4 px."""
    def noise(k):
        return np.array([0.4 * scatter(1000 * seed + 2 * k), 0.4 * scatter(1000 * seed + 2 * k + 1)])

    def at(px):
        return [round(float(px[0]), 2), round(float(px[1]), 2)]

    drawn = project
    if project.get("scale", {"from": "assumed"})["from"] in ("assumed", "inner_eye_corners"):
        # The scale will come from the marks: they are drawn with 5 px/mm, and the chain finds its own.
        drawn = dict(project, scale={"from": "two_points", "a_px": [0, 0], "b_px": [50, 0], "mm": 10})
    camera = Camera(drawn, face)
    wide, high = person
    for k, (name, vertex) in enumerate(face.landmarks.items()):
        if name in project["landmarks"]:
            x = face.x[vertex] * [wide, high, 1.0] + [3.0, -2.0, 0.0] + np.append(noise(500 + k), 0.0) * 4.0
            project["landmarks"][name] = {"at_px": at(camera.picture(x)), **project["landmarks"][name]}
    first = Chain(dict(project, features={}), face).first
    camera = Camera(project, face)
    inside = [v for v in range(len(face.x)) if v not in face.border and v not in skipped]
    theta, centre = np.array(head), np.array([0.0, 0.0, -60.0])
    features = {}
    for v in inside:
        moved = first[v] if v in still else first[v] + motion(first[v], amount)
        features[str(v)] = {"last": {"at_px": at(camera.picture(turned(theta, centre, moved)) + noise(v))}}
        if v in still:
            features[str(v)]["role"] = "still"
    for v, change in project["features"].items():
        entry = features.setdefault(v, {})
        if "first" in change:
            away = change.pop("first")
            entry["first"] = {"at_px": at(camera.picture(first[int(v)]) + away)}
        last = change.pop("last", {})
        if last:
            entry["last"] = {**entry["last"], **last}
        entry.update(change)
    project["features"] = dict(sorted(features.items(), key=lambda f: int(f[0])))
    return project


def projects(face, sha256):
    every = {name: {} for name in face.landmarks}
    base = {"frontalis_project": 1, "frames": {"first": None, "last": None},
            "face": {"model": "file", "path": FACE_FILE, "sha256": sha256}}
    # As the thesis: unmarked vertices held, one law for all edges, depth kept, no head motion; a camera so far that it is
    # all but orthographic; a table of its own, followed into compression.
    yield "held_uniform", scene(face, {
        **base, "name": "Held, uniform, far camera",
        "camera": {"distance_mm": 50000.0, "principal_point_px": [500.0, 530.0]},
        "scale": {"from": "two_points", "a_px": [100.0, 200.0], "b_px": [340.0, 520.0], "mm": 80.0},
        "landmarks": dict(every), "features": {"40": {"last": {"state": "locked"}}},
        "settings": {"customize": {}, "unmarked": {"rule": "held"}, "springs": "uniform", "skin_thickness_mm": 1.2, "marking_sigma_px": 0.4,
                     "skin": {"rows": [[-0.5, -20.0], [-0.1, -3.0], [0.0, 0.0], [0.08, 2.0], [0.6, 90.0]],
                              "contraction": "fung"}},
    }, skipped=[31, 51], still=[], amount=4.0, head=[0.0] * 6, seed=5)
    # Near camera, skin that slides, six still points on a turned head, marks of every state, a vertex put elsewhere by hand
    # in the first frame, a fixed one, gaps to infer.
    yield "slide_inferred_head", scene(face, {
        **base, "name": "Sliding, inferred, head removed",
        "camera": {"distance_mm": 400.0, "view_plane_z_mm": -10.0, "principal_point_px": [540.0, 500.0]},
        "scale": {"from": "grid_pitch", "a_px": [120.0, 300.0], "b_px": [320.0, 310.0], "cells": 5.0, "pitch_mm": 8.0},
        "landmarks": {**every, "cheek_left": {"state": "uncertain"}, "chin": {"state": "occluded"}},
        "features": {"39": {"last": {"state": "uncertain"}}, "49": {"last": {"sigma_px": 0.15}},
                     "58": {"last": {"state": "occluded"}}, "29": {"role": "fixed"},
                     "41": {"first": [3.5, -2.5]}, "13": {"last": {"sigma_px": 0.5}}},
        "settings": {"customize": {"z_factor": 1.0, "power": 3.0, "nearest": None}, "depth": "slide_on_surface",
                     "unmarked": {"rule": "inferred", "reach_mm": 13.0}, "marking_sigma_px": 0.3},
    }, skipped=[28, 38, 48, 47, 60, 66, 67], still=[10, 13, 16, 64, 70, 73], amount=5.0,
        head=[0.02, -0.03, 0.015, 2.0, -1.0, 1.5], seed=2)
    # Depth kept on a turned head, three nearest landmarks at a broken power, the person's own eye corners for a scale,
    # a short table that the strains leave on both sides.
    yield "fixed_depth_head", scene(face, {
        **base, "name": "Depth kept, head removed, beyond the table",
        "camera": {"distance_mm": 700.0}, "scale": {"from": "inner_eye_corners", "mm": 18.5},
        "landmarks": dict(every), "features": {},
        "settings": {"customize": {"z_factor": 1.2, "power": 1.5, "nearest": 3}, "depth": "fixed_depth",
                     "unmarked": {"rule": "inferred", "reach_mm": 18.0}, "springs": "uniform", "marking_sigma_px": 0.25,
                     "skin": {"rows": [[-0.08, -2.0], [0.0, 0.0], [0.05, 1.5], [0.1, 5.0]]}},
    }, skipped=[40, 49, 50, 57, 30], still=[10, 13, 16, 37, 76, 79], amount=6.0, head=[-0.03, 0.02, -0.02, -3.0, 2.0, -2.0], seed=3)
    # A nodding, stretched head whose pose comes from every landmark, a morph that misses them a little for smoothness.
    yield "pose_radial", scene(face, {
        **base, "name": "Pose, radial morph, smoothed",
        "camera": {"distance_mm": 600.0}, "scale": {"from": "two_points", "a_px": [0.0, 0.0], "b_px": [0.0, 250.0], "mm": 50.0},
        "landmarks": dict(every), "features": {},
        "settings": {"customize": {"align": "pose", "z_factor": 1.1, "morph": "radial", "smoothing_mm": 0.7}, "marking_sigma_px": 0.2},
    }, skipped=[39, 42, 60, 61], still=[10, 13, 16, 64, 70, 73], amount=4.0, head=[0.01, 0.02, 0.0, 1.0, 0.0, -1.0], seed=6)
    # Nothing but what must be there: every default; two landmarks in a row, so that one axis scales both; too few still points.
    yield "defaults", scene(face, {
        **{k: base[k] for k in ("frontalis_project", "frames", "face")}, "name": "Defaults, assumed scale",
        "landmarks": {"eye_inner_left": {}, "eye_inner_right": {}},
        "features": {"16": {"role": "fixed"}},
    }, skipped=[39, 42, 60, 61], still=[10, 70], amount=3.0, head=[0.0, 0.0, 0.0, 0.5, 0.0, 0.0], seed=4)


def project_text(project):
    """One mark a line."""
    text = {k: json.dumps(v) for k, v in project.items() if k not in ("landmarks", "features")}
    for key in ("landmarks", "features"):
        text[key] = "{\n    " + ",\n    ".join(f'"{k}": {json.dumps(v)}' for k, v in project[key].items()) + "\n  }"
    return "{\n" + ",\n".join(f'  "{k}": {v}' for k, v in text.items()) + "\n}\n"
