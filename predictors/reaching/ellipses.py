"""The spread of reaches over time: determinant and trace, ellipses over the table, and a picture of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from legible_envs.support.names import printable
from legible_envs.support.validation import integer, real

if TYPE_CHECKING:
    import pandas as pd

    from predictors.reaching.gaussian import TimeSeriesGaussian

__all__ = ["draw_reaches", "ellipse_table", "spread_table"]

# Okabe and Ito's colours, distinct for colour-blind readers too.
_COLOURS: Final = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (213, 94, 0),
    (204, 121, 167),
    (86, 180, 233),
    (150, 140, 20),
    (90, 90, 90),
    (240, 228, 66),
    (120, 60, 20),
)


def spread_table(gaussian: TimeSeriesGaussian) -> pd.DataFrame:
    """Mean position and size of the covariance of positions, per goal and step.

    Compare sizes between conditions only at equal alignment, number of steps, band and number of reaches: the first
    three and the last are in ``.attrs`` and the column ``reaches``.

    Args:
        gaussian: A fitted predictor of ``d``-dimensional reaches.

    Returns:
        ``G * K`` rows: ``goal``, ``reaches``, ``step``, ``time`` (share of the reach, 0 to 1), ``mean_0`` … (metres
        from the start), ``determinant`` (metres^2d) and ``trace`` (metres^2), both with the floor included.
    """
    import pandas as pd

    goals, steps, d = len(gaussian.goals_), gaussian.n_samples, gaussian.n_dims_
    covariances = gaussian.covariances_[:, :, :d, :d]
    table = pd.DataFrame(
        {
            "goal": np.repeat(gaussian.goals_, steps),
            "reaches": np.repeat(gaussian.counts_, steps),
            "step": np.tile(np.arange(steps), goals),
            "time": np.tile(np.linspace(0.0, 1.0, steps), goals),
            **{f"mean_{k}": gaussian.means_[:, :, k].ravel() for k in range(d)},
            "determinant": np.linalg.det(covariances).ravel(),
            "trace": np.trace(covariances, axis1=2, axis2=3).ravel(),
        }
    )
    table.attrs.update(
        alignment=gaussian.alignment, n_samples=steps, band=gaussian.band, floor=gaussian.floor, dimensions=d
    )
    return table


def ellipse_table(gaussian: TimeSeriesGaussian, *, deviations: float = 2.0, every: int = 5) -> pd.DataFrame:
    """Ellipses of equal density around the mean reaches, for figures.

    Args:
        gaussian: A fitted predictor of reaches in the plane.
        deviations: Half-axes in standard deviations; 2 covers 86 % of positions.
        every: Every how many steps; the last step is included.

    Returns:
        Rows ``goal``, ``step``, ``time``, ``x``, ``y`` (centre, metres from the start), ``major``, ``minor``
        (half-axes, metres) and ``angle`` (of the major axis against x, radians, in (-pi/2, pi/2]).

    Raises:
        ValueError: Reaches that are not in the plane, or arguments out of range.
    """
    import pandas as pd

    if gaussian.n_dims_ != 2:
        raise ValueError(f"ellipses need reaches in the plane, these have dimension {gaussian.n_dims_}")
    deviations, every = real("deviations", deviations, 0, closed="neither"), integer("every", every, 1)
    last = gaussian.n_samples - 1
    chosen = np.unique(np.r_[np.arange(0, last, every), last])
    values, axes = np.linalg.eigh(gaussian.covariances_[:, chosen, :2, :2])
    direction = axes[..., :, 1]
    angle = np.arctan2(direction[..., 1], direction[..., 0])
    angle = np.where(angle > np.pi / 2, angle - np.pi, np.where(angle <= -np.pi / 2, angle + np.pi, angle))
    half_axes = deviations * np.sqrt(values)
    return pd.DataFrame(
        {
            "goal": np.repeat(gaussian.goals_, len(chosen)),
            "step": np.tile(chosen, len(gaussian.goals_)),
            "time": np.tile(chosen / last, len(gaussian.goals_)),
            "x": gaussian.means_[:, chosen, 0].ravel(),
            "y": gaussian.means_[:, chosen, 1].ravel(),
            "major": half_axes[..., 1].ravel(),
            "minor": half_axes[..., 0].ravel(),
            "angle": angle.ravel(),
        }
    )


def draw_reaches(
    gaussian: TimeSeriesGaussian, *, size: int = 600, deviations: float = 2.0, every: int = 5
) -> npt.NDArray[np.uint8]:
    """Mean reaches and their ellipses from above, y away from the person.

    Args:
        gaussian: A fitted predictor of reaches in the plane.
        size: Width and height in pixels, 16 to 4096.
        deviations: Half-axes in standard deviations; 2 covers 86 % of positions.
        every: Every how many steps an ellipse is drawn; the last step is included.

    Returns:
        ``(size, size, 3)`` RGB.

    Raises:
        ValueError: Reaches that are not in the plane, or arguments out of range.
    """
    from PIL import Image, ImageDraw

    size = integer("size", size, 16, 4096, unit="pixels")
    table = ellipse_table(gaussian, deviations=deviations, every=every)
    turn = np.linspace(0.0, 2 * np.pi, 49)
    along, across = table["major"].to_numpy()[:, None] * np.cos(turn), table["minor"].to_numpy()[:, None] * np.sin(turn)
    cos, sin = np.cos(table["angle"].to_numpy())[:, None], np.sin(table["angle"].to_numpy())[:, None]
    rings = np.stack([along * cos - across * sin, along * sin + across * cos], axis=2)
    rings += table[["x", "y"]].to_numpy()[:, None]
    lowest, highest = rings.min(axis=(0, 1)), rings.max(axis=(0, 1))
    scale = 0.94 * size / (highest - lowest).max()
    middle = (lowest + highest) / 2

    def pixels(points: npt.NDArray[np.float64]) -> list[tuple[float, float]]:
        x, y = ((points - middle) * scale).T
        return list(zip((size / 2 + x).tolist(), (size / 2 - y).tolist(), strict=True))

    image = Image.new("RGB", (size, size), "white")
    pen = ImageDraw.Draw(image, "RGBA")
    colours = {goal: _COLOURS[i % len(_COLOURS)] for i, goal in enumerate(gaussian.goals_)}
    for ring, goal in zip(rings, table["goal"], strict=True):
        pen.polygon(pixels(ring), fill=(*colours[goal], 26), outline=(*colours[goal], 120))
    for mean, goal in zip(gaussian.means_, gaussian.goals_, strict=True):
        points = pixels(mean[:, :2])
        pen.line(points, fill=colours[goal], width=3)
        pen.text(points[-1], printable(str(goal)), fill=(20, 20, 20))
    return np.asarray(image)
