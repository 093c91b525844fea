# SPDX-License-Identifier: MIT
"""Pure NumPy versions of two computations of the library, written from the equations alone.

- predict(): the extended bicycle model, integrated by the classical Runge-Kutta method of fourth order.
- filter_step(): one prediction and one position update of the extended Kalman filter.

Source: "Extended Bicycle Model for Needle Steering in Soft Tissue" (IROS 2015); equation numbers are the paper's.
Frames: {A} fixed, z into the tissue; {B} moves with the tip, its third axis is the heading. Twists are (v | omega).
"""

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Parameters:
    """Parameters of the needle: k (1/mm), lambda1 (1/rad), lambda2, ell (mm)."""

    k: float
    lambda1: float = 0.0
    lambda2: float = 0.0
    ell: float = 20.0
    isotropic: bool = True
    front_wheel: float = 1.0  # sign of f in Eq. 13: +1 as published, -1 for a front wheel that does not slip


def hat(w):
    """Returns the matrix of the cross product with w."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def slip(R, p):
    """Computes the slip f = tan(alpha) as a vector in the x-y plane of {B} (Eq. 25, spatial form).

    Args:
        R: orientation of {B} in {A}, shape (3, 3).
        p: Parameters.
    """
    n = R.T @ np.array([0.0, 0.0, 1.0])
    side = np.hypot(n[0], n[1])
    if side == 0:
        return np.zeros(2)
    theta = np.arctan2(side, n[2])
    direction = -n[:2] / side
    if not p.isotropic:  # only the component in the plane of the bevel, body y
        direction[0] = 0.0
    b = 1 - p.lambda2
    gamma = 2 * theta / (b + np.sqrt(b * b + 4 * p.lambda1 * theta))  # theta is not negative
    alpha = p.lambda2 * gamma - p.lambda1 * gamma * gamma
    return np.tan(alpha) * direction


def twist(R, p, insertion_rate, rotation_rate):
    """Computes the body twist (v | omega) of Eq. 10 with slip (Eqs. 13, 15, 16)."""
    f = slip(R, p)
    curvature = np.array([p.k, 0.0]) + p.front_wheel * np.array([-f[1], f[0]]) / p.ell
    v = insertion_rate * np.array([f[0], f[1], 1.0])
    return v, np.array([insertion_rate * curvature[0], insertion_rate * curvature[1], rotation_rate])


def advance(position, R, p, insertion, rotation, steps):
    """Moves a pose by increments of the axes at constant rates, with RK4 on position and matrix entries."""
    h = 1.0 / steps

    def rates(state):
        orientation = state[3:].reshape(3, 3)
        v, w = twist(orientation, p, insertion, rotation)
        return np.concatenate([orientation @ v, (orientation @ hat(w)).ravel()])

    state = np.concatenate([position, R.ravel()])
    for _ in range(steps):
        k1 = rates(state)
        k2 = rates(state + h / 2 * k1)
        k3 = rates(state + h / 2 * k2)
        k4 = rates(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        u, _, vt = np.linalg.svd(state[3:].reshape(3, 3))  # back to a rotation
        state[3:] = (u @ vt).ravel()
    return state[:3], state[3:].reshape(3, 3)


def predict(p, insertion_mm, rotation_rad, step_mm=0.05, step_rad=0.005):
    """Predicts the tip at each sample of the axes.

    Args:
        p: Parameters.
        insertion_mm, rotation_rad: positions of the axes, shape (n,), linear in between.

    Returns:
        Positions (mm) and headings in {A}, each of shape (n, 3).
    """
    position, R = np.zeros(3), np.eye(3)
    positions, headings = [position], [R[:, 2]]
    for i in range(1, len(insertion_mm)):
        insertion = insertion_mm[i] - insertion_mm[i - 1]
        rotation = rotation_rad[i] - rotation_rad[i - 1]
        steps = max(1, int(np.ceil(abs(insertion) / step_mm)), int(np.ceil(abs(rotation) / step_rad)))
        position, R = advance(position, R, p, insertion, rotation, steps)
        positions.append(position)
        headings.append(R[:, 2])
    return np.array(positions), np.array(headings)


def log_so3(R):
    """Returns the rotation vector of a rotation, for angles below 3 rad."""
    w = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    s, c = np.linalg.norm(w), (np.trace(R) - 1) / 2
    return w if s < 1e-12 else w * np.arctan2(s, c) / s


def exp_so3(w):
    """Returns the rotation of a rotation vector (Rodrigues)."""
    t = np.linalg.norm(w)
    if t < 1e-12:
        return np.eye(3) + hat(w)
    W = hat(w / t)
    return np.eye(3) + np.sin(t) * W + (1 - np.cos(t)) * W @ W


def exp_se3(x):
    """Returns position and rotation of a twist (v | omega); the series of the left Jacobian, to rounding."""
    v, W = x[:3], hat(x[3:])
    V, term = np.eye(3), np.eye(3)
    for i in range(2, 25):
        term = term @ W / i
        V = V + term
    return V @ v, exp_so3(x[3:])


def log_se3(position, R):
    """Returns the twist of a pose."""
    w = log_so3(R)
    W = hat(w)
    V, term = np.eye(3), np.eye(3)
    for i in range(2, 25):
        term = term @ W / i
        V = V + term
    return np.concatenate([np.linalg.solve(V, position), w])


@dataclass
class State:
    """State of the filter: pose, needle, covariance of (position, rotation in {B} | k, lambda1, lambda2), (9, 9)."""

    position: np.ndarray
    R: np.ndarray
    p: Parameters
    covariance: np.ndarray


def perturbed(state, x):
    """Returns pose and needle of a state moved by an error vector of nine."""
    dp, dR = exp_se3(x[:6])
    p = replace(state.p, k=state.p.k + x[6], lambda1=state.p.lambda1 + x[7], lambda2=state.p.lambda2 + x[8])
    return state.position + state.R @ dp, state.R @ dR, p


def predict_state(state, insertion, rotation, process_variance):
    """Propagates mean and covariance by increments of the axes.

    The Jacobian comes from central differences of the model itself.

    Args:
        process_variance: variances added to the nine error states.
    """
    steps = max(4, int(np.ceil(abs(insertion) / 0.05)), int(np.ceil(abs(rotation) / 0.005)))
    position, R = advance(state.position, state.R, state.p, insertion, rotation, steps)
    F = np.eye(9)
    for j in range(9):
        h = 1e-6 if j >= 6 else 1e-5
        columns = []
        for sign in (1, -1):
            x = np.zeros(9)
            x[j] = sign * h
            p0, R0, needle = perturbed(state, x)
            p1, R1 = advance(p0, R0, needle, insertion, rotation, steps)
            columns.append(log_se3(R.T @ (p1 - position), R.T @ R1))
        F[:6, j] = (columns[0] - columns[1]) / (2 * h)
    covariance = F @ state.covariance @ F.T + np.diag(process_variance)
    return State(position, R, state.p, covariance)


def update_state(state, measured, noise):
    """Applies a measured position (mm, shape (3,)) with covariance noise (3, 3): Joseph form, pose by exp."""
    H = np.hstack([state.R, np.zeros((3, 6))])
    S = H @ state.covariance @ H.T + noise
    K = state.covariance @ H.T @ np.linalg.inv(S)
    x = K @ (measured - state.position)
    A = np.eye(9) - K @ H
    covariance = A @ state.covariance @ A.T + K @ noise @ K.T
    position, R, p = perturbed(state, x)
    return State(position, R, p, covariance)
