"""How a disturbance of a cutting tool grows from edge to edge: delayed equations, integrated without kinetostat."""

import math

import numpy as np


def growth(squares, ratio, tool, force, period, steps=160):
    """The factor by which a disturbance grows from one edge to the next; above 1 the tool chatters.

    Each mode: s q'' + 2 ratio sqrt(s) q' + q = t . F, with the tool at u = sum t q, and F the force times the
    difference of u and what it was a period ago.

    Args:
        squares: s of the modes, s² [n].
        ratio: damping ratio of all modes.
        tool: t of the modes along the ways of the tool, m/√J [k x n].
        force: of all edges per difference of paths, N/m [k x k], over the share of the time between two edges.
        period: between two edges, s.
        steps: of the integration, each with a constant force and the mean of the path at its ends.
    """
    count, ways = len(squares), len(tool)
    size, step, delayed = 2 * count, period / steps, steps * ways
    free = np.zeros((size, size))
    free[:count, count:] = np.eye(count)
    free[count:, :count] = -np.diag(1.0 / squares)
    free[count:, count:] = -np.diag(2.0 * ratio / np.sqrt(squares))
    inputs = np.vstack([np.zeros((count, ways)), (tool / squares).T])
    whole = np.eye(size + delayed)
    for n in range(steps):
        mean = force((n + 0.5) / steps)
        closed = free.copy()
        closed[:, :count] += inputs @ mean @ tool
        values, vectors = np.linalg.eig(closed)
        inverse = np.linalg.inv(vectors)
        exact = ((vectors * np.exp(values * step)) @ inverse).real
        held = ((vectors * np.where(abs(values) > 0, np.expm1(values * step) / values, step)) @ inverse).real
        rows = np.zeros((size + delayed, size + delayed))
        rows[:size, :size] = exact
        oldest = np.zeros((ways, size + delayed))
        oldest[:, -ways:] += 0.5 * np.eye(ways)
        oldest[:, -2 * ways : -ways] += 0.5 * np.eye(ways)
        rows[:size] += held @ inputs @ (-mean) @ oldest
        rows[size : size + ways, :count] = tool
        rows[size + ways :, size:-ways] = np.eye(delayed - ways)
        whole = rows @ whole
    return float(np.abs(np.linalg.eigvals(whole)).max())


def edges(teeth, entry, leaving, push):
    """Force of all edges per pressure, width and difference of paths, over the share of the time between two edges.

    Args:
        push: force of one edge at an angle, in the same measure [2 x 2].
    """

    def force(share):
        angles = [2.0 * math.pi * (share + tooth) / teeth for tooth in range(teeth)]
        return sum((push(angle) for angle in angles if entry <= angle <= leaving), np.zeros((2, 2)))

    return force
