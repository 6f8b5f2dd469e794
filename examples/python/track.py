"""track.py - follows the points of a ball through a flow that rolls it up and back again (LeVeque), written in numpy.

    python3 build/python/track.py
"""
import numpy as np
import springls

N, PERIOD = 64, 1.5


def velocity(points, time):
    (x, y, z), k = np.pi * points.T / N, 2 * np.pi / N * np.cos(np.pi * time / PERIOD)
    sx, sy, sz = np.sin(2 * x), np.sin(2 * y), np.sin(2 * z)
    v = 2 * np.sin(x) ** 2 * sy * sz, -sx * np.sin(y) ** 2 * sz, -sx * sy * np.sin(z) ** 2
    return N * N / np.pi / 2 * k * np.stack(v, axis=1)


model = springls.Model((N, N, N))
model.set_implicit(lambda points: np.linalg.norm(points - 0.35 * N, axis=1) - 0.15 * N)
while model.time < PERIOD:
    model.step(dt=min(PERIOD / 20, PERIOD - model.time), velocity=velocity)
    print(f'time {model.time:.3f}: {model.count} springls, area {model.measure().area:.0f}')
way = np.linalg.norm(model.particles() - model.correspondences(), axis=1)
print(f'points came back to where they were within {way.mean():.4f} voxels on average, {way.max():.3f} at most')
