"""Model: a robot description, loaded, checked and computed with."""
from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import _doppel
from ._errors import IkError, numbers, refuse, shaped, single, whole
from ._names import Named

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

EARTH = (0.0, 0.0, -9.81)  # m/s^2, world axes
ROTATION_TOLERANCE = 1e-4  # of R R^T, so that measured and rounded rotations pass


@dataclass(frozen=True)
class Joint:
    """A joint of a model. Positions in rad or m, rates per s, loads in N m or N; infinite: no limit."""

    name: str
    type: str  # fixed, revolute, continuous, prismatic, floating, planar
    parent: str  # links
    child: str
    axis: NDArray[numpy.float64]  # [3] unit, in the joint frame
    q_index: int  # the first number of this joint in q, and how many: 7 of a floating one (x y z qx qy qz qw)
    nq: int
    v_index: int  # the same in v: 6 of a floating one (linear in world axes, then angular in body axes)
    nv: int
    lower: float
    upper: float
    effort: float
    velocity: float
    damping: float  # N m s/rad, N s/m
    friction: float  # Coulomb, N m, N
    mimics: str | None  # the joint that it follows: q = multiplier * q of it + offset
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Link:
    """A link of a model."""

    name: str
    joint: str | None  # whose child it is; None: the root
    mass: float  # kg; 0: a frame
    com: NDArray[numpy.float64]  # [3] m, in the link frame
    inertia: NDArray[numpy.float64]  # [3, 3] kg m^2, about the com, in link axes


class Model:
    """A robot description. Made by Model.load(); does not change afterwards, so that threads may share it.

    Frames: world W is the frame of the root link. Transforms are [4, 4] (X_WL maps link to world coordinates), m.
    """

    def __init__(self, described: _doppel.DescribedModel):
        self._m = described
        joints, links = described.joints(), described.links()
        self._joints: Named[Joint] = Named("joint", [one["name"] for one in joints], [Joint(**one) for one in joints])
        self._links: Named[Link] = Named("link", [one["name"] for one in links], [Link(**one) for one in links])

    @classmethod
    def load(cls, source: str | os.PathLike[str], args: Mapping[str, object] | None = None,
             overlay: str | os.PathLike[str] | None = None, base: str = "fixed") -> Model:
        """Loads a description.

        source:  a bundled robot ("omarm_one"), a .urdf or .xacro file, a folder with a ROS package, or the text itself
        args:    xacro arguments, {"use_sim": True}
        overlay: corrections, a file or YAML text, applied after those that stand beside the description
        base:    "fixed" or "floating": of a root link that is not "world"

        Raises InputError with every error and its place.
        """
        if base not in ("fixed", "floating"):
            refuse("python.base", f"base is '{base}'; it must be 'fixed' or 'floating'")
        return cls(_doppel.load_model(os.fspath(source), dict(args or {}), os.fspath(overlay or ""), base == "floating"))

    @property
    def name(self) -> str:
        """The name of the robot."""
        return self._m.name

    @property
    def file(self) -> str:
        """The path of the description."""
        return self._m.file

    @property
    def nq(self) -> int:
        """The numbers of a configuration q."""
        return self._m.nq

    @property
    def nv(self) -> int:
        """The numbers of a velocity v."""
        return self._m.nv

    @property
    def mass(self) -> float:
        """kg, of all links."""
        return self._m.mass

    @property
    def joints(self) -> Named[Joint]:
        """All joints, parents first: a mapping of their names, which is also read by number."""
        return self._joints

    @property
    def links(self) -> Named[Link]:
        """All links, the root first: a mapping of their names, which is also read by number."""
        return self._links

    @property
    def driven(self) -> list[str]:
        """The names of the joints that a drive can move, in order."""
        return self._m.driven()

    @property
    def lower_limits(self) -> NDArray[numpy.float64]:
        """[nq] rad, m: a new array; -inf: none, as for the numbers of a floating joint."""
        return self._limits("lower", "q_index", self.nq, -math.inf)

    @property
    def upper_limits(self) -> NDArray[numpy.float64]:
        """[nq] rad, m: a new array; inf: none."""
        return self._limits("upper", "q_index", self.nq, math.inf)

    @property
    def velocity_limits(self) -> NDArray[numpy.float64]:
        """[nv] rad/s, m/s: a new array; inf: none."""
        return self._limits("velocity", "v_index", self.nv, math.inf)

    @property
    def effort_limits(self) -> NDArray[numpy.float64]:
        """[nv] N m, N: a new array; inf: none."""
        return self._limits("effort", "v_index", self.nv, math.inf)

    def _limits(self, what: str, index: str, size: int, none: float) -> NDArray[numpy.float64]:
        import numpy
        out = numpy.full(size, none)
        for joint in self._joints.values():
            if joint.nq == 1:
                out[getattr(joint, index)] = getattr(joint, what)
        return out

    @property
    def warnings(self) -> list[dict[str, Any]]:
        """What loading has reported: a list of dicts."""
        return self._m.diagnostics

    def __repr__(self):
        return f"<doppel.Model {self.name}: {len(self.links)} links, {len(self.driven)} driven joints>"

    def neutral(self) -> NDArray[numpy.float64]:
        """q [nq] with every joint at zero, or at its nearest limit."""
        return self._m.neutral()

    def random_configuration(self, seed: int, count: int | None = None) -> NDArray[numpy.float64]:
        """q [nq], or [count, nq], evenly within the limits, the same for a seed everywhere. Joints that mimic others follow them; one
        without limits covers a turn, or 1 m to each side."""
        rows = self._m.random_configurations(whole("seed", seed, 0, 2**64 - 1), 1 if count is None else whole("count", count))
        return rows[0] if count is None else rows

    def check(self) -> list[dict[str, Any]]:
        """What `doppel check` finds, errors first: dicts with the keys severity ("error", "warning", "note"), rule, subject,
        message, consequence, file, line, column, fix and repairable."""
        return self._m.check()

    def fk(self, q: ArrayLike, link: str | None = None) -> NDArray[numpy.float64]:
        """Forward kinematics: X_WL [4, 4] of a link, or of all [links, 4, 4] in their order. q [nq] rad, m."""
        poses = self._m.fk(numbers("q", q))
        return poses if link is None else poses[self._links.index(link)]

    def jacobian(self, q: ArrayLike, link: str, point: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[numpy.float64]:
        """The geometric Jacobian [6, nv] of a point [3] m of a link, in link coordinates: rows angular (rad/s), then linear
        (m/s), in world axes. q [nq]."""
        return self._m.jacobian(numbers("q", q), link, numbers("point", point))

    def rnea(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, gravity: ArrayLike = EARTH) -> NDArray[numpy.float64]:
        """Inverse dynamics: tau [nv] in N m or N that gives the acceleration a [nv] at q [nq] and v [nv], without damping and
        friction. gravity [3] m/s^2, world axes."""
        return self._m.rnea(numbers("q", q), numbers("v", v), numbers("a", a), numbers("gravity", gravity))

    def mass_matrix(self, q: ArrayLike) -> NDArray[numpy.float64]:
        """M [nv, nv] in kg m^2 or kg, symmetric. q [nq]."""
        return self._m.mass_matrix(numbers("q", q))

    def gravity(self, q: ArrayLike, gravity: ArrayLike = EARTH) -> NDArray[numpy.float64]:
        """tau [nv] in N m or N that holds the robot at q [nq]. gravity [3] m/s^2, world axes."""
        return self._m.gravity(numbers("q", q), numbers("gravity", gravity))

    def forward_dynamics(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, gravity: ArrayLike = EARTH) -> NDArray[numpy.float64]:
        """The acceleration a [nv] that tau [nv] in N m or N gives at q [nq] and v [nv], without damping and friction: what rnea() is
        the inverse of. Joints that mimic others follow them, and their tau acts on those. gravity [3] m/s^2, world axes."""
        import numpy
        follow = self._followers()
        bias = self.rnea(q, v, numpy.zeros(self.nv), gravity)
        load = follow.T @ (shaped("tau", tau, (self.nv,)) - bias)
        try:
            return follow @ numpy.linalg.solve(follow.T @ self.mass_matrix(q) @ follow, load)
        except numpy.linalg.LinAlgError:
            refuse("python.singular", f"'{self.name}' has a joint that moves no mass, so that its acceleration is not determined",
                   "give the links behind each joint a mass; check() names those without one")

    def _followers(self) -> NDArray[numpy.float64]:
        """[nv, free]: the rates of all joints for those of the joints that follow no other one."""
        import numpy
        out = numpy.eye(self.nv)
        followers = [joint for joint in self._joints.values() if joint.mimics is not None]
        for joint in followers:
            out[joint.v_index, self._joints[joint.mimics].v_index] = joint.multiplier
        return numpy.delete(out, [joint.v_index for joint in followers], axis=1)

    def com(self, q: ArrayLike) -> NDArray[numpy.float64]:
        """The centre of mass [3] of all links, in the world, m. q [nq]."""
        links = [link for link in self._links.values() if link.mass > 0]
        if not links:
            refuse("python.no_mass", f"'{self.name}' has no mass", "give its links an <inertial>")
        poses = self.fk(q)
        return sum(link.mass * (poses[self._links.index(link.name)] @ [*link.com, 1.0])[:3] for link in links) / self.mass

    def collisions(self, q: ArrayLike, clearance: float = 0.0) -> list[tuple[str, str]]:
        """The pairs of the robot's own links that touch at q [nq], or are nearer than `clearance` in m. Links that are joined, and
        pairs that touch always or at the start, do not count. Meshes are their triangles if they can be read, else their hulls. The
        first call takes longer, because it finds the pairs that count."""
        return self._m.collisions(numbers("q", q), single("clearance", clearance))

    def distance(self, q: ArrayLike) -> tuple[float, tuple[str, str] | None]:
        """The smallest distance in m of the pairs that collisions() tests, and the two links; (inf, None) if there is no such pair.
        Meshes are their convex hulls, which may overlap where the meshes do not; an overlap is negative."""
        return self._m.distance(numbers("q", q))

    def ik(self, target: ArrayLike, tip: str, base: str | None = None, seed: ArrayLike | None = None,
           task: str | None = None, all: bool = False, position_tolerance: float = _doppel.IK_POSITION_TOLERANCE,
           rotation_tolerance: float = _doppel.IK_ROTATION_TOLERANCE) -> NDArray[numpy.float64]:
        """Inverse kinematics: q [nq] with the link `tip` at the target, the nearest to the seed; joints that are not part of
        the arm keep their value of the seed.

        target: X_BT [4, 4] of the tip in the link `base` (None: the root), or a position [3] in m, whatever the rotation
        seed:   q [nq]; None: neutral()
        task:   what of the rotation counts: "pose" all, "axis" the direction of the tool, "position" nothing
        all:    every solution [n, nq], the nearest first

        Raises IkError with the reason, by how much, and the nearest configuration.
        """
        import numpy
        X_BT = numbers("target", target)
        if X_BT.shape == (3,):
            position, X_BT, task = X_BT, numpy.eye(4), task or "position"
            X_BT[:3, 3] = position
        found, why = self._m.ik(X_BT, self.neutral() if seed is None else numbers("seed", seed), tip, base or "", task or "pose",
                                position_tolerance, rotation_tolerance, all)
        if why:
            raise IkError(f"'{tip}' does not reach the target: {why}", found[0])
        return found if all else found[0]

    def to_urdf(self, file: str | os.PathLike[str] | None = None) -> str:
        """One plain URDF with all corrections; also written to `file`. Meshes are named relative to the file, or to the
        working directory."""
        return self._convert("to_urdf", file)

    def to_mjcf(self, file: str | os.PathLike[str] | None = None) -> str:
        """The robot for MuJoCo. With a file, meshes that MuJoCo cannot read are written beside it as OBJ."""
        return self._convert("to_mjcf", file)

    def to_sdf(self, file: str | os.PathLike[str] | None = None) -> str:
        """The robot as an SDF 1.11 model for Gazebo."""
        return self._convert("to_sdf", file)

    def _convert(self, function: str, file: str | os.PathLike[str] | None) -> str:
        from . import _doppel_tools
        folder = os.path.dirname(os.path.abspath(file)) if file else os.getcwd()
        text, _ = getattr(_doppel_tools, function)(self._m, folder, file is not None)
        if file:
            with open(file, "w", encoding="utf-8") as out:
                out.write(text)
        return text


def quat_wxyz(X: ArrayLike) -> NDArray[numpy.float64]:
    """The rotation of a transform [4, 4] or [3, 3] as a unit quaternion [4], w first, w >= 0."""
    x, y, z, w = quat_xyzw(X)
    import numpy
    return numpy.array([w, x, y, z])


def quat_xyzw(X: ArrayLike) -> NDArray[numpy.float64]:
    """The rotation of a transform [4, 4] or [3, 3] as a unit quaternion [4], w last as in ROS, w >= 0."""
    import numpy
    R = shaped("X", X, (4, 4), (3, 3))[:3, :3]
    if not (numpy.allclose(R @ R.T, numpy.eye(3), rtol=0, atol=ROTATION_TOLERANCE) and numpy.linalg.det(R) > 0):
        refuse("python.pose", "X is no rotation", "its upper left 3x3 part must be orthonormal, with the determinant 1")
    squares = numpy.array([1 + R[0, 0] - R[1, 1] - R[2, 2], 1 - R[0, 0] + R[1, 1] - R[2, 2],
                           1 - R[0, 0] - R[1, 1] + R[2, 2], 1 + R.trace()])  # 4 times those of x, y, z, w
    pairs = numpy.array([[0, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[2, 1] - R[1, 2]],
                         [0, 0, R[1, 2] + R[2, 1], R[0, 2] - R[2, 0]],
                         [0, 0, 0, R[1, 0] - R[0, 1]], [0, 0, 0, 0]])
    products = pairs + pairs.T + numpy.diag(squares)
    quaternion = products[numpy.argmax(squares)]
    quaternion = quaternion / numpy.linalg.norm(quaternion)
    return -quaternion if quaternion[3] < 0 else quaternion


def pose(position: ArrayLike, *, quat_wxyz: ArrayLike | None = None, quat_xyzw: ArrayLike | None = None,
         rpy: ArrayLike | None = None) -> NDArray[numpy.float64]:
    """A transform [4, 4] from a position [3] in m and a rotation: a quaternion [4] of either order, or roll, pitch and yaw [3]
    in rad about fixed axes, as in URDF; without one: none."""
    import numpy
    if sum(one is not None for one in (quat_wxyz, quat_xyzw, rpy)) > 1:
        refuse("python.pose", "there are several rotations", "pass one of them: quat_wxyz, quat_xyzw or rpy")
    out = numpy.eye(4)
    out[:3, 3] = shaped("position", position, (3,))
    if rpy is not None:
        angles = shaped("rpy", rpy, (3,))
        (sr, sp, sy), (cr, cp, cy) = numpy.sin(angles), numpy.cos(angles)
        out[:3, :3] = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                       [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]]
    elif quat_wxyz is not None or quat_xyzw is not None:
        quaternion = shaped("the quaternion", quat_wxyz if quat_xyzw is None else quat_xyzw, (4,))
        length = numpy.linalg.norm(quaternion)
        if not 0 < length < math.inf:
            refuse("python.pose", f"the quaternion {quaternion.tolist()} is no rotation", "its length must not be zero")
        w, x, y, z = (quaternion if quat_xyzw is None else numpy.roll(quaternion, 1)) / length
        out[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                       [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                       [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    return out
