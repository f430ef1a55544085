"""The whole chain worked out a second time, from docs/ and with other means than the program's.

Where the program takes a short way, this takes the plain one: a point of the last frame is found by solving for the place whose
picture is the mark, the surface is searched triangle by triangle, the harmonic solve is a dense finite-element system, K is a
full matrix that multiplies X, and standard errors come from central differences of the whole chain, the head's motion
estimated anew for every disturbed mark.

All lengths mm, pictures px with y down, stress kPa, forces N. Equation numbers are the thesis's, read as docs/errata.md says.
"""

import json

import numpy as np

IMAGE_SIZE = (1036.0, 1036.0)

DEFAULT_SKIN = {
    "rows": [[-0.40, -97.0], [-0.30, -25.2], [-0.20, -9.13], [-0.10, -3.35], [0.0, 0.0],
             [0.10, 3.62], [0.20, 10.9], [0.30, 33.4], [0.40, 136.0], [0.50, 851.0]],
    "contraction": "saturating",
}
WRINKLE_STRAIN = -0.20
# Rotation vector, rad, and translation, mm, that are expected of a head before anything was marked.
HEAD_PRIOR = np.diag(np.array([0.05, 0.05, 0.05, 500.0, 500.0, 5.0]) ** -2.0)
# Marks around an inferred vertex leave no wider gap: a tenth over a third of a turn.
WIDEST_GAP = 1.1 * 2.0 * np.pi / 3.0


# Camera -------------------------------------------------------------------------------------------------------------

class Camera:
    """Reference point on the z axis at z_prp, view plane at z_vp, px_per_mm on it, axis through `centre` of the picture."""

    def __init__(self, project, face):
        settings = project.get("camera", {"distance_mm": 1000.0})
        self.z_vp = settings.get("view_plane_z_mm", 0.0)
        self.z_prp = self.z_vp + settings["distance_mm"]
        self.centre = np.array(settings.get("principal_point_px") or [IMAGE_SIZE[0] / 2, IMAGE_SIZE[1] / 2])
        self.px_per_mm = px_per_mm(project, face)

    def picture(self, x):
        """(4.7): x_p = x (z_prp - z_vp) / (z_prp - z); then px, y turned down. Also of complex numbers."""
        on_plane = x[..., :2] * ((self.z_prp - self.z_vp) / (self.z_prp - x[..., 2]))[..., None]
        return self.centre + self.px_per_mm * on_plane * np.array([1.0, -1.0])

    def on_plane(self, px):
        return (px - self.centre) / self.px_per_mm * np.array([1.0, -1.0])

    def back(self, px, z):
        """(4.8): x = x_p (z_prp - z) / (z_prp - z_vp) at the known depth z."""
        return np.append(self.on_plane(px) * (self.z_prp - z) / (self.z_prp - self.z_vp), z)

    def ray_rows(self, px):
        """The two rows A and right sides b of A x = b that hold for the points x seen at px."""
        p, d = self.on_plane(px), self.z_prp - self.z_vp
        # x_p (z_prp - z) = x d
        return np.array([[d, 0.0, p[0]], [0.0, d, p[1]]]), p * self.z_prp


def px_per_mm(project, face):
    scale = project.get("scale", {"from": "assumed"})
    if scale["from"] in ("two_points", "grid_pitch"):
        mm = scale["mm"] if scale["from"] == "two_points" else scale["cells"] * scale["pitch_mm"]
        return np.linalg.norm(np.subtract(scale["a_px"], scale["b_px"])) / mm
    left, right = (project["landmarks"][f"eye_inner_{side}"]["at_px"] for side in ("left", "right"))
    eyes = face.x[face.landmarks["eye_inner_left"]] - face.x[face.landmarks["eye_inner_right"]]
    mm = scale["mm"] if scale["from"] == "inner_eye_corners" else np.linalg.norm(eyes)
    return np.linalg.norm(np.subtract(left, right)) / mm


# Face and customisation, Fig. 4.6 -----------------------------------------------------------------------------------

class Face:
    def __init__(self, path):
        data = json.loads(path.read_text())
        self.x = np.array(data["positions_mm"])
        self.triangles = np.array(data["triangles"])
        self.landmarks = {l["id"]: l["vertex"] for l in data["landmarks"]}
        sides = np.sort(np.vstack([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]]), axis=1)
        self.edges, self.edge_of_side, self.sides_of_edge = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
        self.edge_of_side = self.edge_of_side.reshape(3, -1)
        # z of the vertices' unit normals, each the mean of its triangles' by area.
        a, b, c = (self.x[self.triangles[:, k]] for k in range(3))
        normals = np.zeros_like(self.x)
        for k in range(3):
            np.add.at(normals, self.triangles[:, k], np.cross(b - a, c - a))
        self.facing = normals[:, 2] / np.linalg.norm(normals, axis=1)
        self.border = np.unique(self.edges[self.sides_of_edge == 1])


def is_data(mark):
    return mark is not None and mark.get("state", "marked") != "occluded"


# A file that leaves choices of the customisation out means the thesis's; one without any takes the program's.
THESIS = {"align": "thesis", "z_factor": 1.15, "morph": "nnwa", "smoothing_mm": 0.0, "power": 2.0, "nearest": None}
PROGRAM = {**THESIS, "align": "pose", "z_factor": 1.0, "morph": "radial"}


def customise(project, face, camera):
    """Align, scale, and the landmarks' shifts spread over the face."""
    given = project.get("settings", {}).get("customize")
    settings = PROGRAM if given is None else {**THESIS, **given}
    ids = [i for i in face.landmarks if is_data(project["landmarks"].get(i))]
    at = np.array([face.landmarks[i] for i in ids])
    marks = np.array([project["landmarks"][i]["at_px"] for i in ids])
    align = {"thesis": by_ranges, "pose": by_pose}[settings["align"]]
    aligned, scale = align(face.x, face.x[at], marks, camera, settings["z_factor"], face.facing[at])
    rms_before = np.sqrt(((camera.picture(aligned[at]) - marks) ** 2).sum(axis=1).mean())
    shifts = np.array([camera.back(p, aligned[v][2]) - aligned[v] for p, v in zip(marks, at)])
    morph = {"nnwa": nnwa, "radial": radial}[settings["morph"]]
    return morph(aligned, aligned[at], shifts, settings), scale, rms_before


def by_ranges(x, landmarks, marks, camera, z_factor, facing):
    # The shift (dx, dy) that centres the projections: mean a (x + dx) = mean of the marks on the plane.
    factor = (camera.z_prp - camera.z_vp) / (camera.z_prp - landmarks[:, 2])
    wanted = camera.on_plane(marks.mean(axis=0))
    shift = (wanted - (factor[:, None] * landmarks[:, :2]).mean(axis=0)) / factor.mean()
    # Scaled about the point that is seen in the centre of the marks at the depth of the mean factor.
    depth = camera.z_prp - (camera.z_prp - camera.z_vp) / factor.mean()
    about = camera.back(marks.mean(axis=0), depth)
    moved = landmarks + np.append(shift, 0.0)
    ranges, wanted = np.ptp(camera.picture(moved), axis=0), np.ptp(marks, axis=0)
    # An axis tells a scale where both ranges are at least a fifth of those along the other axis.
    tells = [all(r[k] > 0 and r[k] >= 0.2 * r[1 - k] for r in (ranges, wanted)) for k in (0, 1)]
    told = [wanted[k] / ranges[k] if tells[k] else None for k in (0, 1)]
    if told == [None, None]:
        scale = np.ones(3)
    else:
        sx, sy = (told[k] if told[k] is not None else told[1 - k] for k in (0, 1))
        scale = np.array([sx, sy, z_factor * sx])
    return about + (x + np.append(shift, 0.0) - about) * scale, scale


def by_pose(x, landmarks, marks, camera, z_factor, facing):
    """Rotation vector, logarithms of two scales and a shift that minimise 4 ln(1 + r^2 / 4), r = facing^1.5 miss / 3 mm, and what is known without a mark.

    Gauss-Newton from rest; the Jacobian is a complex step."""
    centre, wanted = landmarks.mean(axis=0), camera.on_plane(marks)

    def scale(u):
        return np.array([np.exp(u[3]), np.exp(u[4]), z_factor * np.exp((u[3] + u[4]) / 2.0)])

    def put(u, points):
        theta = np.concatenate([u[:3], u[5:7], [0.0]])
        return turned(theta, centre, centre + (points - centre) * scale(u))

    def lacks(u):
        y = put(u, landmarks)
        seen = y[:, :2] * ((camera.z_prp - camera.z_vp) / (camera.z_prp - y[:, 2]))[:, None]
        known = [u[0] / 0.08, u[1] / 0.08, u[2] / 0.08, (u[3] - u[4]) / 0.05, (u[3] + u[4]) / 2.0 / 0.3]
        return np.concatenate([((seen - wanted) * (np.maximum(facing, 0.1) ** 1.5)[:, None] / 3.0).ravel(), known])

    u = np.zeros(7)
    u[5:7] = (wanted - landmarks[:, :2]).mean(axis=0)
    for _ in range(1000):
        jacobian = np.empty((2 * len(marks) + 5, 7))
        for k in range(7):
            step = np.zeros(7, dtype=complex)
            step[k] = 1e-30j
            jacobian[:, k] = lacks(u + step).imag / 1e-30
        # Each landmark is believed as much as its miss allows: the slope of the logarithm.
        squared = (lacks(u)[:-5].reshape(-1, 2) ** 2).sum(axis=1)
        believed = np.append(np.repeat((1.0 + squared / 4.0) ** -0.5, 2), np.ones(5))
        step = np.linalg.lstsq(jacobian * believed[:, None], -lacks(u) * believed, rcond=None)[0]
        u = u + step
        if np.abs(step).max() < 1e-14:
            break
    return put(u, x), scale(u)


def nnwa(aligned, landmarks, shifts, settings):
    """The average of the shifts weighted by 1 / distance ** power."""
    first = aligned.copy()
    for v, x in enumerate(aligned):
        d = np.linalg.norm(x - landmarks, axis=1)
        near = np.argsort(d, kind="stable")[: settings["nearest"]]
        if d.min() < 1e-9:
            first[v] += shifts[d.argmin()]
        else:
            w = d[near] ** -settings["power"]
            first[v] += (w[:, None] * shifts[near]).sum(axis=0) / w.sum()
    return first


def radial(aligned, landmarks, shifts, settings):
    """a + sum of w_k |x - x_k| through the shifts, the weights' sum 0; with smoothing, their misses are (s^2 / 0.15 mm) w_k."""
    n = len(landmarks)
    system = np.ones((n + 1, n + 1))
    system[:n, :n] = np.linalg.norm(landmarks[:, None] - landmarks[None], axis=2) - settings["smoothing_mm"] ** 2 / 0.15 * np.eye(n)
    system[n, n] = 0.0
    weights = np.linalg.solve(system, np.vstack([shifts, np.zeros(3)]))
    return aligned + np.linalg.norm(aligned[:, None] - landmarks[None], axis=2) @ weights[:n] + weights[n]


# Head motion --------------------------------------------------------------------------------------------------------

def turned(theta, centre, x):
    """R (x - c) + c + t with Rodrigues' formula; theta = (rotation vector, t), also complex."""
    w, t = theta[:3], theta[3:]
    a2 = (w * w).sum()
    cross = np.cross(np.broadcast_to(w, x.shape), x - centre)
    if abs(a2) < 1e-12:
        s, c = 1.0 - a2 / 6.0, 0.5 - a2 / 24.0
    else:
        a = np.sqrt(a2)
        s, c = np.sin(a) / a, (1.0 - np.cos(a)) / a2
    return x + s * cross + c * np.cross(np.broadcast_to(w, x.shape), cross) + t


def head_motion(camera, x, marks, sigma):
    """theta that minimises sum |picture - mark|^2 / sigma^2 + theta' prior theta, and J' W J + prior there.

    Gauss-Newton; the Jacobian is a complex step, which has no rounding error of a difference."""
    centre, weight = x.mean(axis=0), np.repeat(np.maximum(sigma, 0.01) ** -2.0, 2)
    theta = np.zeros(6)
    for _ in range(100):
        jacobian = np.empty((2 * len(x), 6))
        for k in range(6):
            step = theta.astype(complex)
            step[k] += 1e-30j
            jacobian[:, k] = camera.picture(turned(step, centre, x.astype(complex))).imag.ravel() / 1e-30
        residual = (camera.picture(turned(theta, centre, x)) - marks).ravel()
        normal = jacobian.T @ (weight[:, None] * jacobian) + HEAD_PRIOR
        delta = np.linalg.solve(normal, jacobian.T @ (weight * residual) + HEAD_PRIOR @ theta)
        theta = theta - delta
        if np.abs(delta).max() < 1e-15:
            break
    return theta, centre, normal


# Depth of the last frame --------------------------------------------------------------------------------------------

def seen_rows(camera, head, px):
    """Rows A x = b of the points x of the first frame's head that the last frame shows at px."""
    a, b = camera.ray_rows(px)
    theta, centre = head
    rotation = turned(np.append(theta[:3], np.zeros(3)), np.zeros(3), np.eye(3)).T
    return a @ rotation, b - a @ (centre + theta[3:] - rotation @ centre)


def at_depth(camera, head, px, z):
    a, b = seen_rows(camera, head, px)
    return np.append(np.linalg.solve(a[:, :2], b - a[:, 2] * z), z)


def on_surface(camera, head, px, x, triangles):
    """Every triangle is asked for the barycentric coordinates of the point seen at px; the nearest hit counts."""
    a, b = seen_rows(camera, head, px)
    corners = x[triangles]
    system = np.concatenate([np.einsum("ij,tkj->tik", a, corners), np.ones((len(triangles), 1, 3))], axis=1)
    share = np.linalg.solve(system, np.broadcast_to(np.append(b, 1.0)[:, None], (len(triangles), 3, 1)))[..., 0]
    hits = np.flatnonzero(share.min(axis=1) >= -1e-13)
    assert hits.size, "a mark of these scenes lies beyond the border of the patch"
    points = np.einsum("tk,tkj->tj", share[hits], corners[hits])
    return points[points[:, 2].argmax()]


# Unmarked vertices --------------------------------------------------------------------------------------------------

def inferred_weights(face, x, known, reach):
    """Rows of weights over the known vertices for the vertices that they surround; zero rows elsewhere.

    The finite-element Laplace problem, linear elements on the triangles whose corners all have or get a value."""
    n = len(x)
    surrounded = np.zeros(n, bool)
    for v in np.flatnonzero(~known):
        d = x[known, :2] - x[v, :2]
        d = d[np.hypot(d[:, 0], d[:, 1]) <= reach]
        if len(d):
            angle = np.sort(np.arctan2(d[:, 1], d[:, 0]))
            surrounded[v] = np.diff(np.append(angle, angle[0] + 2 * np.pi)).max() < WIDEST_GAP
    laplace, joined = np.zeros((n, n)), [set() for _ in range(n)]
    for t in face.triangles:
        if not (known | surrounded)[t].all():
            continue
        p, q = x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]
        # Gradients of the corners' hat functions in the plane of the triangle.
        metric = np.array([[p @ p, p @ q], [p @ q, q @ q]])
        slope = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
        area = 0.5 * np.sqrt(np.linalg.det(metric))
        laplace[np.ix_(t, t)] += area * slope @ np.linalg.inv(metric) @ slope.T
        for i in t:
            joined[i].update(t)
    # Only what triangles join to a known vertex, through other unknown ones, has an answer.
    reached, front = set(), [v for v in range(n) if known[v]]
    while front:
        for j in joined[front.pop()]:
            if surrounded[j] and j not in reached:
                reached.add(j)
                front.append(j)
    weights, unknown = np.zeros((n, n)), sorted(reached)
    if unknown:
        source = np.flatnonzero(known)
        weights[np.ix_(unknown, source)] = -np.linalg.solve(
            laplace[np.ix_(unknown, unknown)], laplace[np.ix_(unknown, source)])
    return weights, np.array(unknown, int)


# Springs ------------------------------------------------------------------------------------------------------------

class Skin:
    """The stress-strain table, piecewise linear; beyond either end the last slope goes on."""

    def __init__(self, table):
        self.rows = np.array(table["rows"])
        self.saturating = table.get("contraction", "saturating") == "saturating"

    def stress(self, strain):
        e, s = self.rows.T
        if self.saturating:
            strain = np.maximum(strain, WRINKLE_STRAIN)
        k = np.clip(np.searchsorted(e, strain, side="right") - 1, 0, len(e) - 2)
        return s[k] + (s[k + 1] - s[k]) / (e[k + 1] - e[k]) * (strain - e[k])


class Springs:
    """Every edge as a spring: h w sigma(strain), w the area of its triangles over its length, or the mean of those."""

    def __init__(self, face, x, settings):
        a, b, c = (x[face.triangles[:, k]] for k in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        self.edges = face.edges
        self.rest = np.linalg.norm(x[face.edges[:, 0]] - x[face.edges[:, 1]], axis=1)
        self.width = np.zeros(len(face.edges))
        for k in range(3):
            np.add.at(self.width, face.edge_of_side[k], area)
        self.width /= self.rest
        if settings.get("springs", "strip") == "uniform":
            self.width[:] = self.width.mean()
        self.skin = Skin(settings.get("skin", DEFAULT_SKIN))
        self.thickness = settings.get("skin_thickness_mm", 1.5)

    def strains(self, x):
        return np.linalg.norm(x[self.edges[:, 0]] - x[self.edges[:, 1]], axis=1) / self.rest - 1.0

    def tensions(self, x):
        return 1e-3 * self.thickness * self.width * self.skin.stress(self.strains(x))

    def forces(self, x, known):
        """F = -K X (4.5) with K of (4.3), (4.4) from alpha = k (l - L) / L (4.2) and k the secant T / (L - l)."""
        length = np.linalg.norm(x[self.edges[:, 0]] - x[self.edges[:, 1]], axis=1)
        longer = length - self.rest
        secant = np.divide(self.tensions(x), longer, out=np.zeros_like(longer), where=longer != 0)
        alpha = secant * (self.rest - length) / length
        stiffness = np.zeros((len(x), len(x)))
        for (i, j), a in zip(self.edges, alpha):
            if known[i] and known[j]:
                stiffness[i, i] += a
                stiffness[j, j] += a
                stiffness[i, j] -= a
                stiffness[j, i] -= a
        return -stiffness @ x


# The chain ----------------------------------------------------------------------------------------------------------

class Chain:
    """A project and a face, solved; `last_frame` and `forces` can be asked again with other marks."""

    def __init__(self, project, face):
        settings = project.get("settings", {})
        self.project, self.face, self.camera = project, face, Camera(project, face)
        customised, self.scale, self.rms_before = customise(project, face, self.camera)
        features = {int(v): f for v, f in project.get("features", {}).items()}
        self.first = customised.copy()
        at_rest = (np.zeros(6), np.zeros(3))
        for v, f in features.items():
            if is_data(f.get("first")):
                self.first[v] = on_surface(self.camera, at_rest, np.array(f["first"]["at_px"]), customised, face.triangles)
        counts = {v: f for v, f in features.items() if is_data(f.get("last"))}
        self.marked = sorted(v for v, f in counts.items() if f.get("role", "skin") != "fixed")
        self.marks = np.array([counts[v]["last"]["at_px"] for v in self.marked])
        plain = settings.get("marking_sigma_px", 1.0)
        self.sigma_px = np.array([counts[v]["last"].get("sigma_px", plain) for v in self.marked])
        self.sigma_px *= [3.0 if counts[v]["last"].get("state") == "uncertain" else 1.0 for v in self.marked]
        self.still = [k for k, v in enumerate(self.marked) if counts[v].get("role") == "still"]
        self.removes_head = settings.get("remove_head_motion", True) and len(self.still) >= 3
        self.rule = settings.get("depth", "fixed_depth")
        unmarked = settings.get("unmarked", {"rule": "inferred", "reach_mm": 15.0})
        self.states = np.full(len(face.x), "unmeasured", dtype="<U10")
        self.states[[v for v, f in features.items() if f.get("role") == "fixed"]] = "fixed"
        self.states[self.marked] = "measured"
        if unmarked["rule"] == "held":
            self.states[self.states == "unmeasured"] = "fixed"
            self.weights, inferred = np.zeros((len(face.x),) * 2), []
        else:
            self.weights, inferred = inferred_weights(face, self.first, self.states != "unmeasured", unmarked["reach_mm"])
        self.states[inferred] = "inferred"
        self.inferred, self.known = inferred, self.states != "unmeasured"
        self.springs = Springs(face, self.first, settings)
        self.head, self.head_normal = self.estimate_head(self.marks)

    def estimate_head(self, marks):
        if not self.removes_head:
            return (np.zeros(6), np.zeros(3)), None
        x = self.first[[self.marked[k] for k in self.still]]
        theta, centre, normal = head_motion(self.camera, x, marks[self.still], self.sigma_px[self.still])
        return (theta, centre), normal

    def last_frame(self, marks, head, rule):
        last = self.first.copy()
        for v, px in zip(self.marked, marks):
            if rule == "fixed_depth":
                last[v] = at_depth(self.camera, head, px, self.first[v][2])
            else:
                last[v] = on_surface(self.camera, head, px, self.first, self.face.triangles)
        moved = last - self.first
        last[self.inferred] += self.weights[self.inferred] @ moved
        return last

    def forces(self, marks, head, rule):
        return self.springs.forces(self.last_frame(marks, head, rule), self.known)

    def standard_errors(self):
        """sqrt(tr Cov F): each mark disturbed along each axis, through all that follows from it; and what the marks leave
        open of the head's motion, the part N^-1 P N^-1 of its covariance N^-1 that comes from the prior P."""
        variance, h = np.zeros(len(self.first)), 1e-3
        for k in range(len(self.marked)):
            for axis in (0, 1):
                sides = []
                for sign in (h, -h):
                    marks = self.marks.copy()
                    marks[k, axis] += sign
                    head = self.estimate_head(marks)[0] if k in self.still else self.head
                    sides.append(self.forces(marks, head, self.rule))
                slope = (sides[0] - sides[1]) / (2.0 * h)
                variance += self.sigma_px[k] ** 2 * (slope ** 2).sum(axis=1)
        if self.removes_head:
            (theta, centre), inverse = self.head, np.linalg.inv(self.head_normal)
            step = 1e-5
            slope = np.stack([
                (self.forces(self.marks, (theta + step * e, centre), self.rule)
                 - self.forces(self.marks, (theta - step * e, centre), self.rule)) / (2.0 * step)
                for e in np.eye(6)], axis=2)
            variance += np.einsum("vik,kl,vil->v", slope, inverse @ HEAD_PRIOR @ inverse, slope)
        return np.sqrt(variance)
