"""Reference values for `src/verify/free_surfaces.rs`: a unit box, no slip on all sides, whose lower
part, y < 1/2 + s (x - 1/2), is a heavy fluid (density and viscosity 1, gravity -1) under a light one
of viscosity 1/contrast and no density.

Elements: triangles with quadratic velocity and a cubic bubble, discontinuous linear pressure
(Crouzeix and Raviart 1973), on a mesh whose edges follow the surface. Prints, for each slope and
contrast, the power of the weight, the root mean square speed and the largest nodal speed on
n x n x 2 triangles, and their limits by Aitken's extrapolation.

    python3 tests/reference/tilted_surface.py        # needs numpy and scipy
"""

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl

# Strang-Fix rule of degree 6 with 12 points on the triangle with area 1/2.
A, B = (0.873821971016996, 0.063089014491502), (0.501426509658179, 0.249286745170910)
C = (0.636502499121399, 0.310352451033785, 0.053145049844816)
POINTS, WEIGHTS = [], []
for (a, b), w in ((A, 0.050844906370207), (B, 0.116786275726379)):
    for l in ((a, b, b), (b, a, b), (b, b, a)):
        POINTS.append(l)
        WEIGHTS.append(w)
for i, j, k in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
    POINTS.append((C[i], C[j], C[k]))
    WEIGHTS.append(0.082851075618374)
POINTS, WEIGHTS = np.array(POINTS), 0.5 * np.array(WEIGHTS)


def shapes(l):
    """Six quadratic functions and the bubble: values and derivatives by barycentric coordinates."""
    n, d = np.zeros(7), np.zeros((7, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        n[i], d[i, i] = l[i] * (2 * l[i] - 1), 4 * l[i] - 1
        n[3 + i], d[3 + i, j], d[3 + i, k] = 4 * l[j] * l[k], 4 * l[k], 4 * l[j]
        d[6, i] = 27 * l[j] * l[k]
    n[6] = 27 * l[0] * l[1] * l[2]
    return n, d


def mesh(slope, n):
    """Corners, triangles, and whether each is heavy."""
    steep = slope > 1
    s = 1 / slope if steep else slope
    t = np.linspace(0, 1, n + 1)
    x, v = np.meshgrid(t, t, indexing="ij")
    if s == 1:
        y = v
    else:
        # Half of the rows lie below the surface.
        at = 0.5 + s * (x - 0.5)
        y = np.where(v <= 0.5, 2 * v * at, 1 - 2 * (1 - v) * (1 - at))
    corners = np.stack([x.ravel(), y.ravel()], 1)
    node = lambda i, j: i * (n + 1) + j
    triangles, heavy = [], []
    for i in range(n):
        for j in range(n):
            a, b, c, d = node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)
            triangles += [(a, b, c), (a, c, d)]
            if s == 1:
                # The surface is a diagonal of the squares on it.
                heavy += [j < i or j == i, j < i]
            else:
                heavy += [j < n // 2] * 2
    heavy = np.array(heavy)
    if steep:
        # Mirrored at y = x: the surface y = 1/2 + s (x - 1/2), heavy on the right.
        corners, heavy = corners[:, ::-1].copy(), ~heavy
    return corners, np.array(triangles), heavy


def solve(slope, contrast, n):
    corners, triangles, heavy = mesh(slope, n)
    edges, middles = {}, []
    nodes = np.zeros((len(triangles), 7), int)
    for e, tri in enumerate(triangles):
        nodes[e, :3] = tri
        for i in range(3):
            edge = tuple(sorted((tri[(i + 1) % 3], tri[(i + 2) % 3])))
            if edge not in edges:
                edges[edge] = len(corners) + len(middles)
                middles.append(corners[list(edge)].mean(0))
            nodes[e, 3 + i] = edges[edge]
    places = np.vstack([corners, middles])
    nodes[:, 6] = len(places) + np.arange(len(triangles))
    count = len(places) + len(triangles)
    basis = [shapes(l) for l in POINTS]
    rows, columns, values = [], [], []
    brows, bcolumns, bvalues = [], [], []
    load = np.zeros(2 * count)
    mass = []
    for e, tri in enumerate(triangles):
        p = corners[tri]
        t = np.array([p[1] - p[0], p[2] - p[0]]).T
        det = np.linalg.det(t)
        inverse = np.linalg.inv(t)
        gl = np.array([-inverse[0] - inverse[1], inverse[0], inverse[1]])
        eta = 1.0 if heavy[e] else 1.0 / contrast
        k, b, m = np.zeros((14, 14)), np.zeros((3, 14)), np.zeros((7, 7))
        f = np.zeros(14)
        for (value, d), l, w in zip(basis, POINTS, WEIGHTS):
            g, w = d @ gl, w * abs(det)
            xx, yy, xy = np.zeros(14), np.zeros(14), np.zeros(14)
            xx[0::2], yy[1::2], xy[0::2], xy[1::2] = g[:, 0], g[:, 1], g[:, 1], g[:, 0]
            k += w * eta * (2 * np.outer(xx, xx) + 2 * np.outer(yy, yy) + np.outer(xy, xy))
            b += w * np.outer(l, xx + yy)
            m += w * np.outer(value, value)
            if heavy[e]:
                f[1::2] -= w * value
        dof = np.stack([2 * nodes[e], 2 * nodes[e] + 1], 1).ravel()
        rows.append(np.repeat(dof, 14)), columns.append(np.tile(dof, 14)), values.append(k.ravel())
        brows.append(np.repeat(3 * e + np.arange(3), 14))
        bcolumns.append(np.tile(dof, 3)), bvalues.append(b.ravel())
        load[dof] += f
        mass.append(m)
    join = np.concatenate
    size, pressures = 2 * count, 3 * len(triangles)
    k = sp.csr_matrix((join(values), (join(rows), join(columns))), (size, size))
    b = sp.csr_matrix((join(bvalues), (join(brows), join(bcolumns))), (pressures, size))
    rim = np.where((np.minimum(places, 1 - places) < 1e-12).any(1))[0]
    fixed = np.zeros(size, bool)
    fixed[2 * rim], fixed[2 * rim + 1] = True, True
    free = np.where(~fixed)[0]
    # The first pressure is zero: only its gradient matters.
    system = sp.bmat([[k[free][:, free], b[1:, free].T], [b[1:, free], None]], format="csc")
    solution = sl.splu(system).solve(np.concatenate([load[free], np.zeros(pressures - 1)]))
    u = np.zeros(size)
    u[free] = solution[: len(free)]
    square = sum(
        (u[2 * nodes[e] + c] @ m @ u[2 * nodes[e] + c]) for e, m in enumerate(mass) for c in (0, 1)
    )
    nodal = u[: 2 * len(places)].reshape(-1, 2)
    return np.array([load @ u, np.sqrt(square), np.sqrt((nodal**2).sum(1)).max()])


def main():
    for slope in (0.1, 0.4, 1.0, 3.0):
        for contrast in (1e2, 1e4, 1e6, 1e8):
            found = [solve(slope, contrast, n) for n in (16, 32, 64)]
            # Aitken: the order, between 1 and 2, is that of the corners and of the contact points.
            first, second = found[1] - found[0], found[2] - found[1]
            last = found[2] + second**2 / (first - second)
            for n, values in zip((16, 32, 64, "limit"), (*found, last)):
                print(slope, f"{contrast:.0e}", n, *(f"{v:.5e}" for v in values), flush=True)


if __name__ == "__main__":
    main()
