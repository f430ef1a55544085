"""Writes the golden files: the whole chain worked out a second time (chain.py) on small scenes (scenes.py).

    python3 tests/golden/make.py            writes everything anew
    python3 tests/golden/make.py --check    compares what stands here with what it would write, to 1e-11

Needs Python 3.9 and NumPy, nothing of Frontalis. Files beside it:

    patch_face.json            the face: 90 vertices of an uneven, bulging patch with an opening (docs/face-format.md)
    CASE.frontalis.json        the projects, each with other options (docs/project-format.md)
    CASE.vertices.csv          columns of forces.csv (docs/file-formats.md), then normal_N, tangential_N, depth_change_N
    CASE.edges.csv             strain and tension of every spring between known vertices
    summary.csv                scale, fit and head motion of each case

tests/golden.rs solves the same projects with the program and compares. A golden file that changes is either a mended mistake here,
worked out by hand first, or a changed rule that docs/ tells of; it is never written anew to please the program.
"""

import csv
import hashlib
import io
import json
import pathlib
import sys

import numpy as np

sys.dont_write_bytecode = True

from chain import WRINKLE_STRAIN, Chain, Face, turned  # noqa: E402
from scenes import FACE_FILE, face_text, project_text, projects  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent


def number(value):
    """Twelve digits: a hundredfold finer than the comparison, coarser than the rounding of other machines."""
    return "NaN" if np.isnan(value) else f"{value:.12g}" if abs(value) > 1e-13 else "0"


def table(header, rows):
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([[c if isinstance(c, (str, int)) else number(c) for c in row] for row in rows])
    return out.getvalue()


def results(name, project, face):
    chain = Chain(project, face)
    last = chain.last_frame(chain.marks, chain.head, chain.rule)
    force = chain.springs.forces(last, chain.known)
    other = "slide_on_surface" if chain.rule == "fixed_depth" else "fixed_depth"
    depth_change = np.linalg.norm(force - chain.forces(chain.marks, chain.head, other), axis=1)
    sigma = chain.standard_errors()
    a, b, c = (chain.first[face.triangles[:, k]] for k in range(3))
    normals = np.zeros_like(force)
    for k in range(3):
        np.add.at(normals, face.triangles[:, k], np.cross(b - a, c - a))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normal = (force * normals).sum(axis=1)
    tangential = np.linalg.norm(force - normal[:, None] * normals, axis=1)
    rows = []
    for v, state in enumerate(chain.states):
        found = [*last[v], *force[v], np.linalg.norm(force[v]), sigma[v]]
        more = [normal[v], tangential[v], depth_change[v]]
        if not chain.known[v]:
            found, more = [np.nan] * len(found), [np.nan] * len(more)
        rows.append([v, *chain.first[v], *found, str(state), *more])
    header = ("vertex x0_mm y0_mm z0_mm x1_mm y1_mm z1_mm fx_N fy_N fz_N f_N sigma_N state"
              " normal_N tangential_N depth_change_N").split()
    strain, tension = chain.springs.strains(last), chain.springs.tensions(last)
    both = [e for e, (i, j) in enumerate(face.edges) if chain.known[i] and chain.known[j]]
    corners = np.append(chain.springs.skin.rows[:, 0], WRINKLE_STRAIN)
    near = np.abs(strain[both, None] - corners).min(axis=1)
    # A difference quotient must not straddle a corner of the skin's table; springs that nothing moves stay at zero.
    assert not ((near < 3e-5) & (np.abs(strain[both]) > 1e-14)).any(), f"{name}: a spring at a corner of the table; change the seed"
    edges = [[int(face.edges[e][0]), int(face.edges[e][1]), strain[e], tension[e]] for e in both]
    theta, centre = chain.head
    summary = [("px_per_mm", chain.camera.px_per_mm), ("rms_before_px", chain.rms_before)]
    summary += [(f"scale_{axis}", s) for axis, s in zip("xyz", chain.scale)]
    summary += [(f"rotation_{axis}_rad", w) for axis, w in zip("xyz", theta[:3])]
    summary += [(f"translation_{axis}_mm", t) for axis, t in zip("xyz", theta[3:])]
    if chain.removes_head and len(chain.still) > 3:
        x = chain.first[[chain.marked[k] for k in chain.still]]
        squares = ((chain.camera.picture(turned(theta, centre, x)) - chain.marks[chain.still]) ** 2).sum()
        summary.append(("noise_floor_px", np.sqrt(squares / (2 * len(x) - 6))))
    report(name, chain, last, force, sigma, strain[both])
    return {
        f"{name}.vertices.csv": table(header, rows),
        f"{name}.edges.csv": table(["a", "b", "strain", "tension_N"], edges),
    }, [[name, quantity, value] for quantity, value in summary]


def report(name, chain, last, force, sigma, strain):
    counts = {s: int((chain.states == s).sum()) for s in ("measured", "inferred", "fixed", "unmeasured")}
    print(f"{name}: {counts}, moved up to {np.linalg.norm(last - chain.first, axis=1).max():.2f} mm, strain "
          f"{strain.min():.3f} to {strain.max():.3f}, force up to {np.linalg.norm(force, axis=1).max():.4f} N, "
          f"sigma up to {sigma.max():.4f} N")


def same(old, new):
    """Whether two texts agree word for word, and numbers to 1e-11 of themselves or 1e-13."""
    words = [[w for line in t.splitlines() for w in line.split(",")] for t in (old, new)]
    if len(words[0]) != len(words[1]):
        return False
    for a, b in zip(*words):
        try:
            if abs(float(a) - float(b)) > max(1e-11 * abs(float(b)), 1e-13):
                return False
        except ValueError:
            if a != b:
                return False
    return True


def main():
    check = sys.argv[1:] == ["--check"]
    files = {FACE_FILE: face_text()}
    if not check:
        (HERE / FACE_FILE).write_text(files[FACE_FILE])
    face = Face(HERE / FACE_FILE)
    summary = []
    for name, project in projects(face, hashlib.sha256(files[FACE_FILE].encode()).hexdigest()):
        files[f"{name}.frontalis.json"] = project_text(project)
        # Solved as a reader of the file would.
        found, lines = results(name, json.loads(files[f"{name}.frontalis.json"]), face)
        files.update(found)
        summary += lines
    files["summary.csv"] = table(["case", "quantity", "value"], summary)
    if check:
        changed = [name for name, text in files.items() if not same((HERE / name).read_text(), text)]
        sys.exit(f"these files differ: {', '.join(changed)}" if changed else 0)
    for name, text in files.items():
        (HERE / name).write_text(text)


if __name__ == "__main__":
    main()
