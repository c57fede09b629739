"""The equation of the device: its terms, their derivatives, and the tension of the line.

Lengths are over that of the line, times over 1/omega. phi is the angle of the line in a frame that turns with the ship,
z = d phi/dt. The device moves at U = u + z across its line and at w along it, u = 1 + R sin phi, w = R cos phi. With
S = |(U, w)|, a = cos alpha, b = sin alpha

    dz/dt = F = w - k Phi,  Phi = S (a U - b w),  T = k S (b U + a w) + u + 2 z + z^2,

Eqs. (15) and (16). Phi is homogeneous of degree 2: derivatives of it are written in the direction of (U, w).
"""

from dataclasses import dataclass
from math import cos, hypot, pi, sin, sqrt

import numpy as np

from towatlas.checks import check_finite, check_one

RIGHT_ANGLE = 0.5 * pi
# Beyond, fixed points lie closer together than rounding tells; devices at sea have k L/m of tens to hundreds.
LEAST_K, LARGEST_K = 1e-4, 1e5
LEAST_R, LARGEST_R = 1e-4, 1e6


@dataclass(frozen=True)
class Device:
    """A device on its line.

    Attributes
    ----------
    k : float
        Force constant of the fluid k L/m [-], 1e-4 to 1e5.
    alpha : float
        Angle of the fluid's force against the velocity [rad], -pi/2 to pi/2; positive pulls out of the turn.
    """

    k: float
    alpha: float

    @property
    def a(self) -> float:
        """cos alpha, exactly 0 at a right angle."""
        return 0.0 if abs(self.alpha) == RIGHT_ANGLE else cos(self.alpha)

    @property
    def b(self) -> float:
        """sin alpha."""
        return sin(self.alpha)


def check_device(k: float, alpha: float) -> Device:
    """A device from what a user passes.

    Parameters
    ----------
    k : float
        Force constant of the fluid k L/m [-], 1e-4 to 1e5.
    alpha : float
        Angle of its force [rad], -pi/2 to pi/2.

    Returns
    -------
    Device

    Raises
    ------
    ValueError
    """
    return Device(check_strength(k), check_alpha(alpha))


def check_strength(k: float) -> float:
    """The force constant of the fluid.

    Parameters
    ----------
    k : float
        k L/m [-]

    Returns
    -------
    float
        1e-4 to 1e5.

    Raises
    ------
    ValueError
        For others.
    """
    k = check_one("k", k)
    if not LEAST_K <= k <= LARGEST_K:
        raise ValueError(
            f"k L/m = {k:g} is outside {LEAST_K:g} to {LARGEST_K:g}, where fixed points can be told apart; devices "
            "at sea have tens to hundreds: are its units right?"
        )
    return k


def check_alpha(alpha: float) -> float:
    """The angle of the force of the fluid.

    Parameters
    ----------
    alpha : float
        [rad]

    Returns
    -------
    float
        -pi/2 to pi/2.

    Raises
    ------
    ValueError
        Beyond: such a force would push the device along.
    """
    alpha = check_finite("alpha", alpha)
    if abs(alpha) > RIGHT_ANGLE:
        raise ValueError(
            f"alpha = {alpha:g} rad is {abs(np.degrees(alpha)):.6g} degrees: beyond 90 the fluid would push the device "
            "along; the angle of its force against the velocity is from -pi/2 to pi/2 (radians)"
        )
    return alpha


def check_radius(radius: float) -> float:
    """The turning radius of the ship over the length of the line.

    Parameters
    ----------
    radius : float
        [-]

    Returns
    -------
    float
        1e-4 to 1e6.

    Raises
    ------
    ValueError
        For others.
    """
    radius = check_finite("R", radius)
    if radius <= 0.0:
        raise ValueError(
            f"R must be positive, got {radius:g}: a ship that turns on the spot tows nothing, and a turn to the other "
            "side is that of the device with -alpha"
        )
    if not LEAST_R <= radius <= LARGEST_R:
        raise ValueError(
            f"R = {radius:g} line lengths is outside {LEAST_R:g} to {LARGEST_R:g}, where fixed points can be told apart"
        )
    return radius


def tension(device: Device, u: float, w: float, z: float = 0.0) -> float:
    """Tension of the line, Eq. (16).

    Parameters
    ----------
    device : Device
    u, w : float
        Velocity of the device if the line stood still [-].
    z : float
        Rate at which it turns [-].

    Returns
    -------
    float
        Over m L omega^2 [-]; negative where the line would have to push.
    """
    U = u + z
    return device.k * hypot(U, w) * (device.b * U + device.a * w) + u + 2.0 * z + z * z


@dataclass(frozen=True)
class Expansion:
    """F about a fixed point: the sum of b_ij (phi - phi*)^i z^j, Eq. (25).

    Attributes
    ----------
    b10, b01, b20, b11, b02, b21, b03 : float
        Those that stability, normal form and manifolds need [-].
    """

    b10: float
    b01: float
    b20: float
    b11: float
    b02: float
    b21: float
    b03: float

    @property
    def eigenvalues(self) -> tuple[complex, complex]:
        """Roots of Eq. (18), that with the larger real part or the positive imaginary one first."""
        half, determinant = 0.5 * self.b01, -self.b10
        square = half * half - determinant
        if square < 0.0:
            return complex(half, sqrt(-square)), complex(half, -sqrt(-square))
        # The larger without cancellation, the other by their product.
        large = half + sqrt(square) if half >= 0.0 else half - sqrt(square)
        small = determinant / large if large else 0.0
        return complex(max(large, small)), complex(min(large, small))

    @property
    def sigma(self) -> float:
        """Eq. (26): where F_z = 0, cycles born are stable if it is positive, unstable if it is negative."""
        return -self.b11 * self.b20 + self.b10 * self.b11 * self.b02 - self.b10 * (3.0 * self.b10 * self.b03 - self.b21)


def expand(device: Device, u: float, w: float) -> Expansion:
    """Derivatives of F at rest.

    Parameters
    ----------
    device : Device
    u, w : float
        Velocity of the device [-].

    Returns
    -------
    Expansion
        At the centre, u = w = 0, the third derivatives do not exist: they are nan there.
    """
    k, a, b, S = device.k, device.a, device.b, hypot(u, w)
    q = u - 1.0  # R sin phi
    if S == 0.0:
        return Expansion(-q, 0.0, *[float("nan")] * 5)
    c, s = u / S, w / S
    g = a * c - b * s
    slope = -(a * s + b * c)  # of g along the direction
    P_U, P_w = S * (c * g + a), S * (s * g - b)
    P_UU, P_Uw, P_ww = 2.0 * a * c + g * s * s, a * s - b * c - g * c * s, -2.0 * b * s + g * c * c
    turn = (-2.0 * a * s + slope * s * s + 2.0 * g * s * c) / S
    P_UUU, P_UUw = -s * turn, c * turn
    P_Uww = c * (a * c + b * s - slope * c * s - g * (c * c - s * s)) / S
    # d/d phi = w d/dU - q d/dw, dw/d phi = -q, dq/d phi = w.
    along = w * (w * P_UU - q * P_Uw) - q * (w * P_Uw - q * P_ww) - q * P_U - w * P_w
    return Expansion(
        b10=-q - k * (w * P_U - q * P_w),
        b01=-k * P_U,
        b20=0.5 * (-w - k * along),
        b11=-k * (w * P_UU - q * P_Uw),
        b02=-0.5 * k * P_UU,
        b21=-0.5 * k * (w * w * P_UUU - 2.0 * w * q * P_UUw + q * q * P_Uww - q * P_UU - w * P_Uw),
        b03=-k * P_UUU / 6.0,
    )
