"""A case that is stepped in this process."""

import functools
import threading
from typing import Any, Callable, Iterable, NamedTuple, Optional, TypeVar, Union, cast

import numpy as np

from . import _turbid
from .results import Case, split_case

PARTICLE = np.dtype(
    [
        ("id", "<u8"),
        ("kind", "<u8"),
        ("position", "<f8", 3),
        ("orientation", "<f8", 4),
        ("velocity", "<f8", 3),
        ("angular_velocity", "<f8", 3),
        ("angular_momentum", "<f8", 3),
        ("contact_force", "<f8", 3),
        ("contact_torque", "<f8", 3),
    ]
)
"""A particle: ``position`` of the centre of mass (m), ``orientation`` as unit quaternion (i, j, k, w) from the principal axes of
the body to those of the box, ``velocity`` (m/s), ``angular_velocity`` (1/s), ``angular_momentum`` (kg m^2/s), ``contact_force`` (N) and
``contact_torque`` (N m) of the last sub-step. ``kind`` counts the kinds of the case from 0."""

LOAD = np.dtype([("force", "<f8", 3), ("torque", "<f8", 3)])
"""A load: ``force`` (N) on the centre of mass and ``torque`` (N m) about it."""

Engine = Callable[[np.recarray, np.recarray, float], None]
"""Moves particles: gets them (:data:`PARTICLE`, to be changed in place), the loads of the fluid (:data:`LOAD`, buoyancy included,
weight not) and the time step (s)."""

ExternalLoad = Callable[[float, np.recarray], Any]
"""Loads of the caller: from the time (s) and the particles, forces (N) of shape (n, 3) or loads (:data:`LOAD`) of shape (n,)."""


class Fields(NamedTuple):
    """The fluid on the cells of the box, or with a communicator of the block of this process; arrays of ``float32`` that share no memory with the simulation."""

    velocity: np.ndarray
    """Velocity (m/s), shape (nx, ny, nz, 3); in a particle or a wall that of its motion."""
    pressure: np.ndarray
    """Pressure (Pa) above that of the fluid at rest, without the hydrostatic pressure; shape (nx, ny, nz)."""
    solid_fraction: np.ndarray
    """Solid volume fraction (-), 1 in walls; shape (nx, ny, nz)."""


def _checked(name: str, value: Any, shape: "tuple[int, ...]", dtype: Any = np.float64) -> np.ndarray:
    """The array of ``value``, or a ``ValueError`` that says what was expected."""
    dtype = np.dtype(dtype)
    array = value if isinstance(value, np.ndarray) else np.asarray(value, dtype=dtype)
    in_columns = array.ndim > 1 and array.flags.f_contiguous and not array.flags.c_contiguous
    if array.dtype != dtype or array.shape != shape or in_columns:
        kind = str(dtype) if dtype.names is None else " ".join(dtype.names)
        got = str(array.dtype) if array.dtype.names is None else " ".join(array.dtype.names)
        order = "Fortran" if in_columns else "C"
        raise ValueError(
            f"{name}: expected an array of {kind} of shape {shape} in C order, got {got} of shape {array.shape} in {order} order"
        )
    return array


_Method = TypeVar("_Method", bound=Callable[..., Any])


def _alone(method: _Method) -> _Method:
    """The method, during which other threads that call such methods of the same simulation wait."""

    @functools.wraps(method)
    def alone(self: "Simulation", *arguments: Any, **named: Any) -> Any:
        # In a forked process the lock may be that of a thread that is not there.
        self._session.check_process()
        with self._lock:
            return method(self, *arguments, **named)

    return cast(_Method, alone)


def _column(field: str, meaning: str) -> Any:
    """A property that is a column of all particles."""

    def read(self: "Simulation") -> np.ndarray:
        return self.particles[field]

    @_alone
    def write(self: "Simulation", value: Any) -> None:
        states = self.particles
        column = states[field]
        column[...] = _checked(field, value, column.shape)
        self.particles = states

    return property(read, write, doc=meaning)


class Simulation:
    """A case at rest, ready to be stepped. Arrays are copies of the state, ascending by id, that may be changed and set again.

    :param case: path of a case file (a ``str`` that ends with ``.toml``, or a path object), the text of one, or a dict with
        its keys.
    :param options: keys to replace, as ``--set`` of the program: ``["lattice.relaxation_time=0.6"]``.
    :param threads: number of ranks, each a thread; by default that of the case, else all cores. Results do not depend on it.
    :param engine: moves the particles in place of the engine of the case: a function (:data:`Engine`), or ``"caller"`` if the
        caller sets :attr:`particles` after each step. Contacts, gravity and prescribed motions are then its business.
    :param comm: communicator of ``mpi4py``, of whose processes each is a rank, in place of ``threads``. All methods and properties but those
        of the case are collective then: every process uses them, in the same order. Particles, loads and masses are those of this process: those that it
        has set last, wherever they are, or, if it has set none, those in its :attr:`block` now. A process sets any of the particles,
        each by one process. Needs a package that was built with the feature ``mpi``.

    Several threads may use one simulation: a step is made whole, with its engine and load functions, before another thread gets the
    state or makes the next step. So these functions must not wait for threads that do. In a forked process a simulation of its
    parent raises :class:`turbid.Error` at every call, because its threads are not there.

    A failure (:class:`turbid.Error` with ``code`` 3) is raised by the :meth:`step` in which it happens; a fluid that is too fast is
    noticed in every eighth step only, and at the end of :meth:`run`. From then on each step raises the same error: open a
    new simulation. The state that it has come to can still be read.

    Raises :class:`turbid.Error` for a case that is not possible, ``ValueError`` for arguments of the wrong type.

    >>> import turbid
    >>> simulation = turbid.Simulation({
    ...     "domain": {"size": [4e-3, 4e-3, 4e-3]},
    ...     "fluid": {"density": 1000.0, "viscosity": 1e-5},
    ...     "lattice": {"cells_per_diameter": 4, "relaxation_time": 0.6},
    ...     "particles": [{"shape": {"sphere": {"diameter": 1e-3}}, "density": 2500.0, "list": [[2e-3, 2e-3, 2e-3]]}],
    ...     "run": {"end": {"steps": 10}},
    ... })
    >>> simulation.run()
    >>> bool(simulation.velocities[0, 2] < 0)
    True
    """

    def __init__(
        self,
        case: Case,
        *,
        options: Iterable[str] = (),
        threads: Optional[int] = None,
        engine: Union[None, str, Engine] = None,
        comm: Any = None,
    ) -> None:
        if not (engine is None or engine == "caller" or callable(engine)):
            raise ValueError(f'engine: expected None, "caller" or a function, got {engine!r}')
        if comm is not None and threads is not None:
            raise ValueError("threads: the processes of the communicator are the ranks")
        form, text = split_case(case)
        handle = None if comm is None else comm.py2f()
        self._session = _turbid.Session(form, text, list(options), threads, engine is not None, handle)
        self._comm = comm
        self._is_driven = engine is not None
        self._engine = engine if callable(engine) else None
        self._lock = threading.RLock()
        # Number of steps and particles before a step that the engine has not made yet.
        self._before: "Optional[tuple[int, np.recarray]]" = None
        self._external: Optional[ExternalLoad] = None
        kinds = self._session.kinds()
        self._of_kind = [np.array([kind[at] for kind in kinds], dtype=float) for at in range(5)]
        self._all_kinds = None if comm is not None else self.particles["kind"].astype(int)

    @property
    @_alone
    def _kind(self) -> np.ndarray:
        """The kind of each particle."""
        return self.particles["kind"].astype(int) if self._all_kinds is None else self._all_kinds

    def step(self, count: int = 1) -> None:
        """Advances by ``count`` time steps. Ctrl-C ends it between two steps; other threads of Python run meanwhile.

        With an ``engine`` that is a function, an exception in it, Ctrl-C included, ends the call within a step, which the fluid has
        made and the particles have not. The next call first calls the engine again for that step, with the same particles and loads
        (``step(0)`` does nothing else), unless :attr:`particles` has been set meanwhile.
        """
        if count < 0:
            raise ValueError(f"count: expected at least 0 steps, got {count}")
        self._complete_step()
        for _ in range(count):
            self._advance()

    @_alone
    def _advance(self, last: Optional[int] = None) -> bool:
        """Makes a step, unless ``last`` steps are done; true if it has."""
        if last is not None and self.steps >= last:
            return False
        self._complete_step()
        if self._external is not None:
            self._set_external(self._external(self.time, self.particles))
        if self._engine is not None:
            self._before = self.steps, self.particles
        try:
            self._session.advance(1)
        except _turbid.Error:
            # A step that has failed is not completed.
            self._before = None
            raise
        except BaseException:
            # Of the handler of a signal, which runs after the step.
            self._complete_step()
            raise
        self._complete_step()
        return True

    @_alone
    def _complete_step(self) -> None:
        """Lets the engine make the step that the fluid has made, if it has not."""
        if self._engine is None or self._before is None or self._before[0] == self.steps:
            return
        states = self._before[1].copy()
        self._engine(states, self.loads, self.time_step)
        self.particles = states

    def run(
        self,
        until: Optional[float] = None,
        *,
        callback: "Optional[Callable[[Simulation], Any]]" = None,
        every: int = 1,
    ) -> None:
        """Advances to the step nearest to the time ``until`` (s), by default to the end of the case, and checks for failures.

        ``callback`` is called with the simulation after each ``every`` steps; the run ends early if it returns ``False``.
        """
        last = self._session.end_step if until is None else self._session.nearest_step(until)
        if every < 1:
            raise ValueError(f"every: expected at least 1 step, got {every}")
        self._complete_step()
        while self.steps < last:
            for _ in range(last if callback is None else every):
                if not self._advance(last):
                    break
            if callback is not None and callback(self) is False:
                break
        self._session.check()

    @property
    @_alone
    def time(self) -> float:
        """Time since the start (s)."""
        return self.steps * self.time_step

    @property
    @_alone
    def steps(self) -> int:
        """Steps done."""
        return self._session.steps()

    @property
    def time_step(self) -> float:
        """Time step (s)."""
        return self._session.time_step

    @property
    def end(self) -> float:
        """Time at the end of the case (s)."""
        return self._session.end_step * self.time_step

    @property
    def cells(self) -> "tuple[int, int, int]":
        """Number of cells (nx, ny, nz)."""
        x, y, z = self._session.cells
        return x, y, z

    @property
    def dx(self) -> float:
        """Edge of a cell (m). Cell ``(i, j, k)`` has its centre at ``(i + 1/2, j + 1/2, k + 1/2) * dx``."""
        return self._session.dx

    @property
    def size(self) -> np.ndarray:
        """Edges of the box (m), shape (3,). It begins at the origin."""
        return np.array(self._session.cells) * self.dx

    @property
    def block(self) -> "tuple[tuple[int, int, int], tuple[int, int, int]]":
        """First cell of this process along x, y, z, and the one after the last: of the whole box without a communicator."""
        (x, y, z), (u, v, w) = self._session.block
        return (x, y, z), (u, v, w)

    @property
    def periodic(self) -> "tuple[bool, bool, bool]":
        """Whether the box is periodic along x, y, z."""
        x, y, z = self._session.periodic
        return x, y, z

    @property
    def gravity(self) -> np.ndarray:
        """Gravity (m/s^2), shape (3,)."""
        return np.array(self._session.gravity)

    @property
    def warnings(self) -> "list[str]":
        """Warnings about a valid case."""
        return self._session.warnings

    @property
    def toml(self) -> str:
        """The case as the text of a case file."""
        return self._session.toml

    @property
    @_alone
    def particles(self) -> np.recarray:
        """The particles (:data:`PARTICLE`), shape (n,): ``simulation.particles.position[:, 2]`` are heights (m).

        To be set with position, orientation, velocity and angular velocity of all particles; what else is in it follows. Bodies that
        overlap others, with which they do not move as one, or walls by more than a quarter of their thickness are refused, and so are
        bodies that are more than a cell from where they were, before the last step if the caller moves them.
        """
        return np.frombuffer(self._session.particles(), dtype=PARTICLE).view(np.recarray)

    @particles.setter
    @_alone
    def particles(self, states: np.ndarray) -> None:
        # Several processes check together that they give all of them.
        count = len(self._kind) if self._comm is None else len(states)
        rows = _checked("particles", states, (count,), PARTICLE).tobytes()
        # First, so that a signal after the call leaves no move to be made twice.
        before, self._before = self._before, None
        try:
            self._session.set_particles(rows)
        except _turbid.Error:
            self._before = before
            raise

    positions = _column("position", "Positions of the centres of mass (m), shape (n, 3); may be set.")
    orientations = _column("orientation", "Unit quaternions (i, j, k, w), shape (n, 4); see :data:`PARTICLE`. May be set.")
    velocities = _column("velocity", "Velocities (m/s), shape (n, 3); may be set.")
    angular_velocities = _column("angular_velocity", "Angular velocities (1/s), shape (n, 3); may be set.")

    @property
    @_alone
    def loads(self) -> np.recarray:
        """Loads of the fluid in the last step (:data:`LOAD`), shape (n,): buoyancy is part of them, weight is not. Zeros before the
        first step and without a fluid."""
        return np.frombuffer(self._session.loads(), dtype=LOAD).view(np.recarray)

    @_alone
    def set_external_load(self, load: Union[None, np.ndarray, ExternalLoad]) -> None:
        """Adds loads to those of the fluid, from now on: a function (:data:`ExternalLoad`), which is called before each step, or an
        array as it returns, which stays. ``None`` ends it. For the engine of the case; others decide themselves what acts."""
        if self._is_driven:
            raise ValueError("external load: the caller moves the particles, so no load acts on them")
        self._external = load if callable(load) else None
        if not callable(load):
            self._set_external(np.zeros((len(self._kind), 3)) if load is None else load)

    def _set_external(self, load: Any) -> None:
        count = len(self._kind)
        rows = np.zeros(count, dtype=LOAD)
        if isinstance(load, np.ndarray) and load.dtype.names is not None:
            rows[...] = _checked("external load", load, (count,), LOAD)
        else:
            rows["force"] = _checked("external load", load, (count, 3))
        self._session.set_external_loads(rows.tobytes())

    @_alone
    def fields(self) -> Fields:
        """The :class:`Fields` of the cells in :attr:`block`, those of the whole box without a communicator, as they are now. Raises
        ``ValueError`` without a fluid."""
        if not self._session.has_fluid:
            raise ValueError("fields: the case has no fluid")
        first, end = self.block
        x, y, z = (high - low for low, high in zip(first, end))
        # In memory x varies fastest: the arrays are views of it with their axes turned round.
        velocity, pressure, solid = (np.frombuffer(data, dtype=np.float32) for data in self._session.fields())
        return Fields(
            velocity.reshape(z, y, x, 3).transpose(2, 1, 0, 3), pressure.reshape(z, y, x).T, solid.reshape(z, y, x).T
        )

    @property
    def masses(self) -> np.ndarray:
        """Masses of the particles (kg), shape (n,)."""
        return (self._of_kind[0] * self._of_kind[1])[self._kind]

    @property
    def volumes(self) -> np.ndarray:
        """Volumes of the particles (m^3), shape (n,)."""
        return self._of_kind[1][self._kind]

    @property
    def radii(self) -> np.ndarray:
        """Circumscribed radii of the particles (m), shape (n,): the radius of a sphere."""
        return self._of_kind[2][self._kind]

    @property
    def moments(self) -> np.ndarray:
        """Principal moments of inertia of the particles (kg m^2), shape (n, 3)."""
        return self._of_kind[3][self._kind]

    @property
    def frames(self) -> np.ndarray:
        """Unit quaternions (i, j, k, w) from the principal axes of each body to those in which the case gives its shape, shape
        (n, 4)."""
        return self._of_kind[4][self._kind]

    @_alone
    def mean_flow(self) -> "tuple[np.ndarray, float]":
        """Mean velocity of fluid and particles together (m/s), shape (3,), and solid volume fraction (-) of the box."""
        velocity, fraction = self._session.mean_flow()
        return np.array(velocity), fraction

    @property
    @_alone
    def state_hash(self) -> str:
        """Hash over all populations and particle states, 16 hexadecimal digits: the same for any number of threads."""
        return f"{self._session.state_hash():016x}"
