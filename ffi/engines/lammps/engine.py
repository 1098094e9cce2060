"""LAMMPS moves spheres for Turbid: Hertz's law with Tsuji's damping and Mindlin's friction (`pair_style granular`), and adhesion by `dmt` and `jkr`.

Works with the library of Debian 12, `liblammps0`: 29 September 2021, update 2. An error in LAMMPS ends the process that it runs in: a
second one waits for it, and says what LAMMPS said last.
"""
import ctypes
import math
import os
import signal
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import protocol  # noqa: E402

os.environ.setdefault("OMPI_MCA_ess_singleton_isolated", "1")
library = ctypes.CDLL("liblammps.so.0")
for name in ("lammps_open_no_mpi", "lammps_extract_atom", "lammps_extract_compute", "lammps_extract_fix"):
    getattr(library, name).restype = ctypes.c_void_p
CALLBACK = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int, *[ctypes.c_void_p] * 3)

# Distance beyond contact within which pairs are listed, over the smallest radius.
SKIN = 0.3


def tsuji(restitution):
    """The number that LAMMPS must be given for a coefficient of restitution, and the damping over sqrt(k m) for it.

    LAMMPS takes a polynomial of its number for the damping; of Hertz's law with a dashpot c sqrt(m F / d) it is exactly
    c = sqrt(5) beta, beta = -ln e / sqrt(ln^2 e + pi^2).
    """
    log = math.log(restitution)
    wanted = -math.sqrt(5) * log / math.sqrt(log * log + math.pi ** 2)
    damping = lambda e: sum(c * e ** n for n, c in enumerate((1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)))
    if wanted > damping(0):
        raise protocol.Refusal(f"a coefficient of restitution of {restitution} is too small: LAMMPS has those from 0.12")
    low, high = 0.0, 1.001  # The polynomial vanishes at 1.00065.
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if damping(middle) > wanted else (low, middle)
    return low


def law(contact, a, b):
    """Coefficients of `granular` for two materials, given by their indices."""
    materials, pair = contact["materials"], contact["pairs"][a * len(contact["materials"]) + b]
    compliance = lambda m: (1 - m["poisson_ratio"] ** 2) / m["youngs_modulus"]
    shear = lambda m: 2 * (2 - m["poisson_ratio"]) * (1 + m["poisson_ratio"]) / m["youngs_modulus"]
    e_star, g_star = (1 / (f(materials[a]) + f(materials[b])) for f in (compliance, shear))
    # LIGGGHTS's damping along the surface: in proportion to the roots of the stiffnesses.
    tangential = math.sqrt(4 * g_star / e_star)
    friction = pair["friction_kinetic"] if pair["friction_static"] > 0 else 0.0
    spring = "mindlin_rescale/force" if contact["friction"] == "mindlin" else "mindlin"
    normal = f"hertz {4 / 3 * e_star!r} {tsuji(pair['restitution'])!r}"
    if contact["cohesion"] != "none":
        # With Poisson's ratio 0 the modulus is E / 2 for pairs and at walls; LAMMPS has the surface energy, half of the work of adhesion.
        normal = f"{contact['cohesion']} {2 * e_star!r} {tsuji(pair['restitution'])!r} 0.0 {pair['work_of_adhesion'] / 2!r}"
    return (f"{normal} "
            f"tangential {spring} {8 * g_star!r} {tangential!r} {friction!r} damping tsuji")


class Lammps:
    laws = {"cohesion": ("dmt", "jkr")}
    hello = {"name": "LAMMPS 29 Sep 2021", "shapes": ["sphere"], "walls": ["plane"], "contacts": True, "saves": True}

    def __init__(self):
        self.screen = os.memfd_create("screen")
        self.watch()
        arguments = [b"lammps", b"-log", b"none", b"-screen", f"/proc/self/fd/{self.screen}".encode()]
        arguments = (ctypes.c_char_p * 5)(*arguments)
        self.lammps = ctypes.c_void_p(library.lammps_open_no_mpi(5, arguments, None))
        self.callback = CALLBACK(self.apply)

    def watch(self):
        """Returns in a second process; the first one ends as that does, with its last words."""
        worker = os.fork()
        if worker == 0:
            PR_SET_PDEATHSIG = 1
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            return
        code = os.waitstatus_to_exitcode(os.waitpid(worker, 0)[1])
        said = os.pread(self.screen, os.fstat(self.screen).st_size, 0).replace(b"\0", b"").splitlines()
        if code:
            sys.stderr.write(b"\n".join(said[-4:]).decode(errors="replace") + "\n")
            sys.stderr.flush()
        if code < 0:
            os.kill(os.getpid(), -code)
        os._exit(code)

    def command(self, *lines):
        for line in lines:
            library.lammps_command(self.lammps, line.encode())

    def array(self, name, columns=3, kind=ctypes.c_double):
        """An array of the atoms, in LAMMPS's order."""
        address = library.lammps_extract_atom(self.lammps, name)
        return self.block(address, columns, len(self.bodies), kind)

    @staticmethod
    def block(address, columns, rows, kind=ctypes.c_double):
        if columns > 1:
            address = ctypes.c_void_p.from_address(address).value
        return (kind * (columns * rows)).from_address(address)

    def set_up(self, case, bodies):
        self.case, self.bodies = case, bodies
        grown = (case["contact"] or {"enlargement": 0.0})["enlargement"]
        kinds = [case["templates"][body[1]] for body in bodies]
        self.mass = [kind["mass"] for kind in kinds]
        self.material = [kind["material"] + 1 for kind in kinds]
        self.radius = [kind["shape"]["radius"] + grown for kind in kinds]
        # LAMMPS has the inertia of a sphere of the radius of contact: torques are as many times larger.
        self.ratio = [(radius / (radius - grown)) ** 2 for radius in self.radius]
        self.loads = [(0.0,) * 6] * len(bodies)
        self.begin()

    def begin(self, saved=None):
        """Sets LAMMPS up, from the start or from what it saved."""
        case, n = self.case, len(self.bodies)
        contact, size = case["contact"], case["box"]["size"]
        types = len(contact["materials"]) if contact else 1
        self.command("clear", "units si", "atom_style sphere", "atom_modify map array sort 0 0.0", "newton off",
                     "boundary " + " ".join("p" if p else "f" for p in case["box"]["periodic"]),
                     "comm_modify vel yes")
        self.step = None
        if saved:
            with tempfile.NamedTemporaryFile() as file:
                file.write(saved)
                file.flush()
                self.command(f"read_restart {file.name}")
        else:
            edges = " ".join(f"0 {edge!r}" for edge in size)
            self.command(f"region box block {edges} units box", f"create_box {types} box")
            ids = (ctypes.c_int * n)(*range(1, n + 1))
            x, v = ((ctypes.c_double * (3 * n))(*(c for body in self.bodies for c in body[at:at + 3])) for at in (2, 9))
            made = library.lammps_create_atoms(self.lammps, n, ids, (ctypes.c_int * n)(*self.material), x, v, None, 0)
            if made != n:
                raise protocol.Refusal(f"LAMMPS made {made} atoms instead of {n}: some are outside of the box")
            self.order()
            for name, columns, values in ((b"radius", 1, self.radius), (b"rmass", 1, self.mass),
                                          (b"omega", 3, [body[12:15] for body in self.bodies])):
                array = self.array(name, columns)
                for k, index in enumerate(self.indices):
                    array[columns * k:columns * k + columns] = values[index] if columns > 1 else [values[index]]
        self.command(f"neighbor {SKIN * min(self.radius)!r} bin", "neigh_modify delay 0 every 1 check yes",
                     "pair_style granular")
        for a in range(types):
            for b in range(a, types):
                coefficients = law(contact, a, b) if contact else "hertz 1.0 1.0 tangential mindlin 1.0 1.0 0.0"
                self.command(f"pair_coeff {a + 1} {b + 1} {coefficients}")
        if not contact:
            self.command("neigh_modify exclude group all all")
        self.walls = []
        for index, wall in enumerate(case["walls"]):
            normal, point = wall["surface"]["normal"], wall["surface"]["point"]
            axis = max(range(3), key=lambda i: abs(normal[i]))
            slides = [(i, u) for i, u in enumerate(wall["velocity"]) if u]
            if abs(normal[axis]) < 1 - 1e-9 or len(slides) > 1:
                raise protocol.Refusal(f"the wall {wall['name']}: LAMMPS has planes across x, y or z that slide along one axis")
            at = f"{point[axis]!r} NULL" if normal[axis] > 0 else f"NULL {point[axis]!r}"
            shear = "".join(f" shear {'xyz'[i]} {u!r}" for i, u in slides)
            for kind in sorted(set(self.material)):
                group, fix = f"material{kind}", f"wall{index}_{kind}"
                self.command(f"group {group} type {kind}",
                             f"fix {fix} {group} wall/gran granular {law(contact, kind - 1, wall['material'])} "
                             f"{'xyz'[axis]}plane {at}{shear} contacts")
                self.walls.append((fix.encode(), index))
        # After the walls, whose torque it scales too.
        self.command("fix loads all external pf/callback 1 1", "fix motion all nve/sphere", "thermo 1000000000",
                     "compute pairs all property/local patom1 patom2 cutoff radius",
                     "compute forces all pair/local fx fy fz p1 p2 p3 cutoff radius")
        library.lammps_set_fix_external_callback(self.lammps, b"loads", self.callback, None)
        self.order()

    def order(self):
        """Index of each atom in LAMMPS's order."""
        tags = self.array(b"id", 1, ctypes.c_int)
        self.indices = [tag - 1 for tag in tags]
        if sorted(self.indices) != list(range(len(self.bodies))):
            raise protocol.Refusal("LAMMPS has lost a particle")

    def apply(self, _pointer, _step, _count, _tags, _positions, forces):
        """Adds the loads to the forces of a sub-step; the rest of the torques are those of the contacts."""
        loads = [self.loads[index] for index in self.indices]
        ratios = [self.ratio[index] for index in self.indices]
        rows = len(loads)
        self.block(forces, 3, rows)[:] = [c for load in loads for c in load[:3]]
        torque = self.array(b"torque")
        torque[:] = [q * (t + c) for k, (load, q) in enumerate(zip(loads, ratios))
                     for t, c in zip(torque[3 * k:3 * k + 3], load[3:])]

    def advance(self, step, substeps, loads):
        gravity = self.case["gravity"]
        before = self.loads
        self.loads = [tuple(f + m * g for f, g in zip(load[1:4], gravity)) + load[4:]
                      for load, m in zip(loads, self.mass)]
        if step != self.step:
            # One set-up only: `wall/gran` takes the damping for a coefficient of restitution in each of them.
            if self.step:
                self.begin(self.save())
            self.command(f"timestep {step!r}", "run 0 post no")
            self.step = step
        else:
            # The first half kick must have the new loads.
            for name, at, factors in ((b"f", 0, [1.0] * len(loads)), (b"torque", 3, self.ratio)):
                array = self.array(name)
                array[:] = [c + factors[index] * (self.loads[index][at + i] - before[index][at + i])
                            for k, index in enumerate(self.indices) for i, c in enumerate(array[3 * k:3 * k + 3])]
        # To write a restart file LAMMPS finds its ghosts again, and then takes the partners of contacts from lists with the numbers of the
        # ones before: these must be made in the last sub-step.
        if substeps > 1:
            self.command(f"run {substeps - 1} pre no post no")
        self.command("neigh_modify check no", "run 1 pre no post no", "neigh_modify check yes")
        os.ftruncate(self.screen, 0)
        self.order()
        x, v, w, f, t = (list(self.array(name)) for name in (b"x", b"v", b"omega", b"f", b"torque"))
        states = []
        for k, index in enumerate(self.indices):
            at, load, q = slice(3 * k, 3 * k + 3), self.loads[index], self.ratio[index]
            force = [a - b for a, b in zip(f[at], load[:3])]
            torque = [a / q - b for a, b in zip(t[at], load[3:])]
            states.append((self.bodies[index][0], *x[at], 0, 0, 0, 1, *v[at], *w[at], *force, *torque))
        return states

    def contacts(self):
        # Style 2 is local, type 2 an array, type 0 its number of rows.
        rows = [ctypes.c_int.from_address(library.lammps_extract_compute(self.lammps, b"forces", 2, 0)).value]
        found = []
        if rows[0]:
            pairs = self.block(library.lammps_extract_compute(self.lammps, b"pairs", 2, 2), 2, rows[0])
            forces = self.block(library.lammps_extract_compute(self.lammps, b"forces", 2, 2), 6, rows[0])
            for row in range(rows[0]):
                a, b = (self.bodies[int(tag) - 1][0] for tag in pairs[2 * row:2 * row + 2])
                values = forces[6 * row:6 * row + 6]
                force = [normal + tangential for normal, tangential in zip(values, values[3:])]
                if any(force):
                    found.append((a, b, *force) if a < b else (b, a, *(-c for c in force)))
        for fix, wall in self.walls:
            # Style 1 is by atom.
            values = self.block(library.lammps_extract_fix(self.lammps, fix, 1, 2, 0, 0), 8, len(self.bodies))
            for k, index in enumerate(self.indices):
                touches, *force = values[8 * k:8 * k + 4]
                if touches:
                    found.append((self.bodies[index][0], protocol.WALL - wall, *force))
        return found

    def save(self):
        with tempfile.NamedTemporaryFile() as file:
            self.command(f"write_restart {file.name}")
            saved = file.read()
        # As one that is resumed: lists and forces are made anew.
        self.begin(saved)
        return saved

    def restore(self, saved):
        self.begin(saved)


protocol.serve(Lammps())
